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
RAMP = (
    "dim", "", "", "yellow", "yellow", "red", "red", "magenta",
    "bold magenta", "bold blue", "bold cyan", "bold green", "bold bright_green",
)  # fmt: skip


def _tile(exponent: int) -> str:
    return str(2**exponent) if exponent else "·"


def _style(exponent: int, new: bool) -> str:
    style = RAMP[min(exponent, len(RAMP) - 1)]
    return f"{style} underline" if new else style


def _new(view: View[Game2048]) -> tuple[int, ...] | None:
    """The cell of the tile that came last."""
    if not view.turn:
        return None
    before, after = view.observations[-2], view.observations[-1]
    slid, _ = slide(before[None], np.array([int(view.actions[-1])]))
    found = np.argwhere(slid[0] != after)
    return tuple(found[0]) if len(found) else None


def boards(view: View[Game2048], look: Look) -> Iterator[Text]:
    """Cells of six columns, of five, and four rows without borders."""
    board, new = view.observation, _new(view)
    yield _boxes(board, new, 6)
    yield _boxes(board, new, 5)
    canvas = Canvas()
    for (row, column), exponent in np.ndenumerate(board):
        text = _tile(int(exponent)).rjust(5)
        canvas.put(column * 5, row, text, _style(int(exponent), (row, column) == new))
    yield canvas.text()


def _boxes(board: Array, new: tuple[int, ...] | None, width: int) -> Text:
    """The board in boxes of so many columns."""
    canvas = Canvas()
    for row, ends in enumerate(("┌┬┐", "├┼┤", "├┼┤", "├┼┤", "└┴┘")):
        canvas.put(0, 2 * row, ends[0] + ends[1].join(["─" * width] * 4) + ends[2], "dim")
    for (row, column), exponent in np.ndenumerate(board):
        x, y = column * (width + 1), 2 * row + 1
        text = _tile(int(exponent)).center(width)
        canvas.put(x, y, "│", "dim")
        style = _style(int(exponent), False)
        canvas.put(x + 1, y, text, style)
        if (row, column) == new:  # the number alone is underlined
            at = len(text) - len(text.lstrip())
            canvas.put(x + 1 + at, y, text.strip(), _style(int(exponent), True))
        canvas.put(x + width + 1, y, "│", "dim")
    return canvas.text()


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
