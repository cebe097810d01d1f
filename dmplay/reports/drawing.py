"""Figures on the terminal and as pictures."""

import io
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from rich._export_format import CONSOLE_SVG_FORMAT
from rich.console import Console
from rich.text import Text

from dmplay.disk import write_file
from dmplay.figures.every import find_figure, load_figures
from dmplay.game.errand import Printout
from dmplay.game.formats import check_extension
from dmplay.styles import to_ansi
from dmplay.terminal import Terminal
from dmplay.views.canvas import measure_text, to_ascii

# Rich's own template, but nothing is loaded from elsewhere.
SVG_TEMPLATE = re.sub(r"@font-face {{.*?}}\n", "", CONSOLE_SVG_FORMAT, flags=re.DOTALL).replace(
    "Fira Code, monospace", "'Fira Code', 'DejaVu Sans Mono', Menlo, Consolas, monospace"
)
VIEW_BOX_PATTERN = re.compile(r'viewBox="[^"]*"')
FILM_STYLE = """
.film > svg {{ visibility: hidden; animation: turn {length}s infinite }}
@keyframes turn {{ 0% {{ visibility: visible }} {share:.4f}%, 100% {{ visibility: hidden }} }}
@media (prefers-reduced-motion: reduce) {{
  .film > svg {{ animation: none }}
  .film > svg:last-child {{ visibility: visible }}
}}
"""


def make_recording_console(width: int) -> Console:
    """A console that draws a text as it is and remembers it."""
    return Console(
        width=width, record=True, file=io.StringIO(), force_terminal=True,
        color_system="standard", legacy_windows=False, highlight=False,
    )  # fmt: skip


def text_to_svg(text: Text, title: str, *, width: int = 0, name: str = "dmplay") -> str:
    """A text as SVG, as wide as it is if no width is given; `name` begins all names in it."""
    drawn = make_recording_console(width or measure_text(text)[0] + 1)
    drawn.print(text, soft_wrap=True)
    return drawn.export_svg(title=title, unique_id=name, code_format=SVG_TEMPLATE)


def texts_to_animated_svg(
    texts: Iterable[Text], count: int, title: str, width: int
) -> Iterator[str]:
    """So many texts as one animated SVG, a second each; the last alone for who wants no motion."""
    style = FILM_STYLE.format(length=count, share=100 / count)
    for second, text in enumerate(texts):
        drawn = text_to_svg(text, title, width=width, name=f"t{second}")
        if not second:
            box = VIEW_BOX_PATTERN.search(drawn)
            assert box
            yield f'<svg class="film" {box[0]} xmlns="http://www.w3.org/2000/svg">\n'
            yield f"<style>{style}</style>\n"
        timed = f'<svg style="animation-delay: {second}s"'
        yield drawn.replace("<svg", timed, 1) + "\n"
    yield "</svg>\n"


def render_for_terminal(text: Text, terminal: Terminal) -> str:
    """A text, in colour and in Unicode where the terminal can."""
    able = to_ascii(text) if terminal.ascii else text
    return to_ansi(able, terminal.theme) if terminal.color else able.plain


def write_or_print(path: Path | None, content: Iterable[str], *, force: bool) -> Printout:
    """Writes to a file, part by part, and leaves nothing to be told; without one, what is to be."""
    if path is None or str(path) == "-":
        return Printout("", text_chunks=content)
    write_file(path, content, force=force)
    return Printout("")


def format_figure_list() -> str:
    """The name and title of every figure."""
    return "\n".join(f"{key:<5} {title}" for key, (title, _) in load_figures().items())


def draw_figure(name: str, output: Path | None, *, svg: bool, force: bool = False) -> Printout:
    """A figure; as a picture where that or a file is asked for."""
    title, draw = find_figure(name)
    check_extension(output, "svg")
    if svg or output:
        return write_or_print(output, [text_to_svg(draw(), title)], force=force)
    return Printout(draw(), paged=True)
