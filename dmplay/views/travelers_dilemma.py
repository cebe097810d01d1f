"""How the traveler's dilemma looks: the corner of the table round both claims, and the rounds."""

from collections.abc import Iterator

from rich.text import Text

from dmplay.problems.travelers_dilemma import BONUS, LEAST, MOST
from dmplay.session import View
from dmplay.views._canvas import Canvas, Look
from dmplay.views._payoffs import game, last, panel, rounds, told

KEYS: dict[str, str] = {}  # a claim is typed
NUDGES = {"up": 1, "down": -1, "pageup": 10, "pagedown": -10}  # what a key adds to the claim
STUB, CELL, MORE = 5, 8, 3  # columns: before the table, of a cell, of an edge where it goes on
CLAIM = 4  # columns of a claim in the rounds


def boards(view: View, look: Look) -> Iterator[Text]:
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


def _span(claim: int, many: int) -> list[int]:
    """So many claims round one, all of them on the table."""
    first = min(max(claim - many // 2, LEAST), MOST + 1 - many)
    return list(range(first, first + many))


def _window(view: View, canvas: Canvas, many: int) -> int:
    """The table round both last claims, `…` where it goes on; the row after it."""
    problem, _ = game(view)
    played = last(view)
    claims = [LEAST + action for action in played] if played else [MOST, MOST]
    rows, columns = (_span(claim, many) for claim in claims)
    before, above = columns[0] > LEAST, rows[0] > LEAST
    xs = [STUB + MORE * before + before + j * (CELL + 1) for j in range(many)]
    canvas.put(0, 0, " " * STUB)
    if before:
        canvas.put(STUB, 0, "│", "dim")
        canvas.put(STUB + 1, 0, "…".center(MORE), "dim")
    for x, claim in zip(xs, columns, strict=True):
        canvas.put(x, 0, "│", "dim")
        canvas.put(
            x + 1, 0, str(claim).center(CELL), "bold" * (played is not None and claim == claims[1])
        )
    rule = "─" * STUB + ("┼" + "─" * MORE) * before + ("┼" + "─" * CELL) * many
    if columns[-1] < MOST:
        canvas.put(xs[-1] + CELL + 1, 0, "│", "dim")
        canvas.put(xs[-1] + CELL + 2, 0, "…".center(MORE), "dim")
        rule += "┼" + "─" * MORE
    canvas.put(0, 1, rule, "dim")
    y = 2
    for shown, row in ((above, None), *((True, claim) for claim in rows), (rows[-1] < MOST, None)):
        if not shown:
            continue
        if row is None:
            canvas.put(0, y, "…".rjust(STUB - 1), "dim")
        else:
            mark = ">" if played and row == claims[0] else " "
            canvas.put(0, y, f"{mark}{row:>3}", "bold" * (mark == ">"))
        if before:
            canvas.put(STUB, y, "│", "dim")
        for x, claim in zip(xs, columns, strict=True):
            canvas.put(x, y, "│", "dim")
            if row is None:
                continue
            pay = "{:g}, {:g}".format(*problem.payoffs[row - LEAST, claim - LEAST])
            here = played is not None and [row, claim] == claims
            pay = f"[{pay.replace(', ', ',')}]" if here else pay
            canvas.put(x + 1, y, pay.center(CELL), "bold reverse" * here)
        if columns[-1] < MOST:
            canvas.put(xs[-1] + CELL + 1, y, "│", "dim")
        y += 1
    return y


def situation(view: View) -> str:
    """The rule, as the table is too long to be told."""
    problem, _ = game(view)
    before = [f"last round: {told(view)}"] if view.turn else []
    sentences = [
        f"you are {problem.agents[view.seat]}.",
        *before,
        f"claim {LEAST} to {MOST} whole dollars.",
        "equal claims are paid as they are.",
        f"else both are paid the lower claim, its author {BONUS} more and the other {BONUS} less.",
    ]
    return " ".join(sentences)


__all__ = ["KEYS", "NUDGES", "boards", "panel", "situation", "told"]
