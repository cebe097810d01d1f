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

from dmplay.describe import counted
from dmplay.hexes import DIRECTIONS, Hex, distance, neighbours, notation_of
from dmplay.solvers.value_iteration import best
from dmplay.views._advice import bar, foreseen, known, lost
from dmplay.views.canvas import Canvas, short
from dmplay.views.canvas import size as measured
from dmplay.views.style import ALIKE, Look, Outlook

ARROWS = ("→", "↗", "↖", "←", "↙", "↘")
COMPASS = ("E", "NE", "NW", "W", "SW", "SE")
EDGE = "dim"
MARKS = "* best, █ loses most"  # what stands beside the keys of small hexes

KEYS = {
    "l": "e", "u": "ne", "y": "nw", "h": "w", "b": "sw", "n": "se",
    "right": "e", "up right": "ne", "up left": "nw", "left": "w", "down left": "sw",
    "down right": "se", "pageup": "ne", "home": "nw", "end": "sw", "pagedown": "se",
}  # fmt: skip
FAMILY = "hex"  # under which a player sets keys of these problems
LETTERS = ("l", "u", "y", "h", "b", "n")  # in action order
LEFT = {"w": "nw", "e": "ne", "a": "w", "d": "e", "z": "sw", "x": "se"}  # for a second person


class Cell(NamedTuple):
    """What stands in a hex: a mark, a second line, and one glyph for the dots."""

    mark: str
    note: str = ""
    dot: str = "."
    style: str = ""


class Size(NamedTuple):
    """A size of hex: columns a hex, rows of text in it (0 for dots), rows of each slope."""

    width: int
    lines: int
    slopes: int = 1


class Walk(NamedTuple):
    """What came of a move: the direction it went, nothing where it bumped; whether it slipped."""

    way: str
    slipped: bool

    @property
    def said(self) -> str:
        """In words: `moved NE`, `slipped, moved E`, or `bumped, stayed`."""
        return f"{'slipped, ' * self.slipped}moved {self.way}" if self.way else "bumped, stayed"


LARGE = Size(18, 4, 4), Size(14, 4, 3), Size(10, 3, 2), Size(8, 3, 2)
NORMAL, COMPACT, DOTS, FINE = Size(6, 2), Size(4, 1), Size(4, 0), Size(2, 0)


def grids(
    hexes: Sequence[Hex], cell: Callable[[Hex, Size], Cell], look: Look, caption: str = ""
) -> Iterator[Text]:
    """The map in every size, the largest first; of those that grow with the screen what fits.

    Each has a line below it if that is no wider, and none where the line has no room. One that has
    no room itself is as large, and blank. Nobody writes into them: they come again.
    """
    across = [2 * q + r for q, r in hexes]
    up = [r for _, r in hexes]
    span, rise = max(across) - min(across), max(up) - min(up)
    for size in (*(LARGE if look.large else ()), NORMAL, COMPACT, DOTS, FINE):
        width, height = _extent(size, span, rise)
        if width > look.width or height > look.height:
            if size not in LARGE:
                yield Text("\n" * (height - 1) + " " * width, no_wrap=True)
            continue
        cells = tuple([cell(hex_, size) for hex_ in hexes])
        marks = f"; {MARKS}" if look.regret is not None and size.lines < 2 else ""
        told = (f"{caption}{marks}", marks[2:], caption) if caption else ()
        yield from _captioned(tuple(hexes), cells, size, told)


def _extent(size: Size, span: int, rise: int) -> tuple[int, int]:
    """Columns and rows of a map whose hexes are half as many and as many apart; of dots at least
    so many columns, as what stands beside the last may be blank.
    """
    first = span * size.width // 2
    if not size.lines:
        return first + 1, rise + 1
    pitch = size.lines + size.slopes
    return first + size.width + 1, (rise + 1) * pitch + size.slopes


def grid(hexes: Sequence[Hex], cell: Callable[[Hex, Size], Cell], size: Size) -> Text:
    """The map in one size."""
    return _drawn(hexes, [cell(hex_, size) for hex_ in hexes], size)


@lru_cache(256)
def _captioned(
    hexes: tuple[Hex, ...], cells: tuple[Cell, ...], size: Size, captions: tuple[str, ...]
) -> tuple[Text, ...]:
    """The map with the first of these lines that is no wider below it, and without; a game shows
    few that differ, again and again.
    """
    drawn = _drawn(hexes, cells, size)
    width = measured(drawn)[0]
    below = next((one for one in captions if 0 < len(one) <= width), "")
    return (drawn.copy().append(f"\n{below}", "bold"), drawn) if below else (drawn,)


def _drawn(hexes: Sequence[Hex], cells: Sequence[Cell], size: Size) -> Text:
    """The map with these cells."""
    canvas = Canvas()
    left = min(2 * q + r for q, r in hexes)
    top = max(r for _, r in hexes)
    pitch = size.lines + size.slopes
    each = zip(hexes, cells, strict=True)
    for (q, r), content in sorted(each, key=lambda one: (-one[0][1], one[0][0])):
        x, y = (2 * q + r - left) * size.width // 2, (top - r) * pitch
        if size.lines:
            _frame(canvas, x, y, size)
            _fill(canvas, x + 1, y + size.slopes, content, size)
        else:
            wide = size.width - 1
            text = content.dot if len(content.dot) <= wide else content.dot[:1]
            canvas.put(x, y, text.center(wide), content.style)
    return canvas.text()


def _frame(canvas: Canvas, x: int, y: int, size: Size) -> None:
    """The six sides of a hex."""
    width, bottom = size.width, y + size.slopes + size.lines
    for row in range(size.slopes):
        above = 1 + 2 * (size.slopes - 1 - row)
        below = width // 2 - above  # as the slopes of the hexes there
        canvas.put(x + above, y + row, "╱", EDGE)
        canvas.put(x + width - above, y + row, "╲", EDGE)
        canvas.put(x + below, bottom + row, "╲", EDGE)
        canvas.put(x + width - below, bottom + row, "╱", EDGE)
    for line in range(y + size.slopes, bottom):
        canvas.put(x, line, "│", EDGE)
        canvas.put(x + width, line, "│", EDGE)


def _fill(canvas: Canvas, x: int, y: int, content: Cell, size: Size) -> None:
    """What stands in a hex, in the middle of its rows."""
    room, first = size.width - 1, (size.lines - 1) // 2
    if " on " in content.style:
        for row in range(size.lines):
            canvas.put(x, y + row, " " * room, content.style)
    canvas.put(x, y + first, content.mark[:room].center(room), content.style)
    if size.lines > 1:
        canvas.put(x, y + first + 1, content.note[:room].center(room), content.style)


def overlaid(look: Look, state: int, size: Size) -> Cell:
    """What an overlay writes into a hex that stands for a state: value, best actions or index."""
    assert look.overlay
    values, kind = look.overlay.values[state], look.overlay.kind
    if kind == "states":
        text = str(state)
    elif kind == "values":
        text = short(values.max(), size.width - 1)
    else:
        names = COMPASS if look.ascii else ARROWS
        chosen = [names[a] for a in np.flatnonzero(best(values))]
        text = chosen[0] if len(chosen) == 1 or size.lines == 1 else "/".join(chosen)[:5]
    return Cell(text, style="cyan") if size.lines == 1 else Cell("", text, style="cyan")


def key_of(look: Look, way: int) -> str:
    """The key that leads on in a direction."""
    return look.names.get(DIRECTIONS[way], LETTERS[way])


def way_on(look: Look, way: int, size: Size) -> Cell:
    """The key that leads on, and if that is asked, what is lost by it: a bar and the number."""
    key, room = key_of(look, way), size.width - 1
    loss = lost(look, way, room)
    if not loss:
        return Cell(key, style="green")
    best = known(look)[way] < ALIKE
    style = "bold green" if best else "green"
    if size.lines > 1:
        mark = key if best else f"{key} {bar(look, way, room - 2):<{room - 2}}"
        return Cell(mark, loss, style=style)
    mark = f"{key}*" if best else key + bar(look, way, 1)
    return Cell(mark, dot=mark if best else ".", style=style)


def walls(hexes: Sequence[Hex], here: Hex, look: Look) -> str:
    """What is lost by walking into each wall, as no hex stands there to say it."""
    around = neighbours(here)
    told = [f"{key_of(look, a)} {lost(look, a)}" for a in known(look) if around[a] not in hexes]
    return f"walls: {' '.join(told)}" if told else "what is lost by each way"


def going(outlook: Outlook) -> str:
    """The move that is foreseen as a condition: `if you go NE`."""
    return foreseen(outlook, f"go {DIRECTIONS[int(outlook.action)].upper()}")


def ways(hexes: Sequence[Hex], here: Hex, kind: Callable[[Hex], str]) -> list[str]:
    """The six ways on in action order, a sentence each: `E (6,2) floor.`, `NE wall.`."""
    return [
        f"{name.upper()} {f'{notation_of(near)} {kind(near)}' if near in hexes else 'wall'}."
        for name, near in zip(DIRECTIONS, neighbours(here), strict=True)
    ]


def steps(one: Hex, other: Hex) -> str:
    """How far one hex is from another on the plane: `4 steps`."""
    return counted(distance(one, other), "step")


def walked(before: Hex, after: Hex, chosen: int) -> Walk:
    """What came of a move."""
    if after == before:
        return Walk("", False)
    went = neighbours(before).index(after)
    return Walk(DIRECTIONS[went].upper(), went != chosen)
