"""How 2048 looks: the board in boxes, the new tile underlined."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from rich.text import Text

from dmplay.chance import Array, Reals
from dmplay.problems.game_2048 import Game2048, slide
from dmplay.session import View
from dmplay.views._marks import bar, foreseen, known, lost
from dmplay.views.canvas import Canvas, percent
from dmplay.views.style import Look, Outlook

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
BOXES = ((9, 5), (9, 3), (7, 3), (6, 1), (5, 1))  # columns and rows of a cell
EDGE = 7  # columns at either side for what is lost by a slide that way
ARROWS = "←↓→↑"  # by action
FROM_ABOVE = (3, 0, 2, 1)  # the actions by where they lead
EMPTY = "·"
FIRST = 3  # of these, the largest in a transcript


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

    def text(self, row: int, column: int) -> str:
        """What stands in a cell: a number, a dot, or how likely a tile comes there."""
        chance = 0.0 if self.chances is None else float(self.chances[row, column])
        return percent(chance) or _tile(int(self.board[row, column]))


def _shown(view: View[Game2048], look: Look) -> Shown:
    """The board as it is, or after a slide that is foreseen."""
    if look.outlook is None:
        return Shown(view.observation, _new(view))
    return _after(view, look.outlook)


def _after(view: View[Game2048], outlook: Outlook) -> Shown:
    """The board after a slide, before a tile comes."""
    action = int(outlook.action)
    (slid,), (pay,) = slide(view.observation[None], np.array([action]))
    came = (outlook.states != slid) * outlook.chances[:, None, None]
    title = foreseen(outlook, view.problem.action_name(view.seat, action))
    return Shown(slid, None, f" {title}: pays {pay:g} ", came.sum(axis=0))


def boards(view: View[Game2048], look: Look) -> Iterator[Text]:
    """The board in boxes, the largest first, and in four rows without borders."""
    shown = _shown(view, look)
    for width, rows in BOXES[0 if look.large else FIRST :]:
        yield _boxes(shown, width, rows, look)
    if look.large:
        yield _framed(shown, look)
    canvas = Canvas()
    _tiny(canvas, shown, (0, 0))
    for row, action in enumerate(FROM_ABOVE):
        if loss := lost(look, action):
            canvas.put(22, row, f"{ARROWS[action]} {loss}", "green")
    yield canvas.text()


def _tiny(canvas: Canvas, shown: Shown, corner: tuple[int, int]) -> None:
    """Four rows of numbers."""
    for (row, column), exponent in np.ndenumerate(shown.board):
        text = shown.text(row, column).rjust(5)
        place = corner[0] + column * 5, corner[1] + row
        _put(canvas, place, text, exponent, (row, column) == shown.new)


def _framed(shown: Shown, look: Look) -> Text:
    """Four rows of numbers in one frame."""
    canvas, x = Canvas(), 0 if look.regret is None else EDGE
    _tiny(canvas, shown, (x + 1, 1))
    for y in range(1, 5):
        canvas.put(x, y, "│", "dim")
        canvas.put(x + 22, y, "│", "dim")
    canvas.put(x, 0, f"┌{'─' * 21}┐", "dim")
    canvas.put(x, 5, f"└{'─' * 21}┘", "dim")
    _margins(canvas, shown, look, (x, 22, 5))
    return canvas.text()


def _boxes(shown: Shown, width: int, rows: int, look: Look) -> Text:
    """The board in boxes of so many columns and rows."""
    canvas, left = Canvas(), 0 if look.regret is None else EDGE
    for row, ends in enumerate(("┌┬┐", "├┼┤", "├┼┤", "├┼┤", "└┴┘")):
        line = ends[0] + ends[1].join(["─" * width] * 4) + ends[2]
        canvas.put(left, (rows + 1) * row, line, "dim")
    for (row, column), exponent in np.ndenumerate(shown.board):
        x, y = left + column * (width + 1), (rows + 1) * row + 1
        for below in range(rows):
            canvas.put(x, y + below, "│", "dim")
            canvas.put(x + 1, y + below, " " * width, filled(exponent))
            canvas.put(x + width + 1, y + below, "│", "dim")
        text = shown.text(row, column)
        if look.large and text == EMPTY:
            continue
        _put(
            canvas, (x + 1, y + rows // 2), text.center(width), exponent, (row, column) == shown.new
        )
    _margins(canvas, shown, look, (left, 4 * (width + 1), 4 * (rows + 1)))
    return canvas.text()


def _margins(canvas: Canvas, shown: Shown, look: Look, area: tuple[int, int, int]) -> None:
    """What is foreseen, and at each edge what is lost by a slide that way."""
    left, width, height = area  # of the board, its borders included
    canvas.put(left + 1, 0, shown.title, "bold")
    for action in known(look):
        arrow, loss, bars = (
            ARROWS[action],
            lost(look, action, EDGE - 1),
            bar(look, action, EDGE - 2),
        )
        style = "bold green" if loss == "best" else "green"
        if arrow in "↑↓":
            told = f" {arrow} {loss} {bars}".rstrip() + " "
            canvas.put(left + (width - len(told)) // 2, 0 if arrow == "↑" else height, told, style)
            continue
        for y, told in enumerate((arrow, loss, bars), height // 2 - 1):
            canvas.put(left - 1 - len(told) if arrow == "←" else left + width + 2, y, told, style)


def _put(canvas: Canvas, place: tuple[int, int], text: str, exponent: int, new: bool) -> None:
    """Writes a cell; of a new tile the number alone is underlined."""
    (x, y), style = place, filled(exponent)
    canvas.put(x, y, text, style)
    if new:
        canvas.put(x + len(text) - len(text.lstrip()), y, text.strip(), f"{style} underline")


def goal(view: View[Game2048]) -> list[str]:
    """What pays, what comes, and what ends it."""
    return [
        "merge equal tiles: each new one pays its number",
        "it ends when nothing slides",
        f"{percent(view.problem.p_two)} of the tiles that come are 2, the others 4",
    ]


def panel(view: View[Game2048]) -> list[tuple[str, str]]:
    """Score and largest tile."""
    board = view.observation
    rewards = view.rewards or ()
    return [
        ("score", f"{sum(rewards):g}"),
        ("largest", _tile(int(board.max()))),
    ]


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
