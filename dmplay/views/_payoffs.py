"""Payoff matrices as tables and words: rows are agent 1's actions."""

from collections.abc import Iterator
from itertools import product

from rich.text import Text

from dmplay.matrix_game import MatrixGame
from dmplay.session import View
from dmplay.views._advice import (
    format_regret_rows,
    format_regret_with_bar,
    iter_with_and_without_rows,
)
from dmplay.views.canvas import Canvas
from dmplay.views.style import DrawOptions

INITIAL_COLUMNS = 2  # columns of an action's first letter in the rounds
CELL_COLUMNS, ROW_LABEL_COLUMNS = 15, 12  # columns: of a large cell, before it
PAID_ROUND_COLUMNS = 5  # columns of a round where it stands with its pay
REGRET_BAR_COLUMNS = 4  # columns of a bar of what an action loses


def get_last_joint_action(view: View[MatrixGame]) -> tuple[int, int] | None:
    """Both actions of the last round."""
    return (
        (int(view.joint_actions[-1][0]), int(view.joint_actions[-1][1]))
        if view.joint_actions
        else None
    )


def iter_boards(view: View[MatrixGame], options: DrawOptions) -> Iterator[Text]:
    """A table that names who chooses and who gets what, with the rounds; then smaller tables."""
    if options.allow_large:
        yield _draw_large_board(view, options)
    names = view.problem.actions[view.seat]
    yield from iter_with_and_without_rows(
        _iter_small_boards(view, options),
        [*format_regret_rows(options, names), *_format_reply_payoffs(view, options)],
        options,
    )


def _iter_small_boards(view: View[MatrixGame], options: DrawOptions) -> Iterator[Text]:
    """The table with the last play in brackets, and the rounds so far; then the table alone."""
    for width in (10, 8, 6):
        for history in (True, False):
            canvas = Canvas()
            bottom = _draw_payoff_table(view, canvas, width)
            canvas.write_text(0, 0, f"{list_agent_names(view)[0]} ↓" * options.allow_large, "dim")
            if history:
                draw_rounds(view, canvas, bottom + 1, options.width, round_columns=INITIAL_COLUMNS)
            yield canvas.to_text()


def _draw_large_board(view: View[MatrixGame], options: DrawOptions) -> Text:
    """The table that names who gets what, the rounds, and what the action in question pays."""
    canvas = Canvas()
    y = draw_paid_rounds(view, canvas, _draw_named_table(view, canvas, options) + 1, options.width)
    for row, told_ in enumerate(_format_reply_payoffs(view, options), y):
        canvas.write_text(0, row, told_)
    return canvas.to_text()


def _draw_named_table(view: View[MatrixGame], canvas: Canvas, options: DrawOptions) -> int:
    """The table with both payoffs of a cell by name; the row after it."""
    problem, played = view.problem, get_last_joint_action(view)
    rows, columns = problem.actions
    down, across = list_marked_agent_names(view)
    canvas.write_text(0, 0, down)
    canvas.write_text(0, 1, "chooses", "dim")
    canvas.write_text(ROW_LABEL_COLUMNS + 2, 0, f"{across} chooses")
    marks = [
        format_regret_with_bar(options, action, REGRET_BAR_COLUMNS)
        for action in range(len(problem.actions[view.seat]))
    ]
    for j, name in enumerate(columns):
        x = ROW_LABEL_COLUMNS + (CELL_COLUMNS + 1) * j
        chosen = played is not None and played[1] == j
        _draw_action_label(canvas, x + 1, 1, name, is_last_choice=chosen)
        canvas.write_text(x + 3, 2, marks[j] if view.seat else "", "yellow")
    y = 3 if view.seat and options.regret is not None else 2
    lines = [*range(1, y), *(y + row for row in range(3 * len(rows)) if row % 3)]
    for i, name in enumerate(rows):
        canvas.write_text(
            0, y, "─" * ROW_LABEL_COLUMNS + ("┼" + "─" * CELL_COLUMNS) * len(columns), "dim"
        )
        chosen = played is not None and played[0] == i
        _draw_action_label(canvas, 0, y + 1, name, is_last_choice=chosen)
        canvas.write_text(2, y + 2, "" if view.seat else marks[i], "yellow")
        for j in range(len(columns)):
            _draw_payoff_cell(view, canvas, (i, j), y + 1, options)
        y += 3
    for row, j in product(lines, range(len(columns))):
        canvas.write_text(ROW_LABEL_COLUMNS + (CELL_COLUMNS + 1) * j, row, "│", "dim")
    return y


def _draw_action_label(canvas: Canvas, x: int, y: int, name: str, *, is_last_choice: bool) -> None:
    """An action at the edge of the table, with a mark where it was the last choice."""
    canvas.write_text(x, y, ">" if is_last_choice else " ", "bold")
    canvas.write_text(x + 2, y, name)


def list_marked_agent_names(view: View[MatrixGame]) -> list[str]:
    """Both agents by name, and which of them the seat is."""
    you = {view.seat: " (you)"} if view.player_label == "you" else {}
    return [name + you.get(seat, "") for seat, name in enumerate(view.problem.agents)]


def list_agent_names(view: View[MatrixGame]) -> list[str]:
    """Both agents, as the seat calls them."""
    agents = enumerate(view.problem.agents)
    return [view.player_label if seat == view.seat else name for seat, name in agents]


def _draw_payoff_cell(
    view: View[MatrixGame],
    canvas: Canvas,
    joint_action: tuple[int, int],
    y: int,
    options: DrawOptions,
) -> None:
    """What a pair of actions pays each: in brackets where it was the last play."""
    here = joint_action == get_last_joint_action(view)
    tried = options.forecast is not None and joint_action[view.seat] == int(options.forecast.action)
    x = ROW_LABEL_COLUMNS + (CELL_COLUMNS + 1) * joint_action[1] + 1
    pays = zip(list_agent_names(view), view.problem.payoffs[joint_action], strict=True)
    for row, (name, pay) in enumerate(pays):
        style = "bold reverse" if here else "bold yellow" if tried else ""
        told_ = f"{name:<{CELL_COLUMNS - 9}} {pay:>4g}"
        canvas.write_text(x + 1, y + row, f"[{told_}]" if here else f" {told_} ", style)


def abbreviate_action(action: str) -> str:
    """What stands for an action in the rounds: a number, or its first letter."""
    return action if action.isdigit() else action[0].upper()


def _format_reply_payoffs(view: View[MatrixGame], options: DrawOptions) -> list[str]:
    """What each reply pays for the action in question."""
    if options.forecast is None:
        return []
    problem, seat, mine = view.problem, view.seat, int(options.forecast.action)
    paid = problem.payoffs[mine, :, 0] if seat == 0 else problem.payoffs[:, mine, 1]
    replies = zip(paid, problem.actions[1 - seat], strict=True)
    first, *others = (f"{pay:g} {reply}" for pay, reply in replies)
    told_ = ", ".join([first.replace(" ", " against ", 1), *others])
    return [f"if {problem.format_action(seat, mine)}: {told_}"]


def draw_paid_rounds(view: View[MatrixGame], canvas: Canvas, y: int, width: int) -> int:
    """Who did what and what it paid, so many columns a round, and the sums; the row after it.

    The rounds move to the left by several at a time: most of them only add a column.
    """
    problem = view.problem
    joints = [(int(first), int(second)) for first, second in view.joint_actions or ()]
    room = max((width - ROW_LABEL_COLUMNS) // PAID_ROUND_COLUMNS, 1)
    step, past = max(room // 3, 1), max(len(joints) - room, 0)
    kept = joints[-(-past // step) * step :]
    for seat, name in enumerate(list_agent_names(view)):
        total = sum(float(problem.payoffs[joint][seat]) for joint in joints)
        canvas.write_text(0, y + 2 * seat, name)
        canvas.write_text(0, y + 2 * seat + 1, f"total {total:g}", "dim")
        did = [abbreviate_action(problem.actions[seat][joint[seat]]) for joint in kept]
        got = [f"{problem.payoffs[joint][seat]:g}" for joint in kept]
        canvas.write_text(
            ROW_LABEL_COLUMNS, y + 2 * seat, "".join(word.rjust(PAID_ROUND_COLUMNS) for word in did)
        )
        canvas.write_text(
            ROW_LABEL_COLUMNS,
            y + 2 * seat + 1,
            "".join(pay.rjust(PAID_ROUND_COLUMNS) for pay in got),
        )
    return y + 4


def _draw_payoff_table(view: View[MatrixGame], canvas: Canvas, width: int) -> int:
    """The table, the last play in brackets; the row after it."""
    problem = view.problem
    rows, columns = problem.actions
    played = get_last_joint_action(view)
    stub = max(max(map(len, rows)) + 1, width)
    for j, name in enumerate(columns):
        x = stub + j * (width + 1)
        canvas.write_text(x, 0, "│", "dim")
        chosen = played is not None and played[1] == j
        canvas.write_text(x + 1, 0, name[:width].center(width), "bold" if chosen else "")
    canvas.write_text(0, 1, "─" * stub + ("┼" + "─" * width) * len(columns), "dim")
    for i, name in enumerate(rows):
        mark = ">" if played and played[0] == i else " "
        canvas.write_text(0, i + 2, mark + name, "bold" if mark == ">" else "")
        for j in range(len(columns)):
            x = stub + j * (width + 1)
            pay = "{:g}, {:g}".format(*problem.payoffs[i, j])
            here = played == (i, j)
            canvas.write_text(x, i + 2, "│", "dim")
            shown = f"[{pay}]" if here else pay
            if len(shown) > width:
                shown = shown.replace(", ", ",")
            canvas.write_text(x + 1, i + 2, shown.center(width), "bold reverse" if here else "")
    return len(rows) + 2


def draw_rounds(  # noqa: PLR0913 - a place on the canvas, and what goes there
    view: View[MatrixGame],
    canvas: Canvas,
    y: int,
    width: int,
    *,
    round_columns: int,
    empty_text: str = "",
) -> None:
    """Who did what, a row an agent and so many columns a round, the last rounds at the end."""
    problem = view.problem
    stub = max(map(len, problem.agents)) + 7
    joints = (view.joint_actions or ())[-max((width - stub) // round_columns, 1) :]
    for seat, agent in enumerate(list_marked_agent_names(view)):
        canvas.write_text(0, y + seat, agent)
        words = [problem.actions[seat][int(joint[seat])].upper() for joint in joints] or [
            empty_text
        ]
        row = "".join(word[: round_columns - 1].rjust(round_columns) for word in words)
        canvas.write_text(stub - 1, y + seat, row, "bold")


def panel_rows(view: View[MatrixGame]) -> list[tuple[str, str]]:
    """What the board does not tell."""
    return [("discount", f"{view.problem.discount:g}")]


def describe_turn(view: View[MatrixGame]) -> str:
    """Who chose what."""
    problem = view.problem
    played = get_last_joint_action(view)
    assert played
    both = zip(problem.agents, problem.actions, played, strict=True)
    return ". ".join(f"{agent} chose {names[action]}" for agent, names, action in both) + "."


def describe_situation(view: View[MatrixGame]) -> str:
    """One sentence a cell, and the last round."""
    problem = view.problem
    rows, columns = problem.actions
    cells = [
        f"{mine} against {theirs}: {problem.payoffs[i, j, 0]:g} to {problem.agents[0]}, "
        f"{problem.payoffs[i, j, 1]:g} to {problem.agents[1]}."
        for i, mine in enumerate(rows)
        for j, theirs in enumerate(columns)
    ]
    before = [f"last round: {describe_turn(view)}"] if view.turns_played else []
    you = [f"you are {problem.agents[view.seat]}."] if view.player_label == "you" else []
    return " ".join([*you, *before, *cells])
