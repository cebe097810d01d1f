"""The view of the traveler's dilemma: the payoffs around both last claims, and the rounds."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from rich.text import Text

from dmplay.core.session import View
from dmplay.core.text import format_count
from dmplay.draw import payoff_table, theme
from dmplay.draw.action_hints import (
    MAX_NUMBER_COLUMNS,
    format_action_condition,
    format_regret_rows,
    format_significant,
    iter_with_and_without_rows,
)
from dmplay.draw.bars import format_sparkline
from dmplay.draw.canvas import Canvas
from dmplay.draw.number_line import NumberLine
from dmplay.draw.options import DrawOptions
from dmplay.draw.payoff_table import (
    describe_role_and_last_round,
    draw_paid_rounds,
    draw_rounds,
    get_last_joint_action,
    list_agent_names,
    list_marked_agent_names,
)
from dmplay.views.protocol import FinishedGame, Lesson

from .rules import BONUS_DOLLARS, MAX_CLAIM, MIN_CLAIM, TravelersDilemma

panel_rows, describe_turn = payoff_table.panel_rows, payoff_table.describe_turn
KEYS: dict[str, str] = {}  # claims are typed
# amount that each key adds to the claim
NUMBER_NAME = "claim"
NUMBER_STEPS = {"up": 1, "down": -1, "pageup": 10, "pagedown": -10}
# columns of a row's label, of a cell, and of an ellipsis
ROW_LABEL_COLUMNS, CELL_COLUMNS, ELLIPSIS_COLUMNS = 5, 8, 3
CLAIM_COLUMNS = 4  # columns of a claim in the list of rounds
# number of claims; whether with the rounds
LARGE_LAYOUTS = ((15, True), (11, True), (6, True), (5, True), (4, True), (6, False), (4, False))
MIN_LINE_CLAIM_COUNT = 6  # number of claims in the table below which the line stays as long


def goal_lines(view: View[TravelersDilemma]) -> list[str]:
    """Return the goal, the payment rule, the story, an example and the range of claims."""
    low, high = MAX_CLAIM - 2 * BONUS_DOLLARS, MAX_CLAIM
    other = view.problem.agents[1 - view.seat]
    return [
        "get much for a lost bag",
        f"both get the lower claim; who claimed it gets {BONUS_DOLLARS:g} more, the other "
        f"{BONUS_DOLLARS:g} less",
        f"{other} lost an equal bag and claims at the same time",
        f"what {other} gets does not count",
        f"for example, claims {low:g} and {high:g} pay {low + BONUS_DOLLARS:g} and "
        f"{low - BONUS_DOLLARS:g}",
        f"claim {MIN_CLAIM} to {MAX_CLAIM}",
    ]


def lesson(view: View[TravelersDilemma]) -> Lesson:
    """Return the three sentences that introduce the problem: role, objective and payments."""
    you, other = (view.problem.agents[seat] for seat in (view.seat, 1 - view.seat))
    return Lesson(
        f"You are {you} and claim {MIN_CLAIM} to {MAX_CLAIM} whole dollars, at the same time as "
        f"{other}",
        f"You want as many dollars as you can get, whatever {other} gets",
        f"Both get the lower claim; the lower claimant gets {BONUS_DOLLARS:g} more and the higher "
        f"{BONUS_DOLLARS:g} less; if the claims are equal, each gets its claim",
        "50",
    )


def iter_boards(view: View[TravelersDilemma], options: DrawOptions) -> Iterator[Text]:
    """Yield the boards, the largest first: tables, with and without rounds, then the rounds."""
    for claim_count, with_rounds in LARGE_LAYOUTS if options.allow_large else ():
        yield _draw_large_board(view, options, claim_count, with_rounds)
    hint_rows = format_regret_rows(options, view.problem.actions[view.seat])
    reply_rows = _format_reply_payoffs(view, options)
    if options.allow_large:
        tables = (_draw_claim_window(view, options, count)[0].to_text() for count in (4, 3))
        rows = [*hint_rows, *(reply_rows or [_format_last_payment(view)])]
        yield from iter_with_and_without_rows(tables, rows, options)
    boards = _iter_small_boards(view, options)
    yield from iter_with_and_without_rows(boards, [*hint_rows, *reply_rows], options)


def _iter_small_boards(view: View[TravelersDilemma], options: DrawOptions) -> Iterator[Text]:
    """Yield tables of five and three claims, with and without the rounds, then the rounds."""
    draw_last_rounds = partial(
        draw_rounds, view, width=options.width, round_columns=CLAIM_COLUMNS, empty_text="-"
    )
    for claim_count, with_rounds in ((5, True), (5, False), (3, True), (3, False)):
        canvas = Canvas()
        rows, columns = map(_mark_omitted_claims, _choose_windows(view, options, claim_count))
        y = _draw_claim_table(view, canvas, 0, options, (rows, columns))
        if with_rounds:
            draw_last_rounds(canvas, y + 1)
        yield canvas.to_text()
    canvas = Canvas()
    draw_last_rounds(canvas, 0)
    canvas.write_text(0, 2, "both get the lower claim,", "dim")
    canvas.write_text(0, 3, f"lower claim +{BONUS_DOLLARS}, higher claim -{BONUS_DOLLARS}", "dim")
    yield canvas.to_text()


def _draw_large_board(
    view: View[TravelersDilemma], options: DrawOptions, claim_count: int, with_rounds: bool
) -> Text:
    """Return the large board: the table, both claims on a line, the regrets and the rounds."""
    canvas, y = _draw_claim_window(view, options, claim_count)
    canvas.write_text(0, 0, f"{_format_axis_labels(view)}   cells: pay to agent1, agent2", "dim")
    line_columns = (CELL_COLUMNS + 1) * max(claim_count, MIN_LINE_CLAIM_COUNT)
    line = NumberLine(MIN_CLAIM, MAX_CLAIM, 2, 1 + line_columns)
    y = _draw_claim_line(view, canvas, y + 1, line)
    y = _draw_claim_regrets(canvas, y, options, line)
    if with_rounds:
        y = draw_paid_rounds(view, canvas, y + 1, options.width)
    canvas.write_rows(y, _format_reply_payoffs(view, options))
    return canvas.to_text()


def _format_axis_labels(view: View[TravelersDilemma]) -> str:
    """Return the labels of the table's axes: the agents whose claims are rows and columns."""
    down, across = list_marked_agent_names(view)
    return f"{down} ↓   {across} →"


def _draw_claim_window(
    view: View[TravelersDilemma], options: DrawOptions, claim_count: int
) -> tuple[Canvas, int]:
    """Draw the table that has both last claims; return the canvas and the next free row."""
    canvas, windows = Canvas(), _choose_windows(view, options, claim_count)
    canvas.write_text(0, 0, _format_axis_labels(view), "dim")
    return canvas, _draw_claim_table(view, canvas, 1, options, windows)


def _format_last_payment(view: View[TravelersDilemma]) -> str:
    """Return both claims of the last round and their payments as text, or `no claims yet`."""
    joint_action = get_last_joint_action(view)
    if joint_action is None:
        return "no claims yet"
    return "; ".join(_format_claim(view, joint_action, seat) for seat in range(2))


def _format_claim(view: View[TravelersDilemma], joint_action: tuple[int, int], seat: int) -> str:
    """Return an agent's claim and its payment as text: `you claimed 99, got 97`."""
    claim, pay = MIN_CLAIM + joint_action[seat], view.problem.payoffs[joint_action][seat]
    return f"{list_agent_names(view)[seat]} claimed {claim}, got {pay:g}"


def _draw_claim_line(view: View[TravelersDilemma], canvas: Canvas, y: int, line: NumberLine) -> int:
    """Draw both last claims and their payments on a line of claims; return the next free row."""
    dashes = "─" * (line.right - line.left - 1)
    canvas.write_text(0, y + 1, f"{MIN_CLAIM} ├{dashes}┤ {MAX_CLAIM}", "dim")
    joint_action = get_last_joint_action(view)
    if joint_action is None:
        canvas.write_text(line.left, y, "no claims yet", "dim")
        return y + 3
    glyphs = {view.seat: ("●", theme.STRONG_DATA, y), 1 - view.seat: ("○", theme.OTHER, y + 2)}
    for seat in (1 - view.seat, view.seat):
        glyph, style, row = glyphs[seat]
        label = _format_claim(view, joint_action, seat)
        column = line.column_of(MIN_CLAIM + joint_action[seat])
        canvas.write_text(column, y + 1, glyph, style)
        canvas.write_text(min(column, line.right + 5 - len(label)), row, label, style)
    return y + 3


def _draw_claim_regrets(canvas: Canvas, y: int, options: DrawOptions, line: NumberLine) -> int:
    """Draw the regret of each claim under the line of claims; return the next free row."""
    if options.regret is None:
        return y
    best, largest = int(np.argmin(options.regret)), float(options.regret.max())
    claims = [round(line.value_at(column)) for column in range(line.left, line.right + 1)]
    fractions = [options.regret[claim - MIN_CLAIM] / (largest or 1.0) for claim in claims]
    canvas.write_text(line.left, y, format_sparkline(fractions, options.ascii), theme.REGRET)
    canvas.write_text(line.column_of(MIN_CLAIM + best), y, "●", "bold")
    tallest = format_significant(largest, MAX_NUMBER_COLUMNS)
    legend = f"● best claim {MIN_CLAIM + best}; bars: value lost by each claim; tallest {tallest}"
    canvas.write_text(0, y + 1, legend, theme.REGRET)
    return y + 2


def _format_reply_payoffs(view: View[TravelersDilemma], options: DrawOptions) -> list[str]:
    """Return a row with the payoffs of the forecast claim against each kind of reply.

    A reply is equal, lower or higher. The list is empty without a forecast.
    """
    if options.forecast is None:
        return []
    claim = MIN_CLAIM + int(options.forecast.action)
    return [
        f"{format_action_condition(view, options.forecast, 'claim {}')}, "
        f"you get {claim} if equal, {claim + BONUS_DOLLARS} if lower, "
        f"else the other claim - {BONUS_DOLLARS}"
    ]


def _get_last_claims(view: View[TravelersDilemma]) -> tuple[int | None, int | None]:
    """Return both claims of the last round, or (None, None) before the first round."""
    joint_action = get_last_joint_action(view)
    if joint_action is None:
        return None, None
    return MIN_CLAIM + joint_action[0], MIN_CLAIM + joint_action[1]


def _draw_claim_table(
    view: View[TravelersDilemma],
    canvas: Canvas,
    y: int,
    options: DrawOptions,
    claims: tuple[Sequence[int | None], Sequence[int | None]],
) -> int:
    """Draw the table of the given claims from row `y` on; return the next free row.

    None in `claims` stands for omitted claims, drawn as `…`.
    """
    last_row_claim, last_column_claim = _get_last_claims(view)
    rows, columns = claims
    widths = [CELL_COLUMNS if claim else ELLIPSIS_COLUMNS for claim in columns]
    headings = [(str(x), "bold" * (x == last_column_claim)) if x else ("…", "dim") for x in columns]
    _draw_table_row(canvas, y, widths, headings)
    line = "─" * ROW_LABEL_COLUMNS + "".join("┼" + "─" * width for width in widths)
    canvas.write_text(0, y + 1, line, "dim")
    for canvas_row, row in enumerate(rows, y + 2):
        row_label = f"{row:>4}" if row else "…".rjust(ROW_LABEL_COLUMNS - 1)
        style = "" if row else "dim"
        if row and row == last_row_claim:
            row_label, style = f">{row:>3}", "bold"
        canvas.write_text(0, canvas_row, row_label, style)
        cells = [_format_payoff_cell(view, options, (row, claim)) for claim in columns]
        _draw_table_row(canvas, canvas_row, widths, cells)
    return y + 2 + len(rows)


def _choose_windows(
    view: View[TravelersDilemma], options: DrawOptions, claim_count: int
) -> tuple[range, range]:
    """Return the claims of the table's rows and of its columns, `claim_count` of each.

    They begin with the highest ones, and move only as far as the last claims require, so that the
    table stays in place from round to round. The own ones also contain the claim of a forecast,
    or else of a hint.
    """
    windows = [range(MAX_CLAIM + 1 - claim_count, MAX_CLAIM + 1)] * 2
    for joint_action in view.joint_actions or ():
        claims = [MIN_CLAIM + int(action) for action in joint_action]
        windows = [*map(_move_window, windows, claims)]
    if options.forecast is not None:
        claim = MIN_CLAIM + int(options.forecast.action)
        windows[view.seat] = _move_window(windows[view.seat], claim)
    elif options.regret is not None:
        claim = MIN_CLAIM + int(np.argmin(options.regret))
        windows[view.seat] = _move_window(windows[view.seat], claim)
    return windows[0], windows[1]


def _move_window(window: range, claim: int) -> range:
    """Return a range of claims moved as little as it needs to contain a claim and its neighbours.

    The neighbours are left out if the range has fewer than three claims.
    """
    margin = int(len(window) > 2)
    lowest = max(min(window.start, claim - margin), claim + margin + 1 - len(window))
    lowest = min(max(lowest, MIN_CLAIM), MAX_CLAIM + 1 - len(window))
    return range(lowest, lowest + len(window))


def _mark_omitted_claims(claims: range) -> list[int | None]:
    """Return claims, with None where further claims are omitted."""
    return [*[None] * (claims[0] > MIN_CLAIM), *claims, *[None] * (claims[-1] < MAX_CLAIM)]


def _draw_table_row(
    canvas: Canvas, y: int, widths: list[int], cells: list[tuple[str, str]]
) -> None:
    """Draw the cells of a table row, given as pairs of text and style, after its label."""
    x = ROW_LABEL_COLUMNS
    for width, (text, style) in zip(widths, cells, strict=True):
        canvas.write_text(x, y, "│", "dim")
        canvas.write_text(x + 1, y, text.center(width), style)
        x += width + 1


def _format_payoff_cell(
    view: View[TravelersDilemma], options: DrawOptions, claims: tuple[int | None, int | None]
) -> tuple[str, str]:
    """Return the payoffs of two claims as text, and the style of their cell.

    The payoffs of the last round are in brackets. Those of the forecast claim are in bold.
    """
    row_claim, column_claim = claims
    if row_claim is None or column_claim is None:
        return "", ""
    joint_action = (row_claim - MIN_CLAIM, column_claim - MIN_CLAIM)
    first, second = view.problem.payoffs[joint_action]
    if joint_action == get_last_joint_action(view):
        return f"[{first:g},{second:g}]", "bold reverse"
    forecast = options.forecast
    is_forecast = forecast is not None and joint_action[view.seat] == int(forecast.action)
    return f"{first:g}, {second:g}", theme.PREVIEW * is_forecast


def describe_situation(view: View[TravelersDilemma]) -> str:
    """Return a description of the last round and of the rules; the table is too long for words."""
    rules = (
        f"claim {MIN_CLAIM} to {MAX_CLAIM} whole dollars. if the claims are equal, each gets its "
        f"claim. else both get the lower claim, the lower claimant {BONUS_DOLLARS} more and the "
        f"higher {BONUS_DOLLARS} less."
    )
    return " ".join([*describe_role_and_last_round(view), rules])


def describe_end(game: FinishedGame[TravelersDilemma]) -> str:
    """Count the lower claims of each traveler; give both claims of a single round."""
    claims, other = game.actions, 1 - game.seat
    name = game.problem.agents[other]
    if len(claims) == 1:
        first, second = (game.problem.format_action(0, claims[0, i]) for i in (game.seat, other))
        return f"{game.player} claimed {first}, and {name} claimed {second}"
    lower, higher = ((claims[:, i] < claims[:, 1 - i]).sum() for i in (game.seat, other))
    rounds = format_count(len(claims), "round")
    return f"{game.player} had the lower claim in {lower} of {rounds}, {name} in {higher}"
