"""How the traveler's dilemma looks: the corner of the table round both claims, and the rounds."""

from collections.abc import Iterator

from rich.text import Text

from dmplay.problems.travelers_dilemma import BONUS, LEAST, MOST, TravelersDilemma
from dmplay.session import View
from dmplay.views._payoffs import last, panel, rounds, told
from dmplay.views.canvas import Canvas
from dmplay.views.style import Look

KEYS: dict[str, str] = {}  # a claim is typed
NUDGES = {"up": 1, "down": -1, "pageup": 10, "pagedown": -10}  # what a key adds to the claim
STUB, CELL, MORE = 5, 8, 3  # columns: before the table, of a cell, of an edge where it goes on
CLAIM = 4  # columns of a claim in the rounds


def goal(view: View[TravelersDilemma]) -> list[str]:
    """What both are paid."""
    return [
        "both are paid the lower claim",
        f"its author {BONUS:g} more, the other {BONUS:g} less",
        f"claim {LEAST} to {MOST}",
    ]


def boards(view: View[TravelersDilemma], look: Look) -> Iterator[Text]:
    """Five claims by five, three by three, each with the rounds or without; the rounds alone."""
    for many, history in ((5, True), (5, False), (3, True), (3, False)):
        canvas = Canvas()
        y = _window(view, canvas, many)
        if history:
            rounds(view, canvas, y + 1, look.width, column=CLAIM, none="-")
        yield canvas.text()
    canvas = Canvas()
    rounds(view, canvas, 0, look.width, column=CLAIM, none="-")
    canvas.put(0, 2, "both are paid the lower claim,", "dim")
    canvas.put(0, 3, f"its author {BONUS} more, the other {BONUS} less", "dim")
    yield canvas.text()


def _window(view: View[TravelersDilemma], canvas: Canvas, many: int) -> int:
    """The table round both last claims, `…` where it goes on; the row after it."""
    played = last(view)
    mine, theirs = (LEAST + action for action in played) if played else (None, None)
    rows, columns = _span(mine, many), _span(theirs, many)
    widths = [CELL if claim else MORE for claim in columns]
    heads = [
        (str(claim), "bold" * (claim == theirs)) if claim else ("…", "dim") for claim in columns
    ]
    _line(canvas, 0, widths, heads)
    canvas.put(0, 1, "─" * STUB + "".join("┼" + "─" * wide for wide in widths), "dim")
    for y, row in enumerate(rows, 2):
        stub, style = f"{row:>4}" if row else "…".rjust(STUB - 1), "" if row else "dim"
        if row and row == mine:
            stub, style = f">{row:>3}", "bold"
        canvas.put(0, y, stub, style)
        _line(canvas, y, widths, [_pay(view, row, claim) for claim in columns])
    return 2 + len(rows)


def _span(claim: int | None, many: int) -> list[int | None]:
    """So many claims round one, the highest if none is made; None where the table goes on."""
    first = min(max((claim or MOST) - many // 2, LEAST), MOST + 1 - many)
    around = range(first, first + many)
    return [*[None] * (first > LEAST), *around, *[None] * (around[-1] < MOST)]


def _line(canvas: Canvas, y: int, widths: list[int], cells: list[tuple[str, str]]) -> None:
    """A row of the table right of its first column: texts and their styles."""
    x = STUB
    for wide, (text, style) in zip(widths, cells, strict=True):
        canvas.put(x, y, "│", "dim")
        canvas.put(x + 1, y, text.center(wide), style)
        x += wide + 1


def _pay(view: View[TravelersDilemma], mine: int | None, theirs: int | None) -> tuple[str, str]:
    """What two claims pay, and its style: bold in brackets where they are the last."""
    if mine is None or theirs is None:
        return "", ""
    chosen = (mine - LEAST, theirs - LEAST)
    first, second = view.problem.payoffs[chosen]
    if chosen == last(view):
        return f"[{first:g},{second:g}]", "bold reverse"
    return f"{first:g}, {second:g}", ""


def situation(view: View[TravelersDilemma]) -> str:
    """The rule, as the table is too long to be told."""
    before = [f"last round: {told(view)}"] if view.turn else []
    sentences = [
        f"you are {view.problem.agents[view.seat]}.",
        *before,
        f"claim {LEAST} to {MOST} whole dollars.",
        "equal claims are paid as they are.",
        f"else both are paid the lower claim, its author {BONUS} more and the other {BONUS} less.",
    ]
    return " ".join(sentences)


__all__ = ["KEYS", "NUDGES", "boards", "panel", "situation", "told"]
