"""Hex maps as text: pointy tops, q to the east, r to the north-east, in several sizes.

 ╱   ╲ ╱   ╲          normal: 6 columns, 3 rows per row of hexes
│  @  │     │
│     │  +5 │         compact: 4 columns, 2 rows        dots: 4 or 2 columns, 1 row
  ╲ ╱   ╲ ╱
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from rich.text import Span, Text

from dmplay.core.best_actions import mark_best_actions
from dmplay.core.hexgrid import DIRECTIONS, Hex, format_hex, hex_neighbours, path_lengths
from dmplay.core.text import format_count
from dmplay.draw import theme
from dmplay.draw.action_hints import (
    format_as_loss,
    format_condition,
    format_regret,
    format_regret_bar,
    sort_regrets,
)
from dmplay.draw.canvas import Canvas, format_percent, format_to_width
from dmplay.draw.canvas import measure_text as measured
from dmplay.draw.options import DrawOptions, Forecast

ARROWS = ("→", "↗", "↖", "←", "↙", "↘")
COMPASS = ("E", "NE", "NW", "W", "SW", "SE")
EDGE_STYLE = "dim"
HOLE_GLYPH = "░"
MIN_HOLE_NEIGHBOURS = 3  # a position without a hex looks like one from this number on
WORD_COLUMNS = 9  # columns from which on a hex says `0.2 less` in place of `-0.196`
SMALL_HEX_LEGEND = "* best, █ worst"  # legend of the keys in small hexes

KEYS = {
    "l": "e", "u": "ne", "y": "nw", "h": "w", "b": "sw", "n": "se",
    "right": "e", "up right": "ne", "up left": "nw", "left": "w", "down left": "sw",
    "down right": "se", "pageup": "ne", "home": "nw", "end": "sw", "pagedown": "se",
}  # fmt: skip
KEY_FAMILY = "hex"  # the name under which a player sets keys for all hex problems
DIRECTION_KEYS = ("l", "u", "y", "h", "b", "n")  # in action order
# for a second player
SECOND_PLAYER_KEYS = {"w": "nw", "e": "ne", "a": "w", "d": "e", "z": "sw", "x": "se"}


class HexCell(NamedTuple):
    """The content of a hex: a mark, a second line, one glyph for maps of dots, and a style.

    The top line is drawn in hexes of at least three rows.
    """

    mark: str
    second_line: str = ""
    dot_glyph: str = "."
    style: str = ""
    top_line: str = ""


# clauses of a caption on signs that small hexes lack
SIGN_LEGENDS = GOOD_EXIT_LEGEND, BAD_EXIT_LEGEND = ", ◆ good exit", ", ✗ bad exit"


class HexSize(NamedTuple):
    """A hex size: columns of a hex, rows of text in it (0 for dots), and rows of each slope."""

    width: int
    text_rows: int
    slope_rows: int = 1


LARGE_SIZES = HexSize(18, 4, 4), HexSize(14, 4, 3), HexSize(10, 3, 2), HexSize(8, 3, 2)
TALL_SIZE = HexSize(6, 3)  # for maps that write into every hex, with a row for its coordinates
NORMAL_SIZE = HexSize(6, 2)
COMPACT_SIZE = HexSize(4, 1)
DOT_SIZE = HexSize(4, 0)
SMALL_DOT_SIZE = HexSize(2, 0)
SMALL_SIZES = (NORMAL_SIZE, COMPACT_SIZE, DOT_SIZE, SMALL_DOT_SIZE)


def iter_maps(
    hexes: Sequence[Hex],
    make_cell: Callable[[Hex, HexSize], HexCell],
    options: DrawOptions,
    caption: str = "",
    extra_sizes: Sequence[HexSize] = (),
) -> Iterator[Text]:
    """Yield the map in every size, the largest first; `extra_sizes` are between large and small.

    In the sizes with less than two rows of text in a hex, the caption has no SIGN_LEGENDS.

    The large sizes are drawn only if `options.allow_large` is set and they fit. In each size, the
    map comes with each caption that is no wider than it, the fullest first, then without a caption.
    A smaller size that does not fit is yielded as blank text of the same extent.
    """
    column_span, row_span = _find_extent(tuple(hexes))
    large_sizes = (*LARGE_SIZES, *extra_sizes) if options.allow_large else ()
    for size in (*large_sizes, *SMALL_SIZES):
        width, height = _measure_map(size, column_span, row_span)
        if width > options.width or height > options.height:
            if size not in large_sizes:
                yield Text("\n" * (height - 1) + " " * width, no_wrap=True)
            continue
        cells = tuple([make_cell(hex_, size) for hex_ in hexes])
        has_room = size.text_rows > 1
        if has_room if options.show_coordinates is None else options.show_coordinates:
            cells = tuple(map(_add_coordinates, hexes, cells, [size] * len(hexes)))
        has_short_regrets = options.regret is not None and size.text_rows < 2
        legend = f"; {SMALL_HEX_LEGEND}" if has_short_regrets else ""
        text = caption
        for sign_legend in SIGN_LEGENDS if not has_room else ():
            text = text.replace(sign_legend, "")
        captions = (f"{text}{legend}", legend[2:], text, text.rpartition("\n")[2]) if text else ()
        for plain_text, spans in _draw_captioned_map(tuple(hexes), cells, size, captions):
            drawing = plain_text.blank_copy().append_text(plain_text)  # a tenth of `copy`'s time
            drawing.spans = [*spans]
            yield drawing


@lru_cache(16)
def _find_extent(hexes: tuple[Hex, ...]) -> tuple[int, int]:
    """Return the distances between the outermost hexes, in half hexes and in rows."""
    half_columns, rows = [2 * q + r for q, r in hexes], [r for _, r in hexes]
    return max(half_columns) - min(half_columns), max(rows) - min(rows)


def _add_coordinates(hex_: Hex, cell: HexCell, size: HexSize) -> HexCell:
    """Return the content of a hex with its coordinates in a free row, if they fit."""
    coordinates = f"{hex_[0]},{hex_[1]}"
    if not size.text_rows or len(coordinates) >= size.width:
        return cell
    if size.text_rows > 2:
        return cell._replace(top_line=coordinates)
    if not cell.mark and not cell.second_line:
        return HexCell(coordinates, "", cell.dot_glyph, cell.style or "dim")
    if size.text_rows > 1 and not cell.second_line:
        return cell._replace(second_line=coordinates)
    return cell._replace(mark=coordinates) if size.text_rows > 1 and not cell.mark else cell


def _measure_map(size: HexSize, column_span: int, row_span: int) -> tuple[int, int]:
    """Return the columns and rows of a map.

    `column_span` and `row_span` are the distances between its outermost hexes, in half hexes and in
    rows. For dots, the columns are a minimum, because text next to the last dot may be blank.
    """
    last_hex_column = column_span * size.width // 2
    if not size.text_rows:
        return last_hex_column + 1, row_span + 1
    row_pitch = size.text_rows + size.slope_rows
    return last_hex_column + size.width + 1, (row_span + 1) * row_pitch + size.slope_rows


@lru_cache(256)
def _draw_captioned_map(
    hexes: tuple[Hex, ...], cells: tuple[HexCell, ...], size: HexSize, captions: tuple[str, ...]
) -> list[tuple[Text, list[Span]]]:
    """Return the map with each caption that is no wider than it, and without one.

    Each is a text without spans, and its spans. A recording draws few different maps many times; a
    map takes 0.8 ms.
    """
    map_text = _draw_cells(hexes, cells, size)
    width = measured(map_text)[0]
    fitting = (caption for caption in captions if 0 < max(map(len, caption.split("\n"))) <= width)
    texts = [map_text.copy().append(f"\n{caption}", "bold") for caption in dict.fromkeys(fitting)]
    return [(text.blank_copy(text.plain), text.spans) for text in (*texts, map_text)]


def _draw_cells(hexes: Sequence[Hex], cells: Sequence[HexCell], size: HexSize) -> Text:
    """Return the map drawn with the given content of each hex."""
    canvas = _draw_borders_and_holes((*hexes,), size).copy()
    positions = _list_positions(hexes, hexes, size)
    for (y, x), cell in sorted(zip(positions, cells, strict=True)):
        if size.text_rows:
            _draw_hex_content(canvas, x + 1, y + size.slope_rows, cell, size)
        else:
            columns = size.width - 1
            text = cell.dot_glyph if len(cell.dot_glyph) <= columns else cell.dot_glyph[:1]
            canvas.write_text(x, y, text.center(columns), cell.style)
    return canvas.to_text()


@lru_cache(16)  # Every frame of a recording has them.
def _draw_borders_and_holes(hexes: tuple[Hex, ...], size: HexSize) -> Canvas:
    """Return the part of a map in one size that does not depend on the content of its hexes."""
    canvas = Canvas()
    if size.text_rows:
        for y, x in _list_positions(hexes, hexes, size):
            _draw_hex_border(canvas, x, y, size)
    fill = (HOLE_GLYPH * max(size.width - 3, 1)).center(size.width - 1)
    for y, x in _list_positions(_list_holes(hexes), hexes, size):
        for row in range(size.text_rows):
            canvas.write_text(x + 1, y + size.slope_rows + row, fill, EDGE_STYLE)
    return canvas


def _list_positions(
    hexes: Sequence[Hex], map_hexes: Sequence[Hex], size: HexSize
) -> list[tuple[int, int]]:
    """Return the first row and column of each hex in a map of all `map_hexes`."""
    left, top = min(2 * q + r for q, r in map_hexes), max(r for _, r in map_hexes)
    row_pitch = size.text_rows + size.slope_rows
    return [((top - r) * row_pitch, (2 * q + r - left) * size.width // 2) for q, r in hexes]


def _list_holes(hexes: Sequence[Hex]) -> list[Hex]:
    """Return the positions without a hex that neighbours draw as if they were hexes.

    Those beyond the outermost hexes of the map are left out.
    """
    columns = [2 * q + r for q, r in hexes]
    counts = Counter(hex_ for neighbours in map(hex_neighbours, hexes) for hex_ in neighbours)
    surrounded = (hex_ for hex_, count in counts.items() if count >= MIN_HOLE_NEIGHBOURS)
    holes = [hex_ for hex_ in surrounded if hex_ not in hexes]
    return [(q, r) for q, r in holes if min(columns) <= 2 * q + r <= max(columns)]


def _draw_hex_border(canvas: Canvas, x: int, y: int, size: HexSize) -> None:
    """Draw the six sides of a hex."""
    width, bottom = size.width, y + size.slope_rows + size.text_rows
    for row in range(size.slope_rows):
        above = 1 + 2 * (size.slope_rows - 1 - row)
        below = width // 2 - above  # matches the upper slopes of the hexes below
        canvas.write_text(x + above, y + row, "╱", EDGE_STYLE)
        canvas.write_text(x + width - above, y + row, "╲", EDGE_STYLE)
        canvas.write_text(x + below, bottom + row, "╲", EDGE_STYLE)
        canvas.write_text(x + width - below, bottom + row, "╱", EDGE_STYLE)
    for line in range(y + size.slope_rows, bottom):
        canvas.write_text(x, line, "│", EDGE_STYLE)
        canvas.write_text(x + width, line, "│", EDGE_STYLE)


def _draw_hex_content(canvas: Canvas, x: int, y: int, cell: HexCell, size: HexSize) -> None:
    """Draw the content of a hex, centred in its rows."""
    columns, first_row = size.width - 1, (size.text_rows - 1) // 2
    if " on " in cell.style:
        for row in range(size.text_rows):
            canvas.write_text(x, y + row, " " * columns, cell.style)
    canvas.write_text(x, y + first_row, cell.mark[:columns].center(columns), cell.style)
    if cell.top_line and first_row:
        style = cell.style if " on " in cell.style else "dim"
        canvas.write_text(x, y, cell.top_line.center(columns), style)
    if size.text_rows > 1:
        second_line = cell.second_line[:columns].center(columns)
        canvas.write_text(x, y + first_row + 1, second_line, cell.style)


def make_overlay_cell(options: DrawOptions, state: int, size: HexSize) -> HexCell:
    """Return the content of a hex in an overlay: the state's value, best actions or index."""
    assert options.overlay
    values, kind = options.overlay.action_values[state], options.overlay.kind
    if kind == "states":
        text = str(state)
    elif kind == "values":
        text = format_to_width(values.max(), size.width - 1)
    else:
        names = COMPASS if options.ascii else ARROWS
        directions = [names[a] for a in np.flatnonzero(mark_best_actions(values))]
        text = directions[0] if size.text_rows == 1 else "/".join(directions)[:5]
    texts = (text, "") if size.text_rows == 1 else ("", text)
    return HexCell(*texts, style=theme.DATA)


def get_direction_key(options: DrawOptions, direction: int) -> str:
    """Return the key that moves in a direction."""
    return options.keys_by_action.get(DIRECTIONS[direction], DIRECTION_KEYS[direction])


def make_direction_cell(options: DrawOptions, direction: int, size: HexSize) -> HexCell:
    """Return the content of a neighbour hex: its key and, with hints, a regret bar and number.

    With a forecast there are no regrets, because the numbers on the map are then probabilities.
    """
    key, columns = get_direction_key(options, direction), size.width - 1
    regret_text = format_regret(options, direction, columns)
    if options.forecast or not regret_text:
        return HexCell(key, style=theme.CHOICE)
    is_best = not sort_regrets(options)[direction]
    style = theme.BEST if is_best else theme.CHOICE
    if size.text_rows > 1:
        if columns >= WORD_COLUMNS:
            regret_text = format_as_loss(format_regret(options, direction, columns - len("less")))
        bar = format_regret_bar(options, direction, columns - 2).ljust(columns - 2)
        return HexCell(key if is_best else f"{key} {bar}", regret_text, style=style)
    mark = f"{key}*" if is_best else key + format_regret_bar(options, direction, 1)
    return HexCell(mark, dot_glyph=mark if is_best else ".", style=style)


def format_wall_regrets(hexes: Sequence[Hex], position: Hex, options: DrawOptions) -> str:
    """Return the caption of the regrets on the map, and a row with those of moves into walls.

    No hex shows the regret of a move into a wall.
    """
    adjacent = hex_neighbours(position)
    walls = [a for a in sort_regrets(options) if adjacent[a] not in hexes]
    parts = [f"{DIRECTIONS[a]} {format_regret(options, a)}" for a in walls]
    caption = "numbers and bars: how much less than the best action"
    return f"{caption}\nmoves into a wall: {', '.join(parts)}" if parts else caption


def describe_wall_keys(hexes: Sequence[Hex], position: Hex) -> dict[str, str]:
    """Return the effect of the keys that move into a wall, by direction."""
    pairs = zip(DIRECTIONS, hex_neighbours(position), strict=True)
    return {direction: "wall" for direction, hex_ in pairs if hex_ not in hexes}


def format_move_condition(forecast: Forecast) -> str:
    """Return the forecast move as a condition, such as `if you go NE`."""
    return format_condition(forecast, f"go {DIRECTIONS[int(forecast.action)].upper()}")


def describe_slips(slip: float) -> str:
    """Return a clause on the part of steps that slip; '' without slips."""
    return f"{format_percent(slip)} of steps slip sideways" if slip else ""


def describe_step_chances(slip: float) -> tuple[str, ...]:
    """Return sentences on slips and walls, without their full stops."""
    slips = (
        f"A step slips to each of the two directions beside it with probability {slip / 2:g}; "
        "NE, for example, slips to E or NW"
    )
    return *([slips] if slip else []), "A step or a slip into a wall leaves the agent where it is"


def describe_map(hexes: Sequence[Hex]) -> list[str]:
    """Return the hexes of a map in sentences, row by row from the north."""
    rows: dict[int, list[int]] = {}
    for q, r in sorted(hexes, key=lambda hex_: (-hex_[1], hex_[0])):
        rows.setdefault(r, []).append(q)
    listed = "; ".join(f"r = {r}: q = {', '.join(map(str, row))}" for r, row in rows.items())
    return [
        "A hex is (q,r). Its neighbours are E (q+1,r), NE (q,r+1), NW (q-1,r+1), W (q-1,r), "
        "SW (q,r-1) and SE (q+1,r-1).",
        f"The hexes of the map are {listed}. All others are walls.",
    ]


def describe_neighbours(
    hexes: Sequence[Hex], position: Hex, describe_hex: Callable[[Hex], str]
) -> list[str]:
    """Return a sentence per neighbour in action order, such as `E (6,2) floor.` or `NE wall.`."""
    return [
        f"{name.upper()} {format_hex(neighbour)} {describe_hex(neighbour)}."
        if neighbour in hexes
        else f"{name.upper()} wall."
        for name, neighbour in zip(DIRECTIONS, hex_neighbours(position), strict=True)
    ]


def append_position(move_text: str, hex_: Hex) -> str:
    """Return the result of a move with the hex after it: `moved NE to (1,2)`, `stayed at (1,2)`."""
    has_moved = move_text.rpartition(", ")[2].startswith("moved")
    return f"{move_text} {'to' if has_moved else 'at'} {format_hex(hex_)}"


def format_distance(hexes: Sequence[Hex], start: Hex, end: Hex) -> str:
    """Return the length of the shortest path between two hexes of a map, such as `4 steps`."""
    steps = int(path_lengths(hexes)[hexes.index(start), hexes.index(end)])
    return "no path" if steps == len(hexes) else format_count(steps, "step")


def describe_move(
    hexes: Sequence[Hex], before: Hex, after: Hex, chosen_direction: int
) -> tuple[str, str]:
    """Return the result of a move between two hexes, in short and as a clause.

    It is such as `slip E` and `slipped, moved E`. It slipped if it was not in the chosen direction.
    A bump is a slip if the chosen neighbour is on the map. If that neighbour is not on the map, the
    hexes do not show whether the bump was a slip.
    """
    neighbours = hex_neighbours(before)
    if after == before:
        has_slipped = neighbours[chosen_direction] in hexes
        short_text, clause = "bump", "bumped, stayed"
    else:
        direction = neighbours.index(after)
        has_slipped, short_text = direction != chosen_direction, DIRECTIONS[direction].upper()
        clause = f"moved {short_text}"
    return (f"slip {short_text}", f"slipped, {clause}") if has_slipped else (short_text, clause)
