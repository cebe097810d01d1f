"""Draw and describe payoff matrices; the rows are agent 1's actions."""

from collections.abc import Iterator
from itertools import pairwise, product

from rich.text import Text

from dmplay.core.matrix_game import MatrixGame
from dmplay.core.session import View
from dmplay.core.text import format_number
from dmplay.draw import theme
from dmplay.draw.action_hints import (
    format_as_loss,
    format_regret,
    format_regret_rows,
    iter_with_and_without_rows,
)
from dmplay.draw.canvas import Canvas, format_percent
from dmplay.draw.options import DrawOptions

INITIAL_COLUMNS = 2  # columns of an action's initial in the list of rounds
# rows of a cell with the line above it; of the largest cell; below the table, with replies
REPLY_COLUMNS = 11  # columns of a count of replies
CELL_ROWS, MAX_CELL_ROWS, REPLY_ROWS = 3, 9, 24
# columns of a cell of the large table; columns before the first cell
CELL_COLUMNS, ROW_LABEL_COLUMNS = 15, 12
PAID_ROUND_COLUMNS = 5  # columns of a round that is listed with its payoff
TOTAL_COLUMNS = 14  # columns of the total after the payoffs


def get_last_joint_action(view: View[MatrixGame]) -> tuple[int, int] | None:
    """Return both actions of the last round, or None before the first."""
    if not view.joint_actions:
        return None
    first, second = view.joint_actions[-1]
    return int(first), int(second)


def _list_joint_actions(view: View[MatrixGame]) -> list[tuple[int, int]]:
    """Return both actions of each round."""
    return [(int(first), int(second)) for first, second in view.joint_actions or ()]


def iter_boards(view: View[MatrixGame], options: DrawOptions) -> Iterator[Text]:
    """Yield the boards, largest first: the table with names and rounds, then smaller tables."""
    if options.allow_large:
        row_count = len(view.problem.actions[0])
        cell_rows = min((options.height - REPLY_ROWS) // row_count, MAX_CELL_ROWS)
        if cell_rows > CELL_ROWS:
            yield _draw_large_board(view, options, cell_rows, with_replies=True)
        yield _draw_large_board(view, options)
    rows = format_regret_rows(options, view.problem.actions[view.seat])
    rows += _format_reply_payoffs(view, options)
    yield from iter_with_and_without_rows(_iter_small_boards(view, options), rows, options)


def _iter_small_boards(view: View[MatrixGame], options: DrawOptions) -> Iterator[Text]:
    """Yield tables of decreasing width, each with and without the rounds below."""
    for width in (10, 8, 6):
        for history in (True, False):
            canvas = Canvas()
            bottom = _draw_payoff_table(view, canvas, width)
            canvas.write_text(0, 0, f"{list_agent_names(view)[0]} ↓" * options.allow_large, "dim")
            if history:
                draw_rounds(view, canvas, bottom + 1, options.width, round_columns=INITIAL_COLUMNS)
            yield canvas.to_text()


def _draw_large_board(
    view: View[MatrixGame],
    options: DrawOptions,
    cell_rows: int = CELL_ROWS,
    *,
    with_replies: bool = False,
) -> Text:
    """Draw the named table, the rounds with payoffs, and the payoffs of the previewed action.

    The other agent's replies come last.
    """
    canvas = Canvas()
    y = _draw_table_with_agent_names(view, canvas, options, cell_rows) + 1
    y = draw_paid_rounds(view, canvas, y, options.width)
    y = canvas.write_rows(y, _format_reply_payoffs(view, options))
    if with_replies:
        draw_reply_counts(view, canvas, y + 1)
    return canvas.to_text()


def draw_reply_counts(view: View[MatrixGame], canvas: Canvas, y: int) -> None:
    """Draw how often the other agent chose each action: in all, and after each joint action."""
    problem, other = view.problem, 1 - view.seat
    names = list_agent_names(view)
    joints = _list_joint_actions(view)
    labels = problem.actions[other].labels
    rows = [("in all rounds", joints)]
    for first, second in product(*(range(len(labels)) for labels in problem.actions)):
        replies = [after for before, after in pairwise(joints) if before == (first, second)]
        if replies:
            chosen = f"{problem.actions[0][first]}, {problem.actions[1][second]}"
            rows.append((f"after {chosen}", replies))
    label_columns = max(len(f"after {', '.join(pair)}") for pair in product(*problem.actions)) + 2
    canvas.write_text(0, y, f"{names[other]} chose", "dim")
    for column, label in enumerate(labels):
        canvas.write_text(label_columns + REPLY_COLUMNS * column, y, label.rjust(10), "dim")
    for row, (name, replies) in enumerate(rows, y + 1):
        canvas.write_text(0, row, name)
        for column in range(len(labels)):
            count, x = sum(joint[other] == column for joint in replies), label_columns
            canvas.write_text(x + REPLY_COLUMNS * column, row, f"{count:>10}", "bold" * (count > 0))


def _draw_table_with_agent_names(
    view: View[MatrixGame], canvas: Canvas, options: DrawOptions, cell_rows: int
) -> int:
    """Draw the table, with both agents' names and payoffs in each cell; return the next row."""
    problem = view.problem
    rows, columns = problem.actions
    last_row, last_column = get_last_joint_action(view) or (None, None)
    names = list_agent_names(view)
    row_agent, column_agent = (f"{name} choose{'s' * (name != 'you')}" for name in names)
    canvas.write_text(0, 0, "" if last_row is None else "> last round", "dim")
    canvas.write_text(0, 1, row_agent if len(row_agent) <= ROW_LABEL_COLUMNS else names[0])
    canvas.write_text(ROW_LABEL_COLUMNS + 2, 0, column_agent)
    own_actions = range(len(problem.actions[view.seat]))
    regret_texts = [format_as_loss(format_regret(options, action)) for action in own_actions]
    for j, name in enumerate(columns):
        x = ROW_LABEL_COLUMNS + (CELL_COLUMNS + 1) * j
        _draw_action_label(canvas, x + 1, 1, name, is_last_choice=j == last_column)
        canvas.write_text(x + 3, 2, regret_texts[j] if view.seat else "", theme.REGRET)
    y = 3 if view.seat and options.regret is not None else 2
    line = "─" * ROW_LABEL_COLUMNS + ("┼" + "─" * CELL_COLUMNS) * len(columns)
    cell_separators = (y + row for row in range(cell_rows * len(rows)) if row % cell_rows)
    separator_rows = [*range(1, y), *cell_separators]
    for i, name in enumerate(rows):
        canvas.write_text(0, y, line, "dim")
        top = y + (cell_rows - 1) // 2  # the texts are in the middle of their cell
        _draw_action_label(canvas, 0, top, name, is_last_choice=i == last_row)
        canvas.write_text(2, top + 1, "" if view.seat else regret_texts[i], theme.REGRET)
        for j in range(len(columns)):
            _draw_payoff_cell(view, canvas, (i, j), top, options)
        y += cell_rows
    for row, j in product(separator_rows, range(len(columns))):
        canvas.write_text(ROW_LABEL_COLUMNS + (CELL_COLUMNS + 1) * j, row, "│", "dim")
    return y


def _draw_action_label(canvas: Canvas, x: int, y: int, name: str, *, is_last_choice: bool) -> None:
    """Draw an action at the edge of the table, with a mark if it was the last choice."""
    canvas.write_text(x, y, ">" if is_last_choice else " ", "bold")
    canvas.write_text(x + 2, y, name)


def list_marked_agent_names(view: View[MatrixGame]) -> list[str]:
    """Return both agents' names, the viewer's own with " (you)"."""
    suffix_by_seat = {view.seat: " (you)"} if view.player_label == "you" else {}
    return [name + suffix_by_seat.get(seat, "") for seat, name in enumerate(view.problem.agents)]


def list_agent_names(view: View[MatrixGame]) -> list[str]:
    """Return both agents' names, with the viewer's label, such as "you", in place of its own."""
    agents = enumerate(view.problem.agents)
    return [view.player_label if seat == view.seat else name for seat, name in agents]


def _draw_payoff_cell(
    view: View[MatrixGame],
    canvas: Canvas,
    joint_action: tuple[int, int],
    y: int,
    options: DrawOptions,
) -> None:
    """Draw both payoffs of a joint action, in brackets if it was the last play."""
    is_last_play = joint_action == get_last_joint_action(view)
    forecast = options.forecast
    is_previewed = forecast is not None and joint_action[view.seat] == int(forecast.action)
    x = ROW_LABEL_COLUMNS + (CELL_COLUMNS + 1) * joint_action[1] + 1
    payoffs = zip(list_agent_names(view), view.problem.payoffs[joint_action], strict=True)
    for row, (name, payoff) in enumerate(payoffs):
        style = "bold reverse" if is_last_play else theme.PREVIEW if is_previewed else ""
        text = f"{name:<{CELL_COLUMNS - 9}} {payoff:>4g}"
        canvas.write_text(x + 1, y + row, f"[{text}]" if is_last_play else f" {text} ", style)


def abbreviate_action(action: str) -> str:
    """Return the short form of an action in the list of rounds: the number, or the first letter."""
    return action if action.isdigit() else action[0].upper()


def _format_reply_payoffs(view: View[MatrixGame], options: DrawOptions) -> list[str]:
    """Format the payoffs of the previewed action against each reply; [] without a forecast."""
    if options.forecast is None:
        return []
    problem, seat, own_action = view.problem, view.seat, int(options.forecast.action)
    payoffs = problem.payoffs[own_action, :, 0] if seat == 0 else problem.payoffs[:, own_action, 1]
    replies = zip(payoffs, problem.actions[1 - seat], strict=True)
    texts = [f"{format_number(payoff)} against {reply}" for payoff, reply in replies]
    probabilities = options.forecast.reply_probabilities
    if probabilities is not None:
        pairs = zip(texts, probabilities.tolist(), strict=True)
        texts = [f"{text} (chance {format_percent(p)})" for text, p in pairs if p > 0.0]
    return [f"{problem.format_action(seat, own_action)}: you get {', '.join(texts)}"]


def draw_paid_rounds(view: View[MatrixGame], canvas: Canvas, y: int, width: int) -> int:
    """Draw the last rounds with each agent's actions, payoffs and total; return the next row.

    The rounds move to the left by several at a time, so that most of them only add a column.
    """
    problem = view.problem
    joints = _list_joint_actions(view)
    max_rounds = max((width - ROW_LABEL_COLUMNS - TOTAL_COLUMNS) // PAID_ROUND_COLUMNS, 1)
    step, hidden_count = max(max_rounds // 3, 1), max(len(joints) - max_rounds, 0)
    visible = joints[-(-hidden_count // step) * step :]
    for seat, name in enumerate(list_agent_names(view)):
        total = sum(float(problem.payoffs[joint][seat]) for joint in joints)
        canvas.write_text(0, y + 2 * seat, name)
        canvas.write_text(0, y + 2 * seat + 1, "reward", "dim")
        initials = [abbreviate_action(problem.actions[seat][joint[seat]]) for joint in visible]
        payoff_texts = [format_number(problem.payoffs[joint][seat]) for joint in visible]
        actions, payoffs = (
            "".join(text.rjust(PAID_ROUND_COLUMNS) for text in texts)
            for texts in (initials, payoff_texts)
        )
        canvas.write_text(ROW_LABEL_COLUMNS, y + 2 * seat, actions)
        payoffs += f"   total {format_number(total)}"
        canvas.write_text(ROW_LABEL_COLUMNS, y + 2 * seat + 1, payoffs)
    return y + 4


def _draw_payoff_table(view: View[MatrixGame], canvas: Canvas, width: int) -> int:
    """Draw the small table, the last play in brackets; return the next row."""
    problem = view.problem
    rows, columns = problem.actions
    last_row, last_column = get_last_joint_action(view) or (None, None)
    label_columns = max(max(map(len, rows)) + 1, width)
    for j, name in enumerate(columns):
        x = label_columns + j * (width + 1)
        canvas.write_text(x, 0, "│", "dim")
        canvas.write_text(x + 1, 0, name[:width].center(width), "bold" * (j == last_column))
    canvas.write_text(0, 1, "─" * label_columns + ("┼" + "─" * width) * len(columns), "dim")
    for i, name in enumerate(rows):
        mark = ">" if i == last_row else " "
        canvas.write_text(0, i + 2, mark + name, "bold" * (i == last_row))
        for j in range(len(columns)):
            x = label_columns + j * (width + 1)
            text = ", ".join(map(format_number, problem.payoffs[i, j].tolist()))
            style = ""
            if (i, j) == (last_row, last_column):
                text, style = f"[{text}]", "bold reverse"
            if len(text) > width:
                text = text.replace(", ", ",")
            canvas.write_text(x, i + 2, "│", "dim")
            canvas.write_text(x + 1, i + 2, text.center(width), style)
    return len(rows) + 2


def draw_rounds(  # noqa: PLR0913 - a canvas, a position and the content
    view: View[MatrixGame],
    canvas: Canvas,
    y: int,
    width: int,
    *,
    round_columns: int,
    empty_text: str = "",
) -> None:
    """Draw the last rounds: a row for each agent, `round_columns` columns for each round.

    `empty_text` stands in the first column before any round; without it nothing is drawn then.
    """
    if not (view.joint_actions or empty_text):
        return
    problem = view.problem
    label_columns = max(map(len, problem.agents)) + 7
    joints = (view.joint_actions or ())[-max((width - label_columns) // round_columns, 1) :]
    for seat, agent in enumerate(list_marked_agent_names(view)):
        canvas.write_text(0, y + seat, agent)
        labels = [problem.actions[seat][int(joint[seat])].upper() for joint in joints]
        texts = (label[: round_columns - 1] for label in labels or [empty_text])
        row = "".join(text.rjust(round_columns) for text in texts)
        canvas.write_text(label_columns - 1, y + seat, row, "bold")


def panel_rows(view: View[MatrixGame]) -> list[tuple[str, str]]:
    """Return the side panel's rows, with the facts that the board lacks."""
    discount = view.problem.discount
    return [("discount", f"{discount:g}" if discount < 1.0 else "none")]


def describe_turn(view: View[MatrixGame]) -> str:
    """Describe both choices of the last round."""
    problem = view.problem
    last_actions = get_last_joint_action(view)
    assert last_actions
    both = zip(problem.agents, problem.actions, last_actions, strict=True)
    return ". ".join(f"{agent} chose {names[action]}" for agent, names, action in both) + "."


def describe_situation(view: View[MatrixGame]) -> str:
    """Describe the viewer's role, the last round and the payoffs of each cell, in sentences."""
    problem = view.problem
    rows, columns = problem.actions
    cells = [
        f"{row_action} against {column_action}: "
        f"{format_number(problem.payoffs[i, j, 0])} to {problem.agents[0]}, "
        f"{format_number(problem.payoffs[i, j, 1])} to {problem.agents[1]}."
        for i, row_action in enumerate(rows)
        for j, column_action in enumerate(columns)
    ]
    return " ".join([*describe_role_and_last_round(view), *cells])


def describe_role_and_last_round(view: View[MatrixGame]) -> list[str]:
    """Return a sentence about the viewer's role, if it plays, and one about the last round."""
    role = [f"you are {view.problem.agents[view.seat]}."] if view.player_label == "you" else []
    return [*role, *([f"last round: {describe_turn(view)}"] if view.turns_played else [])]
