"""Values and actions of states: on hex maps, as heat maps over two numbers, or as a table."""

from typing import Literal

import numpy as np
from rich.text import Text

from dmplay.algorithms.finite_mdp import format_state_name
from dmplay.algorithms.step import StateValues
from dmplay.core.hexgrid import HexMap, find_hex_map
from dmplay.core.problem import Problem
from dmplay.core.text import format_score
from dmplay.draw.canvas import Canvas
from dmplay.draw.heat_maps import LABEL_COLUMNS, MIN_MAP_COLUMNS, draw_heat_maps, find_map_axes
from dmplay.draw.hex_values import draw_hexes
from dmplay.draw.options import DrawOptions
from dmplay.draw.panels import HexPanel, PlottedHex

HEX_CAPTION = "* changed  > < formula"

TABLE_CAPTION = "> state of the formula, * changed"


def draw_state_values(state_values: StateValues, problem: Problem, options: DrawOptions) -> Text:
    """Return the values and the actions of states, drawn as suits the problem."""
    if hex_map := find_hex_map(problem):
        panel = build_hex_panel(state_values, hex_map)
        drawing = draw_hexes(panel, options.width, options.height, ascii_only=options.ascii)
        if drawing:
            return drawing
    axes = find_map_axes(state_values.states, problem)
    if axes and options.width >= LABEL_COLUMNS + MIN_MAP_COLUMNS:
        return draw_heat_maps(state_values, problem, axes, options)
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
