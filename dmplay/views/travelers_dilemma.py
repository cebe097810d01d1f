"""How the traveler's dilemma looks: the corner of the table round both claims, and the rounds."""

from collections.abc import Iterator, Sequence

import numpy as np
from rich.text import Text

from dmplay.problems.travelers_dilemma import BONUS, LEAST, MOST, TravelersDilemma
from dmplay.session import View
from dmplay.views._advice import WIDEST, asked, fewest, losses, under
from dmplay.views._belief import spark
from dmplay.views._payoffs import called, last, named, paid_rounds, panel, rounds, told
from dmplay.views._scale import Scale
from dmplay.views.canvas import Canvas
from dmplay.views.style import Lesson, Look

KEYS: dict[str, str] = {}  # a claim is typed
NUDGES = {"up": 1, "down": -1, "pageup": 10, "pagedown": -10}  # what a key adds to the claim
STUB, CELL, MORE = 5, 8, 3  # columns: before the table, of a cell, of an edge where it goes on
CLAIM = 4  # columns of a claim in the rounds
LARGE = ((6, True), (5, True), (4, True), (6, False), (4, False))  # claims; with the rounds or not
LINE = Scale(LEAST, MOST, 2, 55)  # of all claims


def goal(view: View[TravelersDilemma]) -> list[str]:
    """What both are paid."""
    return [
        "both are paid the lower claim",
        f"its author {BONUS:g} more, the other {BONUS:g} less",
        f"claim {LEAST} to {MOST}",
    ]


def lesson(view: View[TravelersDilemma]) -> Lesson:
    """Who claims, and what two claims pay."""
    you, other = (view.problem.agents[seat] for seat in (view.seat, 1 - view.seat))
    return Lesson(
        f"You are {you} and claim {LEAST} to {MOST} dollars at the same time as {other}",
        "You want to be paid much: a high claim, but one below the other's",
        f"Both are paid the lower claim; who made it {BONUS:g} more, the other {BONUS:g} less; "
        "equal claims are paid as they are",
        "50",
    )


def boards(view: View[TravelersDilemma], look: Look) -> Iterator[Text]:
    """A table over a line of claims with the rounds or without; smaller tables; the rounds."""
    for many, history in LARGE if look.large else ():
        yield _large(view, look, many, history)
    notes = losses(look, view.problem.actions[view.seat])
    if look.large:
        tables = (_window(view, look, many)[0].text() for many in (4, 3))
        yield from under(tables, [*notes, *(_pays(view, look) or [_paid(view)])], look)
    yield from under(_drawings(view, look), [*notes, *_pays(view, look)], look)


def _drawings(view: View[TravelersDilemma], look: Look) -> Iterator[Text]:
    """Five claims by five, three by three, each with the rounds or without; the rounds alone."""
    mine, theirs = _claims(view)
    for many, history in ((5, True), (5, False), (3, True), (3, False)):
        canvas = Canvas()
        y = _table(view, canvas, 0, look, (_span(mine, many), _span(theirs, many)))
        if history:
            rounds(view, canvas, y + 1, look.width, column=CLAIM, none="-")
        yield canvas.text()
    canvas = Canvas()
    rounds(view, canvas, 0, look.width, column=CLAIM, none="-")
    canvas.put(0, 2, "both are paid the lower claim,", "dim")
    canvas.put(0, 3, f"its author {BONUS} more, the other {BONUS} less", "dim")
    yield canvas.text()


def _large(view: View[TravelersDilemma], look: Look, many: int, history: bool) -> Text:
    """The table with its axes by name, both claims on a line, what claims lose, the rounds."""
    canvas, y = _window(view, look, many)
    canvas.put(0, 0, f"{_axes(view)}   cells pay agent1, agent2", "dim")
    y = _line_of_claims(view, canvas, y + 1)
    y = _lost(canvas, y, look)
    if history:
        y = paid_rounds(view, canvas, y + 1, look.width)
    for row, told_ in enumerate(_pays(view, look), y):
        canvas.put(0, row, told_)
    return canvas.text()


def _axes(view: View[TravelersDilemma]) -> str:
    """Whose claims go down, and whose across."""
    down, across = named(view)
    return f"{down} ↓   {across} →"


def _window(view: View[TravelersDilemma], look: Look, many: int) -> tuple[Canvas, int]:
    """The table round both last claims, or round the one in question; the row after it."""
    canvas, around = Canvas(), [*_claims(view)]
    canvas.put(0, 0, _axes(view), "dim")
    if look.outlook is not None:
        around[view.seat] = LEAST + int(look.outlook.action)
    rows, columns = ([*_around(claim, many)] for claim in around)
    return canvas, _table(view, canvas, 1, look, (rows, columns))


def _paid(view: View[TravelersDilemma]) -> str:
    """Both claims of the last round, and what they were paid."""
    played = last(view)
    if played is None:
        return "no claims yet"
    pays = zip(called(view), played, view.problem.payoffs[played], strict=True)
    return "; ".join(f"{name} {LEAST + claim}, paid {pay:g}" for name, claim, pay in pays)


def _line_of_claims(view: View[TravelersDilemma], canvas: Canvas, y: int) -> int:
    """All claims on a line, with both of the last round and what they were paid; the row after."""
    canvas.put(0, y + 1, f"{LEAST} ├{'─' * (LINE.right - LINE.left - 1)}┤ {MOST}", "dim")
    played = last(view)
    if played is None:
        canvas.put(LINE.left, y, "no claims yet", "dim")
        return y + 3
    glyphs = {view.seat: ("●", "bold cyan", y), 1 - view.seat: ("○", "bold magenta", y + 2)}
    for seat in (1 - view.seat, view.seat):
        glyph, style, row = glyphs[seat]
        claim = LEAST + played[seat]
        told_ = f"{called(view)[seat]} {claim}, paid {view.problem.payoffs[played][seat]:g}"
        column = LINE.column(claim)
        canvas.put(column, y + 1, glyph, style)
        canvas.put(min(column, LINE.right + 5 - len(told_)), row, told_, style)
    return y + 3


def _lost(canvas: Canvas, y: int, look: Look) -> int:
    """What each claim loses against the best, in columns under the line; the row after them."""
    if look.regret is None:
        return y
    best, most = int(np.argmin(look.regret)), float(look.regret.max())
    columns = range(LINE.left, LINE.right + 1)
    each = [look.regret[round(LINE.value(column)) - LEAST] / (most or 1.0) for column in columns]
    canvas.put(LINE.left, y, spark(each, look.ascii), "yellow")
    canvas.put(LINE.column(LEAST + best), y, "●", "bold")
    canvas.put(0, y + 1, f"● best {LEAST + best}; the worst {fewest(-most, WIDEST)}", "yellow")
    return y + 2


def _pays(view: View[TravelersDilemma], look: Look) -> list[str]:
    """What each kind of reply pays for the claim in question."""
    if look.outlook is None:
        return []
    claim = LEAST + int(look.outlook.action)
    return [
        f"{asked(view, look.outlook, 'claim {}')}: "
        f"if equal {claim}, lower {claim + BONUS}, higher theirs less {BONUS}"
    ]


def _claims(view: View[TravelersDilemma]) -> tuple[int | None, int | None]:
    """Both claims of the last round."""
    played = last(view)
    return (LEAST + played[0], LEAST + played[1]) if played else (None, None)


def _table(
    view: View[TravelersDilemma],
    canvas: Canvas,
    y: int,
    look: Look,
    claims: tuple[Sequence[int | None], Sequence[int | None]],
) -> int:
    """The table of these claims from row y on, `…` where it goes on; the row after it."""
    mine, theirs = _claims(view)
    rows, columns = claims
    widths = [CELL if claim else MORE for claim in columns]
    heads = [
        (str(claim), "bold" * (claim == theirs)) if claim else ("…", "dim") for claim in columns
    ]
    _line(canvas, y, widths, heads)
    canvas.put(0, y + 1, "─" * STUB + "".join("┼" + "─" * wide for wide in widths), "dim")
    for below, row in enumerate(rows, y + 2):
        stub, style = f"{row:>4}" if row else "…".rjust(STUB - 1), "" if row else "dim"
        if row and row == mine:
            stub, style = f">{row:>3}", "bold"
        canvas.put(0, below, stub, style)
        _line(canvas, below, widths, [_pay(view, look, row, claim) for claim in columns])
    return y + 2 + len(rows)


def _around(claim: int | None, many: int) -> range:
    """So many claims round one, the highest if none is made."""
    first = min(max((claim or MOST) - many // 2, LEAST), MOST + 1 - many)
    return range(first, first + many)


def _span(claim: int | None, many: int) -> list[int | None]:
    """So many claims round one; None where the table goes on."""
    around = _around(claim, many)
    return [*[None] * (around[0] > LEAST), *around, *[None] * (around[-1] < MOST)]


def _line(canvas: Canvas, y: int, widths: list[int], cells: list[tuple[str, str]]) -> None:
    """A row of the table right of its first column: texts and their styles."""
    x = STUB
    for wide, (text, style) in zip(widths, cells, strict=True):
        canvas.put(x, y, "│", "dim")
        canvas.put(x + 1, y, text.center(wide), style)
        x += wide + 1


def _pay(
    view: View[TravelersDilemma], look: Look, mine: int | None, theirs: int | None
) -> tuple[str, str]:
    """What two claims pay, and its style: bold in brackets where they are the last."""
    if mine is None or theirs is None:
        return "", ""
    chosen = (mine - LEAST, theirs - LEAST)
    first, second = view.problem.payoffs[chosen]
    if chosen == last(view):
        return f"[{first:g},{second:g}]", "bold reverse"
    tried = look.outlook is not None and chosen[view.seat] == int(look.outlook.action)
    return f"{first:g}, {second:g}", "bold yellow" if tried else ""


def situation(view: View[TravelersDilemma]) -> str:
    """The rule, as the table is too long to be told."""
    you = [f"you are {view.problem.agents[view.seat]}."] if view.you == "you" else []
    before = [f"last round: {told(view)}"] if view.turn else []
    sentences = [
        *you,
        *before,
        f"claim {LEAST} to {MOST} whole dollars.",
        "equal claims are paid as they are.",
        f"else both are paid the lower claim, its author {BONUS} more and the other {BONUS} less.",
    ]
    return " ".join(sentences)


__all__ = ["KEYS", "NUDGES", "boards", "panel", "situation", "told"]
