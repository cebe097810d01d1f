"""Values and actions of states: on hex maps, as heat maps over two numbers, or as a table."""

import numpy as np
from rich.text import Text

from dmplay.algorithms.finite_mdp import format_state_name
from dmplay.algorithms.step import StateValues
from dmplay.core.hexgrid import Hex, HexMap, find_hex_map
from dmplay.core.problem import Problem
from dmplay.core.text import format_score
from dmplay.draw.canvas import Canvas, format_to_width, measure_text
from dmplay.draw.heat_maps import LABEL_COLUMNS, MIN_MAP_COLUMNS, draw_heat_maps, find_map_axes
from dmplay.draw.hex_map import ARROWS, COMPASS, HexCell, HexSize, iter_maps
from dmplay.draw.options import DrawOptions

HEX_CAPTION = "* changed  > < formula"

TABLE_CAPTION = "> state of the formula, * changed"
MAX_COMPACT_ROWS = 9  # rows up to which a hex shows only its value


def draw_state_values(state_values: StateValues, problem: Problem, options: DrawOptions) -> Text:
    """Return the values and the actions of states, drawn as suits the problem."""
    hex_map = find_hex_map(problem)
    map_text = hex_map and _draw_hex_map(state_values, hex_map, options)
    if map_text is not None:
        return map_text
    axes = find_map_axes(state_values.states, problem)
    if axes and options.width >= LABEL_COLUMNS + MIN_MAP_COLUMNS:
        return draw_heat_maps(state_values, problem, axes, options)
    return _draw_table(state_values, problem, options)


def _draw_hex_map(state_values: StateValues, hex_map: HexMap, options: DrawOptions) -> Text | None:
    """Return the largest map that fits, with the action above the value; None if none fits."""
    names = COMPASS if options.ascii else ARROWS
    hexes, exits = hex_map

    def make_cell(hex_: Hex, size: HexSize) -> HexCell:
        """Return the content of a hex."""
        state = hexes.index(hex_)
        value = float(state_values.values[state])
        action = -1 if state_values.actions is None else int(state_values.actions[state])
        mark = "" if action < 0 else names[action]
        if hex_ in exits:
            mark = "◆" if exits[hex_] > 0 else "✗"
        if state_values.changed is not None and state_values.changed[state]:
            mark += "*"
        style = "green" if value > 0 else "yellow" if value else ""
        if state == state_values.focus:
            mark, style = f">{mark}<", f"{style} bold reverse".strip()
        text = format_to_width(value, size.width - 1)
        if size.text_rows > 1:
            return HexCell(mark, text, style=style)
        return HexCell(text, dot_glyph=mark[:1] or ".", style=style)

    marks = "◆" * any(r > 0 for r in exits.values()), "✗" * any(r <= 0 for r in exits.values())
    exit_note = f"  {' '.join(filter(None, marks))} exit: any action ends the game"
    has_note = bool(exits) and options.width > len(HEX_CAPTION + exit_note)
    caption = f"{HEX_CAPTION}{exit_note * has_note}" if options.height > MAX_COMPACT_ROWS else ""
    for board in iter_maps(hexes, make_cell, options._replace(allow_large=True), caption):
        columns, rows = measure_text(board)
        if columns <= options.width and rows <= options.height:
            return board
    return None


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
