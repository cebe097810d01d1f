"""Hex maps as text: pointy tops, q to the east, r to the north-east, in three sizes and dots.

 ╱   ╲ ╱   ╲          normal: 6 columns, 3 rows a hex row
│  @  │     │
│     │  +5 │         compact: 4 columns, 2 rows        dots: 4 or 2 columns, 1 row
  ╲ ╱   ╲ ╱
"""

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from rich.text import Text

from dmplay.describe import format_count
from dmplay.hexes import DIRECTIONS, Hex, format_hex, hex_distance, hex_neighbours
from dmplay.solvers.value_iteration import mark_best_actions
from dmplay.views._advice import format_condition, format_regret, format_regret_bar, sort_regrets
from dmplay.views.canvas import Canvas, format_to_width
from dmplay.views.canvas import measure_text as measured
from dmplay.views.style import REGRET_TOLERANCE, DrawOptions, Forecast

ARROWS = ("→", "↗", "↖", "←", "↙", "↘")
COMPASS = ("E", "NE", "NW", "W", "SW", "SE")
EDGE_STYLE = "dim"
SMALL_HEX_LEGEND = "* best, █ loses most"  # what stands beside the keys of small hexes

KEYS = {
    "l": "e", "u": "ne", "y": "nw", "h": "w", "b": "sw", "n": "se",
    "right": "e", "up right": "ne", "up left": "nw", "left": "w", "down left": "sw",
    "down right": "se", "pageup": "ne", "home": "nw", "end": "sw", "pagedown": "se",
}  # fmt: skip
KEY_FAMILY = "hex"  # under which a player sets keys of these problems
DIRECTION_KEYS = ("l", "u", "y", "h", "b", "n")  # in action order
SECOND_PLAYER_KEYS = {
    "w": "nw",
    "e": "ne",
    "a": "w",
    "d": "e",
    "z": "sw",
    "x": "se",
}  # for a second person


class HexCell(NamedTuple):
    """What stands in a hex: a mark, a second line, and one glyph for the dots."""

    mark: str
    second_line: str = ""
    dot_glyph: str = "."
    style: str = ""


class HexSize(NamedTuple):
    """A size of hex: columns a hex, rows of text in it (0 for dots), rows of each slope."""

    width: int
    text_rows: int
    slope_rows: int = 1


class HexMove(NamedTuple):
    """What came of a move: the direction it went, nothing where it bumped; whether it slipped."""

    direction: str
    has_slipped: bool

    @property
    def description(self) -> str:
        """In words: `moved NE`, `slipped, moved E`, or `bumped, stayed`."""
        return (
            f"{'slipped, ' * self.has_slipped}moved {self.direction}"
            if self.direction
            else "bumped, stayed"
        )


LARGE_SIZES = HexSize(18, 4, 4), HexSize(14, 4, 3), HexSize(10, 3, 2), HexSize(8, 3, 2)
NORMAL_SIZE, COMPACT_SIZE, DOT_SIZE, SMALL_DOT_SIZE = (
    HexSize(6, 2),
    HexSize(4, 1),
    HexSize(4, 0),
    HexSize(2, 0),
)


def iter_maps(
    hexes: Sequence[Hex],
    make_cell: Callable[[Hex, HexSize], HexCell],
    options: DrawOptions,
    caption: str = "",
) -> Iterator[Text]:
    """The map in every size, the largest first; of those that grow with the screen what fits.

    Each has a line below it if that is no wider, and none where the line has no room. One that has
    no room itself is as large, and blank. Nobody writes into them: they come again.
    """
    across = [2 * q + r for q, r in hexes]
    up = [r for _, r in hexes]
    span, rise = max(across) - min(across), max(up) - min(up)
    for size in (
        *(LARGE_SIZES if options.allow_large else ()),
        NORMAL_SIZE,
        COMPACT_SIZE,
        DOT_SIZE,
        SMALL_DOT_SIZE,
    ):
        width, height = _measure_map(size, span, rise)
        if width > options.width or height > options.height:
            if size not in LARGE_SIZES:
                yield Text("\n" * (height - 1) + " " * width, no_wrap=True)
            continue
        cells = tuple([make_cell(hex_, size) for hex_ in hexes])
        marks = f"; {SMALL_HEX_LEGEND}" if options.regret is not None and size.text_rows < 2 else ""
        told = (f"{caption}{marks}", marks[2:], caption) if caption else ()
        yield from _draw_captioned_map(tuple(hexes), cells, size, told)


def _measure_map(size: HexSize, column_span: int, row_span: int) -> tuple[int, int]:
    """Columns and rows of a map whose hexes are half as many and as many apart; of dots at least
    so many columns, as what stands beside the last may be blank.
    """
    first = column_span * size.width // 2
    if not size.text_rows:
        return first + 1, row_span + 1
    pitch = size.text_rows + size.slope_rows
    return first + size.width + 1, (row_span + 1) * pitch + size.slope_rows


def draw_map(
    hexes: Sequence[Hex], make_cell: Callable[[Hex, HexSize], HexCell], size: HexSize
) -> Text:
    """The map in one size."""
    return _draw_cells(hexes, [make_cell(hex_, size) for hex_ in hexes], size)


@lru_cache(256)
def _draw_captioned_map(
    hexes: tuple[Hex, ...], cells: tuple[HexCell, ...], size: HexSize, captions: tuple[str, ...]
) -> tuple[Text, ...]:
    """The map with the first of these lines that is no wider below it, and without; a game shows
    few that differ, again and again.
    """
    drawn = _draw_cells(hexes, cells, size)
    width = measured(drawn)[0]
    below = next((one for one in captions if 0 < len(one) <= width), "")
    return (drawn.copy().append(f"\n{below}", "bold"), drawn) if below else (drawn,)


def _draw_cells(hexes: Sequence[Hex], cells: Sequence[HexCell], size: HexSize) -> Text:
    """The map with these cells."""
    canvas = Canvas()
    left = min(2 * q + r for q, r in hexes)
    top = max(r for _, r in hexes)
    pitch = size.text_rows + size.slope_rows
    each = zip(hexes, cells, strict=True)
    for (q, r), content in sorted(each, key=lambda one: (-one[0][1], one[0][0])):
        x, y = (2 * q + r - left) * size.width // 2, (top - r) * pitch
        if size.text_rows:
            _draw_hex_border(canvas, x, y, size)
            _draw_hex_content(canvas, x + 1, y + size.slope_rows, content, size)
        else:
            wide = size.width - 1
            text = content.dot_glyph if len(content.dot_glyph) <= wide else content.dot_glyph[:1]
            canvas.write_text(x, y, text.center(wide), content.style)
    return canvas.to_text()


def _draw_hex_border(canvas: Canvas, x: int, y: int, size: HexSize) -> None:
    """The six sides of a hex."""
    width, bottom = size.width, y + size.slope_rows + size.text_rows
    for row in range(size.slope_rows):
        above = 1 + 2 * (size.slope_rows - 1 - row)
        below = width // 2 - above  # as the slopes of the hexes there
        canvas.write_text(x + above, y + row, "╱", EDGE_STYLE)
        canvas.write_text(x + width - above, y + row, "╲", EDGE_STYLE)
        canvas.write_text(x + below, bottom + row, "╲", EDGE_STYLE)
        canvas.write_text(x + width - below, bottom + row, "╱", EDGE_STYLE)
    for line in range(y + size.slope_rows, bottom):
        canvas.write_text(x, line, "│", EDGE_STYLE)
        canvas.write_text(x + width, line, "│", EDGE_STYLE)


def _draw_hex_content(canvas: Canvas, x: int, y: int, cell: HexCell, size: HexSize) -> None:
    """What stands in a hex, in the middle of its rows."""
    room, first = size.width - 1, (size.text_rows - 1) // 2
    if " on " in cell.style:
        for row in range(size.text_rows):
            canvas.write_text(x, y + row, " " * room, cell.style)
    canvas.write_text(x, y + first, cell.mark[:room].center(room), cell.style)
    if size.text_rows > 1:
        canvas.write_text(x, y + first + 1, cell.second_line[:room].center(room), cell.style)


def make_overlay_cell(options: DrawOptions, state: int, size: HexSize) -> HexCell:
    """What an overlay writes into a hex that stands for a state: value, best actions or index."""
    assert options.overlay
    values, kind = options.overlay.action_values[state], options.overlay.kind
    if kind == "states":
        text = str(state)
    elif kind == "values":
        text = format_to_width(values.max(), size.width - 1)
    else:
        names = COMPASS if options.ascii else ARROWS
        chosen = [names[a] for a in np.flatnonzero(mark_best_actions(values))]
        text = chosen[0] if len(chosen) == 1 or size.text_rows == 1 else "/".join(chosen)[:5]
    return HexCell(text, style="cyan") if size.text_rows == 1 else HexCell("", text, style="cyan")


def get_direction_key(options: DrawOptions, direction: int) -> str:
    """The key that leads on in a direction."""
    return options.keys_by_action.get(DIRECTIONS[direction], DIRECTION_KEYS[direction])


def make_direction_cell(options: DrawOptions, direction: int, size: HexSize) -> HexCell:
    """The key that leads on, and if that is asked, what is lost by it: a bar and the number."""
    key, room = get_direction_key(options, direction), size.width - 1
    loss = format_regret(options, direction, room)
    if not loss:
        return HexCell(key, style="green")
    best = sort_regrets(options)[direction] < REGRET_TOLERANCE
    style = "bold green" if best else "green"
    if size.text_rows > 1:
        mark = (
            key if best else f"{key} {format_regret_bar(options, direction, room - 2):<{room - 2}}"
        )
        return HexCell(mark, loss, style=style)
    mark = f"{key}*" if best else key + format_regret_bar(options, direction, 1)
    return HexCell(mark, dot_glyph=mark if best else ".", style=style)


def format_wall_regrets(hexes: Sequence[Hex], position: Hex, options: DrawOptions) -> str:
    """What is lost by walking into each wall, as no hex stands there to say it."""
    around = hex_neighbours(position)
    told = [
        f"{get_direction_key(options, a)} {format_regret(options, a)}"
        for a in sort_regrets(options)
        if around[a] not in hexes
    ]
    return f"walls: {' '.join(told)}" if told else "what is lost by each way"


def format_move_condition(forecast: Forecast) -> str:
    """The move that is foreseen as a condition: `if you go NE`."""
    return format_condition(forecast, f"go {DIRECTIONS[int(forecast.action)].upper()}")


def describe_neighbours(
    hexes: Sequence[Hex], position: Hex, describe_hex: Callable[[Hex], str]
) -> list[str]:
    """The six ways on in action order, a sentence each: `E (6,2) floor.`, `NE wall.`."""
    return [
        f"{name.upper()} {f'{format_hex(near)} {describe_hex(near)}' if near in hexes else 'wall'}."
        for name, near in zip(DIRECTIONS, hex_neighbours(position), strict=True)
    ]


def format_distance(start: Hex, end: Hex) -> str:
    """How far one hex is from another on the plane: `4 steps`."""
    return format_count(hex_distance(start, end), "step")


def classify_move(before: Hex, after: Hex, chosen_direction: int) -> HexMove:
    """What came of a move."""
    if after == before:
        return HexMove("", False)
    went = hex_neighbours(before).index(after)
    return HexMove(DIRECTIONS[went].upper(), went != chosen_direction)
