"""How 2048 looks: the board in boxes, the new tile underlined; slides are seen to happen."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from rich.text import Text

from dmplay.chance import Array, Reals
from dmplay.problems.game_2048 import Game2048, slide
from dmplay.session import View
from dmplay.tiles import DOWN, RIGHT, UP
from dmplay.views._advice import WIDEST, bar, known, lost
from dmplay.views.canvas import Canvas, percent
from dmplay.views.style import Lesson, Look, Outlook

KEYS = {
    "left": "left", "down": "down", "right": "right", "up": "up",
    "h": "left", "j": "down", "l": "right", "k": "up",
    "a": "left", "s": "down", "d": "right", "w": "up",
}  # fmt: skip
DARK, LIGHT = 16, 231  # numbers of the palette: black and white
FILLS = (
    (DARK, 255), (DARK, 230), (DARK, 216), (DARK, 209), (DARK, 203), (LIGHT, 160), (DARK, 228),
    (DARK, 221), (DARK, 214), (DARK, 154), (DARK, 51), (LIGHT, 63), (LIGHT, 93), (LIGHT, 127),
    (LIGHT, 53), (LIGHT, 22),
)  # fmt: skip
EDGE = 7  # columns at either side for what is lost by a slide that way
ARROWS = "←↓→↑"  # by action
FROM_ABOVE = (3, 0, 2, 1)  # the actions by where they lead
EMPTY = "·"
MOVES = True  # a turn is seen to happen


class Boxes(NamedTuple):
    """Columns and rows of a cell, and of the lines between two rows of them."""

    width: int
    height: int
    line: int = 1

    def place(self, row: float, column: float) -> tuple[int, int]:
        """Where a cell begins within the board; between two cells where it slides."""
        return round(1 + column * (self.width + 1)), round(1 + row * (self.height + self.line))

    @property
    def size(self) -> tuple[int, int]:
        """The column and the row of the border at the right and at the bottom."""
        x, y = self.place(4, 4)
        return x - 1, y - self.line


BOXES = (Boxes(9, 5), Boxes(9, 3), Boxes(7, 3), Boxes(6, 1), Boxes(5, 1), Boxes(5, 1, 0))
IN_TRANSCRIPTS = BOXES[3:5]


class Tile(NamedTuple):
    """What stands in a cell, or between two."""

    row: float
    column: float
    exponent: int
    text: str
    new: bool = False


def _tile(exponent: int) -> str:
    return str(2**exponent) if exponent else EMPTY


def filled(exponent: int) -> str:
    """A tile's number and its filling, from the palette."""
    if not exponent:
        return "dim"
    number, filling = FILLS[min(exponent, len(FILLS)) - 1]
    return f"bold color({number}) on color({filling})"


def _new(view: View[Game2048]) -> tuple[int, ...] | None:
    """The cell of the tile that came last."""
    if not view.turn:
        return None
    before, after = view.observations[-2], view.observations[-1]
    slid, _ = slide(before[None], np.array([int(view.actions[-1])]))
    found = np.argwhere(slid[0] != after)
    return tuple(found[0]) if len(found) else None


class Shown(NamedTuple):
    """A board, the cell of its new tile, and if a slide is foreseen what it says and brings."""

    board: Array  # [4, 4]
    new: tuple[int, ...] | None = None
    title: str = ""
    chances: Reals | None = None  # [4, 4], of a tile to come there
    slid: tuple[Tile, ...] = ()  # tiles on their way, above the board

    @property
    def tiles(self) -> list[Tile]:
        """What is drawn: in a cell a number, a dot, or how likely a tile comes there."""
        return [*(self._in(row, column) for row in range(4) for column in range(4)), *self.slid]

    def _in(self, row: int, column: int) -> Tile:
        exponent = int(self.board[row, column])
        chance = 0.0 if self.chances is None else float(self.chances[row, column])
        text = percent(chance) or _tile(exponent)
        return Tile(row, column, exponent, text, (row, column) == self.new)


def _shown(view: View[Game2048], look: Look) -> Shown:
    """The board as it is, or after a slide that is foreseen, or while a slide is under way."""
    if look.outlook is not None:
        return _after(view, look.outlook)
    if look.passed < 1 and view.turn:
        before, action = view.observations[-2], int(view.actions[-1])
        return Shown(np.zeros_like(before), slid=(*_under_way(before, action, look.passed),))
    return Shown(view.observation, _new(view))


def _under_way(board: Array, action: int, passed: float) -> Iterator[Tile]:
    """The tiles of a board when a share of the slide has passed."""
    for line in range(4):
        place, last = -1, 0
        for at in range(4):
            begin = _cell(action, line, at)
            exponent = int(board[begin])
            if not exponent:
                continue
            merges = exponent == last
            place, last = (place, 0) if merges else (place + 1, exponent)
            end = _cell(action, line, place)
            row, column = ((1 - passed) * a + passed * b for a, b in zip(begin, end, strict=True))
            yield Tile(row, column, exponent, _tile(exponent))


def _cell(action: int, line: int, at: int) -> tuple[int, int]:
    """The cell so far from the edge that a slide goes to."""
    place = 3 - at if action in (DOWN, RIGHT) else at
    return (place, line) if action in (DOWN, UP) else (line, place)


def _after(view: View[Game2048], outlook: Outlook) -> Shown:
    """The board after a slide, before a tile comes."""
    action = int(outlook.action)
    (slid,), (pay,) = slide(view.observation[None], np.array([action]))
    came = (outlook.states != slid) * outlook.chances[:, None, None]
    return Shown(
        slid, None, f" {view.problem.action_name(0, action)} pays {pay:g} ", came.sum(axis=0)
    )


def boards(view: View[Game2048], look: Look) -> Iterator[Text]:
    """The board in the boxes there is room for, the largest first, and in rows without borders."""
    shown = _shown(view, look)
    for boxes in BOXES if look.large else IN_TRANSCRIPTS:
        right, bottom = boxes.size
        if right < look.width and bottom < look.height:
            yield _drawn(shown, boxes, look)
    canvas = Canvas()
    for tile in shown.tiles:
        place = round(5 * tile.column), round(tile.row)
        _put(canvas, place, tile.text.rjust(5), tile)
    for row, action in enumerate(FROM_ABOVE):
        if loss := lost(look, action):
            canvas.put(22, row, f"{ARROWS[action]} {loss}", "green")
    yield canvas.text()


def _drawn(shown: Shown, boxes: Boxes, look: Look) -> Text:
    """The board in boxes."""
    canvas, left = Canvas(), 0 if look.regret is None else EDGE
    right, bottom = boxes.size
    _lines(canvas, boxes, left)
    for tile in shown.tiles:
        x, y = boxes.place(tile.row, tile.column)
        for row in range(y, y + boxes.height):
            canvas.put(left + x, row, " " * boxes.width, filled(tile.exponent))
        if not look.large or tile.text != EMPTY:
            middle = left + x, y + boxes.height // 2
            _put(canvas, middle, tile.text.center(boxes.width), tile)
    _margins(canvas, shown, look, (left, right, bottom))
    return canvas.text()


def _lines(canvas: Canvas, boxes: Boxes, left: int) -> None:
    """The borders of the board and of its cells."""
    bottom = boxes.size[1]
    for y in range(bottom + 1):
        canvas.put(left, y, "│".join(["", *[" " * boxes.width] * 4, ""]), "dim")
    for row, ends in enumerate(("┌┬┐", "├┼┤", "├┼┤", "├┼┤", "└┴┘")):
        if boxes.line or ends[1] != "┼":
            line = ends[0] + ends[1].join(["─" * boxes.width] * 4) + ends[2]
            y = bottom if row == 4 else boxes.place(row, 0)[1] - 1
            canvas.put(left, y, line, "dim")


def _margins(canvas: Canvas, shown: Shown, look: Look, area: tuple[int, int, int]) -> None:
    """What is foreseen, and at each edge what is lost by a slide that way."""
    left, width, height = area  # of the board, its borders included
    canvas.put(left + 1, 0, shown.title, "bold")
    for action in known(look):
        arrow, loss, bars = (
            ARROWS[action],
            lost(look, action, WIDEST if action in {UP, DOWN} else EDGE - 1),
            bar(look, action, EDGE - 2),
        )
        style = "bold green" if loss == "best" else "green"
        if arrow in "↑↓":
            told = f" {arrow} {loss} {bars}".rstrip() + " "
            canvas.put(left + (width - len(told)) // 2, 0 if arrow == "↑" else height, told, style)
            continue
        for y, told in enumerate((arrow, loss, bars), height // 2 - 1):
            canvas.put(left - 1 - len(told) if arrow == "←" else left + width + 2, y, told, style)


def _put(canvas: Canvas, place: tuple[int, int], text: str, tile: Tile) -> None:
    """Writes a tile; of a new one the number alone is underlined."""
    (x, y), style = place, filled(tile.exponent)
    canvas.put(x, y, text, style)
    if tile.new:
        canvas.put(x + len(text) - len(text.lstrip()), y, text.strip(), f"{style} underline")


def goal(view: View[Game2048]) -> list[str]:
    """What pays, what comes, and what ends it."""
    return [
        "merge equal tiles: each new one pays its number",
        "it ends when nothing slides",
        f"{percent(view.problem.p_two)} of the tiles that come are 2, the others 4",
    ]


def lesson(view: View[Game2048]) -> Lesson:
    """The slides, what pays, and what comes after each."""
    return Lesson(
        "You slide all tiles of a board of four by four at once, to one of its four sides",
        "You want merges: two equal tiles that meet become one, which pays its number",
        f"A slide is free, but then a tile comes, {percent(view.problem.p_two) or '0%'} of them 2 "
        "and the others 4, and when nothing slides any more it is over",
        "left",
    )


def panel(view: View[Game2048]) -> list[tuple[str, str]]:
    """The largest tile; the title has the score."""
    return [("largest", _tile(int(view.observation.max())))]


def told(view: View[Game2048]) -> str:
    """The slide and the new tile."""
    new = _new(view)
    if new is None:
        return f"slid {view.last}."
    tile = _tile(int(view.observation[new]))
    return f"slid {view.last}. new {tile} in row {new[0] + 1}, column {new[1] + 1}."


def situation(view: View[Game2048]) -> str:
    """The rows from the top, then the slides that are open."""
    rows = [
        f"row {number}: {' '.join('empty' if not e else _tile(int(e)) for e in row)}."
        for number, row in enumerate(view.observation, 1)
    ]
    can = view.problem.actions[view.seat].words(view.legal)
    return " ".join([*rows, f"open: {can or 'nothing, the game is over'}."])
