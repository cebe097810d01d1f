"""Heat maps of values and actions over states of two numbers, such as a position and a speed."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from rich.text import Text

from dmplay.algorithms.step import StateValues
from dmplay.core.arrays import Array, Ints
from dmplay.core.problem import Problem
from dmplay.core.text import format_score
from dmplay.draw.canvas import BAR_LEVELS, Canvas
from dmplay.draw.options import DrawOptions

LABEL_COLUMNS = 8  # columns of the numbers at the left of a map
CAPTION_ROWS = 3  # rows of the title, and of the numbers and names below a map
MIN_MAP_COLUMNS, MIN_MAP_ROWS = 16, 5
HEAT_COLORS = (17, 18, 24, 30, 36, 72, 108, 144, 187)  # palette colours from low to high values
ACTION_GLYPHS = {
    "left": "←", "right": "→", "up": "↑", "down": "↓", "climb": "↑", "descend": "↓",
    "coast": "·", "no-advisory": "·",
}  # fmt: skip
ACTION_STYLES = ("yellow", "dim", "blue", "green", "magenta", "cyan")


class MapAxis(NamedTuple):
    """An axis of a map: the position of its number in a state, and its name."""

    position: int
    name: str


class MapAxes(NamedTuple):
    """The axes of a map: to the right, and up."""

    x: MapAxis
    y: MapAxis


class HeatMap(NamedTuple):
    """A map over states: its title, its axes, and the glyph and style of each state."""

    title: str
    states: Array  # [S, d]
    axes: MapAxes
    choose_glyph: Callable[[int], tuple[str, str]]
    focus: int | None  # the marked state


def find_map_axes(states: Array, problem: Problem) -> MapAxes | None:
    """Return the axes of states on a grid of two numbers; None for other states."""
    if states.ndim != 2 or states.dtype.kind != "f":
        return None
    grid = problem.state_grid
    if grid:
        return MapAxes(*(MapAxis(i, grid.axes[i].name) for i in (grid.x, grid.y)))
    varying = [axis for axis in range(states.shape[1]) if len(np.unique(states[:, axis])) > 1]
    if len(varying) != 2:
        return None
    return MapAxes(*(MapAxis(position, f"number {position + 1}") for position in varying))


def draw_heat_maps(
    state_values: StateValues, problem: Problem, axes: MapAxes, options: DrawOptions
) -> Text:
    """Return a map of the values and, if there is space beside or below, one of the actions."""
    maps = [_make_value_map(state_values, axes)]
    if state_values.actions is not None:
        maps.append(_make_action_map(state_values, problem, axes))
    is_beside = options.width >= len(maps) * (LABEL_COLUMNS + MIN_MAP_COLUMNS + 2)
    if not is_beside and options.height // len(maps) < MIN_MAP_ROWS + CAPTION_ROWS:
        maps = maps[:1]
    width = options.width // len(maps) - 2 if is_beside else options.width
    height = options.height if is_beside else options.height // len(maps)
    canvas = Canvas()
    for number, heat_map in enumerate(maps):
        x, y = (number * (width + 2), 0) if is_beside else (0, number * height)
        _draw_map(canvas, x, y, heat_map, options._replace(width=width, height=height))
    return canvas.to_text()


def _make_value_map(state_values: StateValues, axes: MapAxes) -> HeatMap:
    """Return a map whose glyphs and colours show values in equal levels from least to greatest."""
    low, high = float(state_values.values.min()), float(state_values.values.max())

    def choose_glyph(state: int) -> tuple[str, str]:
        """Return the glyph of a level, in its colour on that of the level below."""
        share = (state_values.values[state] - low) / ((high - low) or 1.0)
        level = min(int(share * len(BAR_LEVELS)), len(BAR_LEVELS) - 1)
        return BAR_LEVELS[level], f"color({HEAT_COLORS[level + 1]}) on color({HEAT_COLORS[level]})"

    title = f"V: {BAR_LEVELS[0]} {format_score(low)}  {BAR_LEVELS[-1]} {format_score(high)}"
    return HeatMap(title, state_values.states, axes, choose_glyph, state_values.focus)


def _make_action_map(state_values: StateValues, problem: Problem, axes: MapAxes) -> HeatMap:
    """Return a map of the greedy actions."""
    labels = problem.actions[0].labels
    glyphs = _choose_action_glyphs(labels)

    def choose_glyph(state: int) -> tuple[str, str]:
        """Return the glyph of the action in a state; a blank if there is none."""
        assert state_values.actions is not None
        action = int(state_values.actions[state])
        return (" ", "") if action < 0 else (glyphs[action], ACTION_STYLES[action % 6])

    legend = "  ".join(f"{glyph} {label}" for glyph, label in zip(glyphs, labels, strict=True))
    return HeatMap(f"best: {legend}", state_values.states, axes, choose_glyph, state_values.focus)


def _choose_action_glyphs(labels: Sequence[str]) -> list[str]:
    """Return a glyph for each action: an arrow or first letter, but numbers if two are equal."""
    glyphs = [ACTION_GLYPHS.get(label, label[:1]) for label in labels]
    is_unique = len({*glyphs}) == len(glyphs)
    return glyphs if is_unique else [str(number % 10) for number in range(1, len(glyphs) + 1)]


def _draw_map(canvas: Canvas, x: int, y: int, heat_map: HeatMap, options: DrawOptions) -> None:
    """Draw the title, one glyph for each cell, and the numbers and names of both axes."""
    _, states, axes, choose_glyph, focus = heat_map
    canvas.write_text(x, y, heat_map.title[: options.width], "bold")
    x_numbers, y_numbers = states[:, axes.x.position], states[:, axes.y.position]
    x_points, y_points = np.unique(x_numbers), np.unique(y_numbers)
    columns = min(options.width - LABEL_COLUMNS, len(x_points))
    rows = max(min(options.height - CAPTION_ROWS, len(y_points)), 1)
    left, first_row, end_row = x + LABEL_COLUMNS, y + 1, y + 1 + rows
    column_points = _space_evenly(len(x_points), columns)
    row_points = _space_evenly(len(y_points), rows)[::-1]
    state_at = np.full((len(x_points), len(y_points)), -1)
    cells = np.searchsorted(x_points, x_numbers), np.searchsorted(y_points, y_numbers)
    state_at[cells] = np.arange(len(states))
    for row, j in enumerate(row_points):
        label = f"{y_points[j]:.3g}" if row in {0, rows // 2, rows - 1} else ""
        # Blanks have a style, too, so that they do not take the background of the map.
        canvas.write_text(x, first_row + row, f"{label:>{LABEL_COLUMNS - 1}} ", "dim")
        canvas.write_text(left + columns, first_row + row, " ", "dim")
        for column, i in enumerate(column_points):
            glyph, style = choose_glyph(int(state_at[i, j]))
            canvas.write_text(left + column, first_row + row, glyph, style)
    if focus is not None:
        column = int(np.abs(x_points[column_points] - x_numbers[focus]).argmin())
        row = int(np.abs(y_points[row_points] - y_numbers[focus]).argmin())
        canvas.write_text(left + column, first_row + row, "@", "bold reverse")
    lowest, highest = f"{x_points[0]:.3g}", f"{x_points[-1]:.3g}"
    canvas.write_text(left, end_row, lowest, "dim")
    canvas.write_text(left + columns - len(highest), end_row, highest, "dim")
    name = f"{axes.x.name}; up: {axes.y.name}"
    if len(name) + len(lowest) + len(highest) + 2 <= columns:
        canvas.write_text(left + (columns - len(name)) // 2, end_row, name, "dim")
    else:
        canvas.write_text(x, end_row + 1, name[: options.width], "dim")


def _space_evenly(count: int, cells: int) -> Ints:
    """Return the indices of `cells` points, evenly spaced among `count`, with both ends."""
    return np.rint(np.linspace(0, count - 1, cells)).astype(np.int64)
