"""Values and actions of states: on hex maps, as heat maps over two numbers, or as a table."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from rich.text import Text

from dmplay.algorithms.finite_mdp import format_state_name
from dmplay.algorithms.step import StateValues
from dmplay.core.arrays import Reals
from dmplay.core.hexgrid import HexMap, find_hex_map
from dmplay.core.problem import Problem
from dmplay.core.text import format_score
from dmplay.draw.axes import Axis
from dmplay.draw.canvas import Canvas, join_beside, split_rows
from dmplay.draw.grid_map import draw_grid
from dmplay.draw.hex_values import draw_hexes
from dmplay.draw.options import DrawOptions
from dmplay.draw.panels import GridPanel, HexPanel, PlottedHex

HEX_CAPTION = "* changed  > < formula"
MIN_MAP_COLUMNS, MIN_MAP_ROWS = 24, 8
TABLE_CAPTION = "> state of the formula, * changed"


def draw_state_values(state_values: StateValues, problem: Problem, options: DrawOptions) -> Text:
    """Return the values and the actions of states, drawn as suits the problem."""
    if hex_map := find_hex_map(problem):
        panel = build_hex_panel(state_values, hex_map)
        drawing = draw_hexes(panel, options.width, options.height, ascii_only=options.ascii)
        if drawing:
            return drawing
    panels = build_grid_panels(state_values, problem)
    if panels and options.width >= MIN_MAP_COLUMNS and options.height >= MIN_MAP_ROWS:
        return _draw_grids(panels, options)
    return _draw_table(state_values, problem, options)


def build_hex_panel(state_values: StateValues, hex_map: HexMap) -> HexPanel:
    """Return the map of the values and actions; exits have a sign in place of the action."""
    hexes, exits = hex_map
    cells = []
    for state, hex_ in enumerate(hexes):
        action = -1 if state_values.actions is None else int(state_values.actions[state])
        has_changed = state_values.changed is not None and bool(state_values.changed[state])
        kind: Literal["", "gain", "loss"] = ""
        if hex_ in exits:
            kind, action = "gain" if exits[hex_] > 0 else "loss", -1
        directions, value = (action,) * (action >= 0), float(state_values.values[state])
        is_marked = state == state_values.focus
        cells.append(PlottedHex(hex_, value, directions, "", kind, has_changed, is_marked))
    signs = {"◆" if reward > 0 else "✗": None for reward in exits.values()}
    exit_note = f"  {' '.join(sorted(signs))} exit: any action ends the game" * bool(exits)
    return HexPanel("", cells, caption=f"{HEX_CAPTION}{exit_note}")


def build_grid_panels(state_values: StateValues, problem: Problem) -> list[GridPanel]:
    """Return maps of the values and of the actions over two numbers; [] for other states.

    A point of a map is that of the nearest state.
    """
    states, grid = state_values.states, problem.state_grid
    if states.ndim != 2 or states.dtype.kind != "f":
        return []
    positions = [i for i in range(states.shape[1]) if len(np.unique(states[:, i])) > 1]
    names = [f"number {position + 1}" for position in positions]
    if grid:
        positions = [grid.x, grid.y]
        names = [grid.axes[i].name for i in positions]
    if len(positions) != 2:
        return []
    numbers = states[:, positions]
    axis_points = [np.unique(column) for column in numbers.T]
    x, y = (
        Axis(name, float(points[0]), float(points[-1]))
        for name, points in zip(names, axis_points, strict=True)
    )
    cells = tuple(
        np.searchsorted(points, column)
        for points, column in zip(axis_points, numbers.T, strict=True)
    )
    nearest = np.ix_(
        *(
            abs(np.linspace(points[0], points[-1], len(points))[:, None] - points).argmin(axis=1)
            for points in axis_points
        )
    )

    def spread(of_states: Reals) -> Reals:
        """Return the numbers `[S]` of the states at the points `[X, Y]` of the map."""
        at_points = np.full([len(points) for points in axis_points], np.nan)
        at_points[cells] = of_states
        return at_points[nearest]

    focus = state_values.focus
    marks = () if focus is None else ((float(numbers[focus, 0]), float(numbers[focus, 1])),)
    panels = [GridPanel("", x, y, spread(state_values.values), "V", (), marks, "formula")]
    if state_values.actions is not None:
        actions = np.where(state_values.actions < 0, np.nan, state_values.actions)
        labels = problem.actions[0].labels
        panels.append(GridPanel("", x, y, spread(actions), "", labels, marks, "formula"))
    return panels


def _draw_grids(panels: Sequence[GridPanel], options: DrawOptions) -> Text:
    """Return maps beside or below each other; only the first, if there is little space."""
    width, height = options.width // len(panels) - 2, options.height // len(panels)
    if width >= MIN_MAP_COLUMNS:
        maps = [split_rows(draw_grid(panel, width, options.height)) for panel in panels]
        return Text("\n").join(join_beside(maps, range(0, len(maps) * (width + 2), width + 2)))
    if height < MIN_MAP_ROWS:
        panels, height = panels[:1], options.height
    return Text("\n").join([draw_grid(panel, options.width, height) for panel in panels])


def _draw_table(state_values: StateValues, problem: Problem, options: DrawOptions) -> Text:
    """Return the states with their values and actions, in as many columns as they need.

    If not all states fit, those around the state of the formula are drawn.
    """
    labels = problem.actions[0].labels
    names = [format_state_name(problem, state) for state in state_values.states]
    values = [format_score(value) for value in state_values.values.tolist()]
    actions = [""] * len(names)
    if state_values.actions is not None:
        actions = ["" if action < 0 else labels[action] for action in state_values.actions.tolist()]
    changed = np.zeros(len(names), bool) if state_values.changed is None else state_values.changed
    name_columns, value_columns, action_columns = (
        max(map(len, words)) for words in (names, values, actions)
    )
    pitch = name_columns + value_columns + action_columns + 7
    rows = max(options.height - 2, 1)
    column_count = max(min((options.width + 2) // pitch, -(-len(names) // rows)), 1)
    first = (state_values.focus or 0) - rows * column_count // 2
    first = max(min(first, len(names) - rows * column_count), 0)
    states = range(first, min(first + rows * column_count, len(names)))
    rows = min(rows, len(states))
    canvas = Canvas()
    for number, state in enumerate(states):
        x, y = number // rows * pitch, number % rows + 1
        if y == 1:
            heading = f"  {'state':<{name_columns}} {'V':>{value_columns}} "
            canvas.write_text(x, 0, f"{heading}{'action' if any(actions) else ''}", "dim")
        mark = ">" if state == state_values.focus else "*" if changed[state] else " "
        text = f"{mark} {names[state]:<{name_columns}} {values[state]:>{value_columns}} "
        style = "bold" if state == state_values.focus else ""
        canvas.write_text(x, y, f"{text}{actions[state]}", style)
    count = "" if len(states) == len(names) else f"{len(states)} of {len(names)} states; "
    canvas.write_text(0, rows + 1, f"{count}{TABLE_CAPTION}"[: options.width], "dim")
    return canvas.to_text()
