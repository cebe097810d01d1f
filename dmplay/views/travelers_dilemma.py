"""How the traveler's dilemma looks: the corner of the table round both claims, and the rounds."""

from collections.abc import Iterator, Sequence

import numpy as np
from rich.text import Text

from dmplay.problems.travelers_dilemma import BONUS_DOLLARS, MAX_CLAIM, MIN_CLAIM, TravelersDilemma
from dmplay.session import View
from dmplay.views._advice import (
    MAX_NUMBER_COLUMNS,
    format_action_condition,
    format_regret_rows,
    format_significant,
    iter_with_and_without_rows,
)
from dmplay.views._belief import format_sparkline
from dmplay.views._payoffs import (
    describe_turn,
    draw_paid_rounds,
    draw_rounds,
    get_last_joint_action,
    list_agent_names,
    list_marked_agent_names,
    panel_rows,
)
from dmplay.views._scale import NumberLine
from dmplay.views.canvas import Canvas
from dmplay.views.style import DrawOptions, Lesson

KEYS: dict[str, str] = {}  # a claim is typed
NUMBER_STEPS = {"up": 1, "down": -1, "pageup": 10, "pagedown": -10}  # what a key adds to the claim
ROW_LABEL_COLUMNS, CELL_COLUMNS, ELLIPSIS_COLUMNS = (
    5,
    8,
    3,
)  # columns: before the table, of a cell, of an edge where it goes on
CLAIM_COLUMNS = 4  # columns of a claim in the rounds
LARGE_LAYOUTS = (
    (6, True),
    (5, True),
    (4, True),
    (6, False),
    (4, False),
)  # claims; with the rounds or not
CLAIM_LINE = NumberLine(MIN_CLAIM, MAX_CLAIM, 2, 55)  # of all claims


def goal_lines(view: View[TravelersDilemma]) -> list[str]:
    """What both are paid."""
    return [
        "both are paid the lower claim",
        f"its author {BONUS_DOLLARS:g} more, the other {BONUS_DOLLARS:g} less",
        f"claim {MIN_CLAIM} to {MAX_CLAIM}",
    ]


def lesson(view: View[TravelersDilemma]) -> Lesson:
    """Who claims, and what two claims pay."""
    you, other = (view.problem.agents[seat] for seat in (view.seat, 1 - view.seat))
    return Lesson(
        f"You are {you} and claim {MIN_CLAIM} to {MAX_CLAIM} dollars at the same time as {other}",
        "You want to be paid much: a high claim, but one below the other's",
        f"Both are paid the lower claim; who made it {BONUS_DOLLARS:g} more, the other {BONUS_DOLLARS:g} less; "
        "equal claims are paid as they are",
        "50",
    )


def iter_boards(view: View[TravelersDilemma], options: DrawOptions) -> Iterator[Text]:
    """A table over a line of claims with the rounds or without; smaller tables; the rounds."""
    for many, history in LARGE_LAYOUTS if options.allow_large else ():
        yield _draw_large_board(view, options, many, history)
    notes = format_regret_rows(options, view.problem.actions[view.seat])
    if options.allow_large:
        tables = (_draw_claim_window(view, options, many)[0].to_text() for many in (4, 3))
        yield from iter_with_and_without_rows(
            tables,
            [*notes, *(_format_reply_payoffs(view, options) or [_format_last_payment(view)])],
            options,
        )
    yield from iter_with_and_without_rows(
        _iter_small_boards(view, options), [*notes, *_format_reply_payoffs(view, options)], options
    )


def _iter_small_boards(view: View[TravelersDilemma], options: DrawOptions) -> Iterator[Text]:
    """Five claims by five, three by three, each with the rounds or without; the rounds alone."""
    mine, theirs = _get_last_claims(view)
    for many, history in ((5, True), (5, False), (3, True), (3, False)):
        canvas = Canvas()
        y = _draw_claim_table(
            view,
            canvas,
            0,
            options,
            (_list_claim_window(mine, many), _list_claim_window(theirs, many)),
        )
        if history:
            draw_rounds(
                view, canvas, y + 1, options.width, round_columns=CLAIM_COLUMNS, empty_text="-"
            )
        yield canvas.to_text()
    canvas = Canvas()
    draw_rounds(view, canvas, 0, options.width, round_columns=CLAIM_COLUMNS, empty_text="-")
    canvas.write_text(0, 2, "both are paid the lower claim,", "dim")
    canvas.write_text(
        0, 3, f"its author {BONUS_DOLLARS} more, the other {BONUS_DOLLARS} less", "dim"
    )
    yield canvas.to_text()


def _draw_large_board(
    view: View[TravelersDilemma], options: DrawOptions, claim_count: int, with_rounds: bool
) -> Text:
    """The table with its axes by name, both claims on a line, what claims lose, the rounds."""
    canvas, y = _draw_claim_window(view, options, claim_count)
    canvas.write_text(0, 0, f"{_format_axis_labels(view)}   cells pay agent1, agent2", "dim")
    y = _draw_claim_line(view, canvas, y + 1)
    y = _draw_claim_regrets(canvas, y, options)
    if with_rounds:
        y = draw_paid_rounds(view, canvas, y + 1, options.width)
    for row, told_ in enumerate(_format_reply_payoffs(view, options), y):
        canvas.write_text(0, row, told_)
    return canvas.to_text()


def _format_axis_labels(view: View[TravelersDilemma]) -> str:
    """Whose claims go down, and whose across."""
    down, across = list_marked_agent_names(view)
    return f"{down} ↓   {across} →"


def _draw_claim_window(
    view: View[TravelersDilemma], options: DrawOptions, claim_count: int
) -> tuple[Canvas, int]:
    """The table round both last claims, or round the one in question; the row after it."""
    canvas, around = Canvas(), [*_get_last_claims(view)]
    canvas.write_text(0, 0, _format_axis_labels(view), "dim")
    if options.forecast is not None:
        around[view.seat] = MIN_CLAIM + int(options.forecast.action)
    rows, columns = ([*_choose_claim_range(claim, claim_count)] for claim in around)
    return canvas, _draw_claim_table(view, canvas, 1, options, (rows, columns))


def _format_last_payment(view: View[TravelersDilemma]) -> str:
    """Both claims of the last round, and what they were paid."""
    played = get_last_joint_action(view)
    if played is None:
        return "no claims yet"
    pays = zip(list_agent_names(view), played, view.problem.payoffs[played], strict=True)
    return "; ".join(f"{name} {MIN_CLAIM + claim}, paid {pay:g}" for name, claim, pay in pays)


def _draw_claim_line(view: View[TravelersDilemma], canvas: Canvas, y: int) -> int:
    """All claims on a line, with both of the last round and what they were paid; the row after."""
    canvas.write_text(
        0,
        y + 1,
        f"{MIN_CLAIM} ├{'─' * (CLAIM_LINE.right - CLAIM_LINE.left - 1)}┤ {MAX_CLAIM}",
        "dim",
    )
    played = get_last_joint_action(view)
    if played is None:
        canvas.write_text(CLAIM_LINE.left, y, "no claims yet", "dim")
        return y + 3
    glyphs = {view.seat: ("●", "bold cyan", y), 1 - view.seat: ("○", "bold magenta", y + 2)}
    for seat in (1 - view.seat, view.seat):
        glyph, style, row = glyphs[seat]
        claim = MIN_CLAIM + played[seat]
        told_ = (
            f"{list_agent_names(view)[seat]} {claim}, paid {view.problem.payoffs[played][seat]:g}"
        )
        column = CLAIM_LINE.column_of(claim)
        canvas.write_text(column, y + 1, glyph, style)
        canvas.write_text(min(column, CLAIM_LINE.right + 5 - len(told_)), row, told_, style)
    return y + 3


def _draw_claim_regrets(canvas: Canvas, y: int, options: DrawOptions) -> int:
    """What each claim loses against the best, in columns under the line; the row after them."""
    if options.regret is None:
        return y
    best, most = int(np.argmin(options.regret)), float(options.regret.max())
    columns = range(CLAIM_LINE.left, CLAIM_LINE.right + 1)
    each = [
        options.regret[round(CLAIM_LINE.value_at(column)) - MIN_CLAIM] / (most or 1.0)
        for column in columns
    ]
    canvas.write_text(CLAIM_LINE.left, y, format_sparkline(each, options.ascii), "yellow")
    canvas.write_text(CLAIM_LINE.column_of(MIN_CLAIM + best), y, "●", "bold")
    canvas.write_text(
        0,
        y + 1,
        f"● best {MIN_CLAIM + best}; the worst {format_significant(-most, MAX_NUMBER_COLUMNS)}",
        "yellow",
    )
    return y + 2


def _format_reply_payoffs(view: View[TravelersDilemma], options: DrawOptions) -> list[str]:
    """What each kind of reply pays for the claim in question."""
    if options.forecast is None:
        return []
    claim = MIN_CLAIM + int(options.forecast.action)
    return [
        f"{format_action_condition(view, options.forecast, 'claim {}')}: "
        f"if equal {claim}, lower {claim + BONUS_DOLLARS}, higher theirs less {BONUS_DOLLARS}"
    ]


def _get_last_claims(view: View[TravelersDilemma]) -> tuple[int | None, int | None]:
    """Both claims of the last round."""
    played = get_last_joint_action(view)
    return (MIN_CLAIM + played[0], MIN_CLAIM + played[1]) if played else (None, None)


def _draw_claim_table(
    view: View[TravelersDilemma],
    canvas: Canvas,
    y: int,
    options: DrawOptions,
    claims: tuple[Sequence[int | None], Sequence[int | None]],
) -> int:
    """The table of these claims from row y on, `…` where it goes on; the row after it."""
    mine, theirs = _get_last_claims(view)
    rows, columns = claims
    widths = [CELL_COLUMNS if claim else ELLIPSIS_COLUMNS for claim in columns]
    heads = [
        (str(claim), "bold" * (claim == theirs)) if claim else ("…", "dim") for claim in columns
    ]
    _draw_table_row(canvas, y, widths, heads)
    canvas.write_text(
        0, y + 1, "─" * ROW_LABEL_COLUMNS + "".join("┼" + "─" * wide for wide in widths), "dim"
    )
    for below, row in enumerate(rows, y + 2):
        stub, style = f"{row:>4}" if row else "…".rjust(ROW_LABEL_COLUMNS - 1), "" if row else "dim"
        if row and row == mine:
            stub, style = f">{row:>3}", "bold"
        canvas.write_text(0, below, stub, style)
        _draw_table_row(
            canvas,
            below,
            widths,
            [_format_payoff_cell(view, options, row, claim) for claim in columns],
        )
    return y + 2 + len(rows)


def _choose_claim_range(claim: int | None, claim_count: int) -> range:
    """So many claims round one, the highest if none is made."""
    first = min(
        max((claim or MAX_CLAIM) - claim_count // 2, MIN_CLAIM), MAX_CLAIM + 1 - claim_count
    )
    return range(first, first + claim_count)


def _list_claim_window(claim: int | None, claim_count: int) -> list[int | None]:
    """So many claims round one; None where the table goes on."""
    around = _choose_claim_range(claim, claim_count)
    return [*[None] * (around[0] > MIN_CLAIM), *around, *[None] * (around[-1] < MAX_CLAIM)]


def _draw_table_row(
    canvas: Canvas, y: int, widths: list[int], cells: list[tuple[str, str]]
) -> None:
    """A row of the table right of its first column: texts and their styles."""
    x = ROW_LABEL_COLUMNS
    for wide, (text, style) in zip(widths, cells, strict=True):
        canvas.write_text(x, y, "│", "dim")
        canvas.write_text(x + 1, y, text.center(wide), style)
        x += wide + 1


def _format_payoff_cell(
    view: View[TravelersDilemma],
    options: DrawOptions,
    row_claim: int | None,
    column_claim: int | None,
) -> tuple[str, str]:
    """What two claims pay, and its style: bold in brackets where they are the last."""
    if row_claim is None or column_claim is None:
        return "", ""
    chosen = (row_claim - MIN_CLAIM, column_claim - MIN_CLAIM)
    first, second = view.problem.payoffs[chosen]
    if chosen == get_last_joint_action(view):
        return f"[{first:g},{second:g}]", "bold reverse"
    tried = options.forecast is not None and chosen[view.seat] == int(options.forecast.action)
    return f"{first:g}, {second:g}", "bold yellow" if tried else ""


def describe_situation(view: View[TravelersDilemma]) -> str:
    """The rule, as the table is too long to be told."""
    you = [f"you are {view.problem.agents[view.seat]}."] if view.player_label == "you" else []
    before = [f"last round: {describe_turn(view)}"] if view.turns_played else []
    sentences = [
        *you,
        *before,
        f"claim {MIN_CLAIM} to {MAX_CLAIM} whole dollars.",
        "equal claims are paid as they are.",
        f"else both are paid the lower claim, its author {BONUS_DOLLARS} more and the other {BONUS_DOLLARS} less.",
    ]
    return " ".join(sentences)


__all__ = [
    "KEYS",
    "NUMBER_STEPS",
    "describe_situation",
    "describe_turn",
    "iter_boards",
    "panel_rows",
]
