"""Values and actions of states: on hex maps, as heat maps over two numbers, or as a table."""

from collections.abc import Callable

import numpy as np
from rich.text import Text

from dmplay.algorithms.finite_mdp import format_state_name
from dmplay.algorithms.step import StateValues
from dmplay.core.arrays import Array, Ints
from dmplay.core.problem import Problem
from dmplay.core.text import format_score
from dmplay.problems.collision_avoidance import CollisionAvoidance
from dmplay.problems.hexworld import HexWorld
from dmplay.problems.mountain_car import MountainCar
from dmplay.problems.shared.hexgrid import Hex
from dmplay.views.protocol import DrawOptions
from dmplay.views.toolkit.canvas import BAR_LEVELS, Canvas, format_to_width, measure_text
from dmplay.views.toolkit.hexgrid import ARROWS, COMPASS, HexCell, HexSize, iter_maps

HEX_CAPTION = "* changed, > < state of the formula"
MAX_COMPACT_ROWS = 9  # rows up to which a hex shows only its value
LABEL_COLUMNS = 8  # columns of the numbers at the left of a heat map
MIN_MAP_COLUMNS, MIN_MAP_ROWS = 16, 5  # of a heat map
HEAT_COLORS = (17, 18, 24, 30, 36, 72, 108, 144, 187)  # from low to high values
ACTION_GLYPHS = {
    "left": "←", "right": "→", "up": "↑", "down": "↓", "climb": "↑", "descend": "↓",
    "coast": "·", "no-advisory": "·",
}  # fmt: skip
ACTION_STYLES = ("yellow", "dim", "blue", "green", "magenta", "cyan")
AXES: dict[type[Problem], tuple[tuple[int, str], tuple[int, str]]] = {
    MountainCar: ((0, "position"), (1, "speed")),
    CollisionAvoidance: ((3, "seconds to collision"), (0, "height, m")),
}


def draw_state_values(picture: StateValues, problem: Problem, options: DrawOptions) -> Text:
    """Return the values and the actions of states, drawn as suits the problem."""
    if isinstance(problem, HexWorld):
        map_text = _draw_hex_map(picture, problem, options)
        if map_text is not None:
            return map_text
    axes = _find_axes(picture.states, problem)
    if axes and options.width >= LABEL_COLUMNS + MIN_MAP_COLUMNS:
        return _draw_heat_maps(picture, problem, axes, options)
    return _draw_table(picture, problem, options)


def _draw_hex_map(picture: StateValues, problem: HexWorld, options: DrawOptions) -> Text | None:
    """Return the largest map that fits, with the action above the value; None if none fits."""
    names = COMPASS if options.ascii else ARROWS
    exits = dict(problem.rewards)

    def make_cell(hex_: Hex, size: HexSize) -> HexCell:
        """Return the content of a hex."""
        state = problem.hexes.index(hex_)
        value = format_to_width(float(picture.values[state]), size.width - 1)
        action = -1 if picture.actions is None else int(picture.actions[state])
        mark = "" if action < 0 else names[action]
        if hex_ in exits:
            mark = "◆" if exits[hex_] > 0 else "✗"
        changed = picture.changed is not None and picture.changed[state]
        mark += "*" * bool(changed and mark)
        style = "green" if picture.values[state] > 0 else "yellow" if picture.values[state] else ""
        if state == picture.focus:
            mark, style = f">{mark}<", f"{style} bold reverse".strip()
        if size.text_rows > 1:
            return HexCell(mark, value, style=style)
        return HexCell(value, dot_glyph=mark[:1] or ".", style=style)

    caption = HEX_CAPTION if options.height > MAX_COMPACT_ROWS else ""
    options = options._replace(allow_large=True)
    for board in iter_maps(problem.hexes, make_cell, options, caption):
        columns, rows = measure_text(board)
        if columns <= options.width and rows <= options.height:
            return board
    return None


def _find_axes(states: Array, problem: Problem) -> tuple[tuple[int, str], tuple[int, str]] | None:
    """Return the columns and the names of the two numbers of a grid; None if it is no such grid."""
    if states.ndim != 2 or states.dtype.kind != "f":
        return None
    if type(problem) in AXES:
        return AXES[type(problem)]
    varying = [axis for axis in range(states.shape[1]) if len(np.unique(states[:, axis])) > 1]
    if len(varying) != 2:
        return None
    first, second = varying
    return (first, f"number {first + 1}"), (second, f"number {second + 1}")


def _draw_heat_maps(
    picture: StateValues,
    problem: Problem,
    axes: tuple[tuple[int, str], tuple[int, str]],
    options: DrawOptions,
) -> Text:
    """Return a map of the values and, if there is space beside or below, one of the actions."""
    labels = problem.actions[0].labels
    low, high = float(picture.values.min()), float(picture.values.max())

    def draw_value(state: int) -> tuple[str, str]:
        """Return the level of a value as a glyph."""
        share = (picture.values[state] - low) / ((high - low) or 1.0)
        level = min(int(share * len(BAR_LEVELS)), len(BAR_LEVELS) - 1)
        return BAR_LEVELS[level], f"color({HEAT_COLORS[level + 1]}) on color({HEAT_COLORS[level]})"

    def draw_action(state: int) -> tuple[str, str]:
        """Return the glyph of an action."""
        action = -1 if picture.actions is None else int(picture.actions[state])
        if action < 0:
            return " ", ""
        return _action_glyph(labels[action]), ACTION_STYLES[action % len(ACTION_STYLES)]

    legend = "  ".join(f"{_action_glyph(label)} {label}" for label in labels)
    maps = [
        (
            f"V: {BAR_LEVELS[0]} {format_score(low)}  {BAR_LEVELS[-1]} {format_score(high)}",
            draw_value,
        )
    ]
    if picture.actions is not None:
        maps.append((f"best: {legend}", draw_action))
    canvas, states = Canvas(), picture.states
    is_beside = options.width >= len(maps) * (LABEL_COLUMNS + MIN_MAP_COLUMNS + 2)
    map_rows = options.height if is_beside else options.height // len(maps)
    if not is_beside and map_rows < MIN_MAP_ROWS + 3:
        maps, map_rows = maps[:1], options.height
    columns = options.width // len(maps) - 2 if is_beside else options.width
    for number, (title, draw_glyph) in enumerate(maps):
        x = number * (columns + 2) if is_beside else 0
        y = 0 if is_beside else number * map_rows
        canvas.write_text(x, y, title[:columns], "bold")
        _draw_heat_map(
            canvas,
            x,
            y + 1,
            (columns - LABEL_COLUMNS, map_rows - 3),
            states,
            axes,
            draw_glyph,
            picture.focus,
        )
    return canvas.to_text()


def _draw_heat_map(  # noqa: PLR0913, PLR0917 - a canvas, a position and the content
    canvas: Canvas,
    x: int,
    y: int,
    size: tuple[int, int],
    states: Array,
    axes: tuple[tuple[int, str], tuple[int, str]],
    draw_glyph: Callable[[int], tuple[str, str]],
    focus: int | None,
) -> None:
    """Draw one glyph for each cell of a map, with the numbers of both axes."""
    (x_axis, x_name), (y_axis, y_name) = axes
    x_points, y_points = np.unique(states[:, x_axis]), np.unique(states[:, y_axis])
    columns = min(size[0], len(x_points))
    rows = max(min(size[1], len(y_points)), 1)
    x_rows, y_rows = _sample(len(x_points), columns), _sample(len(y_points), rows)[::-1]
    index = np.full((len(x_points), len(y_points)), -1)
    index[
        np.searchsorted(x_points, states[:, x_axis]), np.searchsorted(y_points, states[:, y_axis])
    ] = range(len(states))
    for row, j in enumerate(y_rows):
        label = f"{y_points[j]:.3g}" if row in {0, rows // 2, rows - 1} else ""
        # Blanks have a style, too, so that they do not take the background of the map.
        canvas.write_text(x, y + row, f"{label:>{LABEL_COLUMNS - 1}} ", "dim")
        canvas.write_text(x + LABEL_COLUMNS + columns, y + row, " ", "dim")
        for column, i in enumerate(x_rows):
            canvas.write_text(x + LABEL_COLUMNS + column, y + row, *draw_glyph(int(index[i, j])))
    if focus is not None:
        column = int(np.abs(x_points[x_rows] - states[focus, x_axis]).argmin())
        row = int(np.abs(y_points[y_rows] - states[focus, y_axis]).argmin())
        canvas.write_text(x + LABEL_COLUMNS + column, y + row, "@", "bold reverse")
    left, right = f"{x_points[0]:.3g}", f"{x_points[-1]:.3g}"
    canvas.write_text(x + LABEL_COLUMNS, y + rows, left, "dim")
    canvas.write_text(x + LABEL_COLUMNS + columns - len(right), y + rows, right, "dim")
    name = f"{x_name}; up: {y_name}"
    if len(name) + len(left) + len(right) + 2 <= columns:
        middle = (columns - len(name)) // 2
        canvas.write_text(x + LABEL_COLUMNS + middle, y + rows, name, "dim")
    else:
        canvas.write_text(x, y + rows + 1, name[: size[0] + LABEL_COLUMNS], "dim")


def _sample(count: int, cells: int) -> Ints:
    """Return the indices of `cells` points, evenly spaced among `count`, with both ends."""
    return np.rint(np.linspace(0, count - 1, cells)).astype(np.int64)


def _action_glyph(label: str) -> str:
    """Return the glyph of an action: an arrow, or the first letter of its label."""
    return ACTION_GLYPHS.get(label, label[:1])


def _draw_table(picture: StateValues, problem: Problem, options: DrawOptions) -> Text:
    """Return the states with their values and actions, in as many columns as fit.

    If not all states fit, those around the state of the formula are shown.
    """
    names = [format_state_name(problem, state) for state in picture.states]
    labels = problem.actions[0].labels
    actions = (
        ["" if a < 0 else labels[a] for a in picture.actions.tolist()]
        if picture.actions is not None
        else [""] * len(names)
    )
    changed = picture.changed if picture.changed is not None else np.zeros(len(names), bool)
    values = [format_score(value) for value in picture.values.tolist()]
    widths = [max(map(len, words)) for words in (names, values, actions)]
    cell_columns = sum(widths) + 7
    rows = max(options.height - 2, 1)
    column_count = max(min((options.width + 2) // cell_columns, -(-len(names) // rows)), 1)
    first = 0
    if len(names) > rows * column_count and picture.focus is not None:
        first = min(
            max(picture.focus - rows * column_count // 2, 0), len(names) - rows * column_count
        )
    indices = range(first, min(first + rows * column_count, len(names)))
    rows = min(rows, -(-len(indices) // column_count))
    canvas = Canvas()
    heading = f"  {'state':<{widths[0]}} {'V':>{widths[1]}} "
    for number, state in enumerate(indices):
        x, y = number // rows * cell_columns, number % rows + 1
        if y == 1:
            canvas.write_text(x, 0, f"{heading}{'action' if any(actions) else ''}", "dim")
        mark = ">" if state == picture.focus else "*" if changed[state] else " "
        style = "bold" if state == picture.focus else ""
        canvas.write_text(
            x,
            y,
            f"{mark} {names[state]:<{widths[0]}} {values[state]:>{widths[1]}} {actions[state]}",
            style,
        )
    note = "> state of the formula, * changed"
    if len(indices) < len(names):
        note = f"{len(indices)} of {len(names)} states; {note}"
    canvas.write_text(0, rows + 1, note[: options.width], "dim")
    return canvas.to_text()
