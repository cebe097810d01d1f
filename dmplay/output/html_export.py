"""Export of a recorded game as an HTML page: board, log, timeline and plots, no network."""

import json
import re
from collections.abc import Iterable, Iterator, Sequence
from importlib.resources import files
from itertools import chain
from string import Template
from tempfile import SpooledTemporaryFile
from typing import IO, NamedTuple

from dmplay.core.problem_summary import score_label
from dmplay.core.session import belief_size
from dmplay.core.text import escape_unprintable, format_count, format_score
from dmplay.draw.options import DrawOptions
from dmplay.errors import BadParameter
from dmplay.game.playback import Playback
from dmplay.output.html_markup import (
    DARK_THEME_CSS,
    LIGHT_THEME_CSS,
    STYLE_CLASS_CSS,
    build_palette_css,
    escape_html,
    render_html_rows,
)

# left edge, width, height and margin of a plot, in SVG units
PLOT_LEFT, PLOT_WIDTH, PLOT_HEIGHT, PLOT_MARGIN = 4, 640, 120, 10
PLOT_VIEW_HEIGHT = PLOT_HEIGHT + 2 * PLOT_MARGIN
LINE_COLORS = ("blue", "yellow", "green", "magenta", "red", "cyan")
# characters of a long file to hold in memory, and to read at once
MAX_MEMORY_CHARACTERS, READ_CHARACTERS = 2**20, 2**13
MAX_PLOTTED_STATES = 6  # maximum states whose beliefs are plotted


class BoardAndPanel(NamedTuple):
    """A board as rows of HTML, and the rows of its panel; both recur during a game."""

    board: list[str]
    panel: list[tuple[str, str]]


class PlotLine(NamedTuple):
    """A line of a plot: its name, and one value per step."""

    name: str
    values: list[float]


class PageSteps:
    """The steps of a page: the initial position and every turn, undo or reroll.

    All steps are written to files. The step at which the page opens is also held in memory.
    """

    def __init__(self, requested_turn: int | None, log: IO[str], data: IO[str]) -> None:
        self.requested_turn, self.log_file, self.data_file = requested_turn, log, data
        self.count = self.last_turn = 0
        self.row_numbers: dict[str, int] = {}  # row of a board -> its number
        self.open_step, self.open_content, self.open_text = -1, BoardAndPanel([], []), ""

    def add_step(self, turn: int, content: BoardAndPanel, text: str) -> None:
        """Write a step to the log as a list item, and to the data as JSON that is safe in HTML."""
        self.log_file.write("\n" * (self.count > 0) + f"<li>{escape_html(text)}</li>")
        step_json = (
            f'{{"turn": {turn}, {self._to_content_json(content)}, "said": {_to_script_json(text)}}}'
        )
        self.data_file.write(", " * (self.count > 0) + step_json)
        if turn == (self.requested_turn or 0):  # the last of several with this turn
            self.open_step, self.open_content, self.open_text = self.count, content, text
        self.count, self.last_turn = self.count + 1, max(self.last_turn, turn)

    def _to_content_json(self, content: BoardAndPanel) -> str:
        """Return the board and the panel as JSON members; numbers replace the board's rows."""
        row_numbers = [
            self.row_numbers.setdefault(row, len(self.row_numbers)) for row in content.board
        ]
        return f'"board": {_to_script_json(row_numbers)}, "panel": {_to_script_json(content.panel)}'


def render_page(game: Playback, turn: int | None, options: DrawOptions) -> Iterator[str]:
    """Yield the page, open at a turn or the start; raise BadParameter if there is no such turn."""
    with open_spooled_file() as log, open_spooled_file() as data:
        yield from _render_page_parts(game, PageSteps(turn, log, data), options)


def open_spooled_file() -> IO[str]:
    """Return a temporary file that is held in memory until it is long."""
    return SpooledTemporaryFile(MAX_MEMORY_CHARACTERS, "w+", encoding="utf-8", newline="")


def _render_page_parts(game: Playback, steps: PageSteps, options: DrawOptions) -> Iterator[str]:
    """Add all steps, and yield the page in parts; raise BadParameter if `--at` is too late."""
    returns, beliefs = _add_all_steps(game, steps, options)
    if steps.open_step < 0:
        raise BadParameter(
            f"--at: got {steps.requested_turn}, the game "
            f"has {format_count(steps.last_turn, 'turn')}"
        )
    plots = [
        _render_plot(f"{score_label(game.problem)} so far", returns),
        _render_plot("belief", beliefs),
    ]
    goal = "; ".join(game.view_module.goal_lines(game.view(0)))
    result = f"over: {game.narrator.describe_result()}"
    yield from render_steps_page(
        steps, f"dmplay {game.problem_name}", goal, result, filter(None, plots)
    )


def render_steps_page(
    steps: PageSteps, title: str, goal: str, result: str, plots: Iterable[str] = ()
) -> Iterator[str]:
    """Yield the page of these steps, part by part."""
    panel = (
        f"<dt>{escape_html(label)}</dt><dd>{escape_html(content)}</dd>"
        for label, content in steps.open_content.panel
    )
    fields = {
        "title": escape_html(title),
        "goal": escape_html(goal),
        "light": LIGHT_THEME_CSS,
        "dark": DARK_THEME_CSS,
        "words": STYLE_CLASS_CSS,
        "palette": build_palette_css(steps.row_numbers),
        "board": "\n".join(steps.open_content.board),
        "said": escape_html(steps.open_text),
        "panel": "".join(panel),
        "plots": "\n".join(plots),
        "result": escape_html(result),
        "last": steps.count - 1,
        "at": steps.open_step,
    }
    # long parts, yielded in pieces
    content = {"log": _iter_file_parts(steps.log_file), "data": _iter_script_data(steps)}
    template = files("dmplay.output").joinpath("page.html").read_text(encoding="utf-8")
    for part in re.split(r"\$(log|data)\b", template):
        yield from content.get(part) or [Template(part).substitute(fields)]


def _iter_file_parts(file: IO[str]) -> Iterator[str]:
    """Yield the text of a whole file, part by part."""
    file.seek(0)
    while part := file.read(READ_CHARACTERS):
        yield part


def _iter_script_data(steps: PageSteps) -> Iterator[str]:
    """Yield the data of the page's script, as JSON that is safe in HTML."""
    yield f'{{"rows": {_to_script_json([*steps.row_numbers])}, "steps": ['
    yield from _iter_file_parts(steps.data_file)
    yield f'], "left": {PLOT_LEFT}, "width": {PLOT_WIDTH}}}'


def _to_script_json(value: object) -> str:
    """Return a value as JSON that is safe in an HTML script element."""
    return json.dumps(value, ensure_ascii=False).replace("<", "\\u003c")


def _add_all_steps(
    game: Playback, steps: PageSteps, options: DrawOptions
) -> tuple[list[PlotLine], list[PlotLine]]:
    """Add all steps; return plot lines of each seat's return and of the first seat's belief."""
    returns, beliefs = ([PlotLine(agent, []) for agent in game.problem.agents], _belief_lines(game))
    changes = (
        game.narrator.describe_change(game.snapshot(), turns_before)
        for turns_before in game.iter_agent_turns()
    )
    for text in chain([game.narrator.describe_situation(game.snapshot())], changes):
        snapshot = game.snapshot()
        steps.add_step(
            snapshot.turn, _render_board_and_panel(game, options), escape_unprintable(text)
        )
        for seat, line in enumerate(returns):
            line.values.append(game.session.seat_return(seat))
        for line, value in zip(
            beliefs, snapshot.view.belief.tolist() if beliefs else (), strict=False
        ):
            line.values.append(value)
    return returns, beliefs


def _render_board_and_panel(game: Playback, options: DrawOptions) -> BoardAndPanel:
    """Return the board and the panel of the current step."""
    facts = game.view_module.panel_rows(game.view())
    panel = [(escape_unprintable(label), escape_unprintable(value)) for label, value in facts]
    return BoardAndPanel(render_html_rows(game.draw_board(options)), panel)


def _belief_lines(game: Playback) -> list[PlotLine]:
    """Return an empty plot line for each state of the first seat's belief.

    The list is empty if there is no visible belief, or one over more than MAX_PLOTTED_STATES
    states.
    """
    problem = game.problem
    is_plotted = game.session.has_visible_beliefs and belief_size(problem) <= MAX_PLOTTED_STATES
    if is_plotted:
        return [PlotLine(problem.format_state(state), []) for state in problem.enumerate_states()]
    return []


def _render_plot(title: str, lines: Sequence[PlotLine]) -> str:
    """Return an SVG plot of lines over the steps with a movable mark, or '' without data."""
    if not lines or len(lines[0].values) < 2:
        return ""
    values = [value for line in lines for value in line.values]
    low, high = min(*values, 0.0), max(*values, 0.0)
    steps = len(lines[0].values) - 1

    def y(value: float) -> float:
        """Return the vertical coordinate of a value."""
        return PLOT_MARGIN + PLOT_HEIGHT * (high - value) / ((high - low) or 1.0)

    polylines = [
        f'<polyline class="series" stroke="var(--{color})" points="'
        + " ".join(
            f"{PLOT_LEFT + PLOT_WIDTH * n / steps:.1f},{y(value):.1f}"
            for n, value in enumerate(line.values)
        )
        + '"/>'
        for line, color in zip(lines, _line_colors(len(lines)), strict=True)
    ]
    axis = (
        f'<line class="axis" x1="{PLOT_LEFT}" '
        f'x2="{PLOT_LEFT + PLOT_WIDTH}" y1="{y(0):.1f}" y2="{y(0):.1f}"/>'
    )
    # The plot is stretched to the width of the page, so its labels are not part of it.
    end_labels = "".join(
        f'<span class="label" style="top: {100 * y(value) / PLOT_VIEW_HEIGHT:.1f}%">'
        f"{format_score(value)}</span>"
        for value in sorted({low, high})
    )
    cursor = (
        f'<line class="now" x1="{PLOT_LEFT}" x2="{PLOT_LEFT}" '
        f'y1="{PLOT_MARGIN}" y2="{PLOT_MARGIN + PLOT_HEIGHT}"/>'
    )
    legend = ", ".join(
        f'<span class="{color}">{escape_html(line.name)} {format_score(line.values[-1])}</span>'
        for line, color in zip(lines, _line_colors(len(lines)), strict=True)
    )
    view_box = (
        f'viewBox="0 0 {PLOT_LEFT + PLOT_WIDTH + PLOT_MARGIN} '
        f'{PLOT_VIEW_HEIGHT}" preserveAspectRatio="none"'
    )
    return (
        f'<figure><figcaption>{title}: {legend}</figcaption><div class="plot">{end_labels}'
        f'<svg {view_box} role="img" aria-label="{title}">{axis}{"".join(polylines)}{cursor}</svg>'
        "</div></figure>"
    )


def _line_colors(count: int) -> list[str]:
    """Return `count` colours, repeated in order if there are not enough."""
    return [LINE_COLORS[number % len(LINE_COLORS)] for number in range(count)]
