"""Export of a watched algorithm: one step as a picture, all as a film or as a page."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.text import Text

from dmplay.draw.options import DrawOptions
from dmplay.draw.step_frame import compose_pictures, compose_step_rows
from dmplay.errors import BadParameter
from dmplay.game.command_line_results import Printout
from dmplay.game.export_formats import check_extension_fits_format
from dmplay.game.watching import WatchedSteps
from dmplay.output.film import texts_to_animated_svg
from dmplay.output.html_export import BoardAndPanel, PageSteps, open_spooled_file, render_steps_page
from dmplay.output.html_markup import render_html_rows
from dmplay.output.svg_export import choose_picture_path, text_to_svg, write_or_print

DEFAULT_COLUMNS, DEFAULT_ROWS = 80, 24
MAX_FILM_STEPS = 300  # of longer runs, evenly spaced steps are indices


class StepExport(NamedTuple):
    """The options of an export: the format, the size and the step, by index; None for the last."""

    format_name: str
    size: DrawOptions
    step: int | None = None


def render_step(watched: WatchedSteps, index: int, size: DrawOptions) -> Text:
    """Return a step with its title as text of a size."""
    step, total = watched.steps[index], len(watched.steps)
    title = Text(f"{watched.title}: {step.title} (step {index + 1} of {total})", style="bold")
    rows = compose_step_rows(step, watched.problem, size._replace(height=size.height - 1))
    return Text("\n", no_wrap=True).join([title, *rows])


def render_svg(watched: WatchedSteps, export: StepExport) -> Iterator[str]:
    """Yield one step as an SVG picture."""
    index = len(watched.steps) - 1 if export.step is None else export.step
    text = render_step(watched, index, export.size)
    yield text_to_svg(text, f"dmplay watch {watched.title}", width=export.size.width)


def render_film(watched: WatchedSteps, export: StepExport) -> Iterator[str]:
    """Yield all steps as an animated SVG."""
    count = len(watched.steps)
    indices = np.unique(np.linspace(0, count - 1, min(count, MAX_FILM_STEPS)).round().astype(int))
    texts = (render_step(watched, index, export.size) for index in indices.tolist())
    title = f"dmplay watch {watched.title}"
    yield from texts_to_animated_svg(texts, len(indices), title, export.size.width)


def render_html(watched: WatchedSteps, export: StepExport) -> Iterator[str]:
    """Yield a page that shows one step at a time, and lists all of them."""
    with open_spooled_file() as log, open_spooled_file() as data:
        steps = PageSteps(1 if export.step is None else export.step + 1, log, data)
        for number, step in enumerate(watched.steps, 1):
            pictures = Text("\n").join(compose_pictures(step, watched.problem, export.size))
            content = BoardAndPanel(render_html_rows(pictures), [])
            text = " ".join(filter(None, [f"{step.title}.", *step.sentences, step.formula]))
            steps.add_step(number, content, text)
        algorithm = watched.algorithm
        goal = f"{algorithm.description} ({algorithm.source})"
        result = " ".join(watched.steps[-1].sentences[:2])
        yield from render_steps_page(steps, f"dmplay watch {watched.title}", goal, result)


STEP_RENDERERS: dict[str, Callable[[WatchedSteps, StepExport], Iterator[str]]] = {
    "svg": render_svg,
    "film": render_film,
    "html": render_html,
}


def export_algorithm_steps(
    watched: WatchedSteps, export: StepExport, output: Path | None, *, force: bool
) -> Printout:
    """Write the steps of an algorithm to a file, or return them as text to be printed.

    If a terminal would get the code of a picture, a new file is written and its path returned.
    """
    check_extension_fits_format(output, export.format_name)
    if export.format_name == "film" and export.step is not None:
        raise BadParameter("--step: a film shows all steps; use --svg or --html")
    for _ in watched.iter_steps():
        pass
    extension = "html" if export.format_name == "html" else "svg"
    path = choose_picture_path(output, watched.algorithm.name, extension)
    content = STEP_RENDERERS[export.format_name](watched, export)
    printout = write_or_print(path, content, force=force)
    return printout._replace(text=f"wrote {path}") if path is not output else printout
