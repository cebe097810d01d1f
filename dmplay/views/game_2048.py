"""How 2048 looks: the board in boxes, the new tile underlined."""

from collections.abc import Iterator

import numpy as np
from rich.text import Text

from dmplay.chance import Array
from dmplay.problems.game_2048 import Game2048, slide
from dmplay.session import View
from dmplay.views.canvas import Canvas, percent
from dmplay.views.style import Look

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
FIRST = 3  # of these, the largest in a transcript


def _tile(exponent: int) -> str:
    return str(2**exponent) if exponent else "·"


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


def boards(view: View[Game2048], look: Look) -> Iterator[Text]:
    """The board in boxes, the largest first, and in four rows without borders."""
    board, new = view.observation, _new(view)
    for width, rows in BOXES[0 if look.large else FIRST :]:
        yield _boxes(board, new, width, rows)
    canvas = Canvas()
    for (row, column), exponent in np.ndenumerate(board):
        text = _tile(int(exponent)).rjust(5)
        _put(canvas, (column * 5, row), text, exponent, (row, column) == new)
    yield canvas.text()


def _boxes(board: Array, new: tuple[int, ...] | None, width: int, rows: int) -> Text:
    """The board in boxes of so many columns and rows."""
    canvas = Canvas()
    for row, ends in enumerate(("┌┬┐", "├┼┤", "├┼┤", "├┼┤", "└┴┘")):
        line = ends[0] + ends[1].join(["─" * width] * 4) + ends[2]
        canvas.put(0, (rows + 1) * row, line, "dim")
    for (row, column), exponent in np.ndenumerate(board):
        x, y = column * (width + 1), (rows + 1) * row + 1
        for below in range(rows):
            canvas.put(x, y + below, "│", "dim")
            canvas.put(x + 1, y + below, " " * width, filled(exponent))
            canvas.put(x + width + 1, y + below, "│", "dim")
        text = _tile(int(exponent)).center(width)
        _put(canvas, (x + 1, y + rows // 2), text, exponent, (row, column) == new)
    return canvas.text()


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
    """Score, largest tile, last slide."""
    board = view.observation
    rewards = view.rewards or ()
    return [
        ("score", f"{sum(rewards):g}"),
        ("largest", _tile(int(board.max()))),
        ("empty", str(int((board == 0).sum()))),
        ("last", view.last or "-"),
        ("merged", f"{rewards[-1]:g}" if rewards else "-"),
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
