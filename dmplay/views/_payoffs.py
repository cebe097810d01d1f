"""Payoff matrices as tables and words: rows are agent 1's actions."""

from collections.abc import Iterator
from itertools import product

from rich.text import Text

from dmplay.matrix_game import MatrixGame
from dmplay.session import View
from dmplay.views._advice import loss, losses, under
from dmplay.views.canvas import Canvas
from dmplay.views.style import Look

INITIAL = 2  # columns of an action's first letter in the rounds
CELL, STUB = 15, 12  # columns: of a large cell, before it
PAY = 5  # columns of a round where it stands with its pay
LOSS = 4  # columns of a bar of what an action loses


def last(view: View[MatrixGame]) -> tuple[int, int] | None:
    """Both actions of the last round."""
    return (int(view.joint[-1][0]), int(view.joint[-1][1])) if view.joint else None


def boards(view: View[MatrixGame], look: Look) -> Iterator[Text]:
    """A table that names who chooses and who gets what, with the rounds; then smaller tables."""
    if look.large:
        yield _large(view, look)
    names = view.problem.actions[view.seat]
    yield from under(_tables(view, look), [*losses(look, names), *_pays(view, look)], look)


def _tables(view: View[MatrixGame], look: Look) -> Iterator[Text]:
    """The table with the last play in brackets, and the rounds so far; then the table alone."""
    for width in (10, 8, 6):
        for history in (True, False):
            canvas = Canvas()
            bottom = _table(view, canvas, width)
            canvas.put(0, 0, f"{called(view)[0]} ↓" * look.large, "dim")
            if history:
                rounds(view, canvas, bottom + 1, look.width, column=INITIAL)
            yield canvas.text()


def _large(view: View[MatrixGame], look: Look) -> Text:
    """The table that names who gets what, the rounds, and what the action in question pays."""
    canvas = Canvas()
    y = paid_rounds(view, canvas, _named_table(view, canvas, look) + 1, look.width)
    for row, told_ in enumerate(_pays(view, look), y):
        canvas.put(0, row, told_)
    return canvas.text()


def _named_table(view: View[MatrixGame], canvas: Canvas, look: Look) -> int:
    """The table with both payoffs of a cell by name; the row after it."""
    problem, played = view.problem, last(view)
    rows, columns = problem.actions
    down, across = named(view)
    canvas.put(0, 0, down)
    canvas.put(0, 1, "chooses", "dim")
    canvas.put(STUB + 2, 0, f"{across} chooses")
    marks = [loss(look, action, LOSS) for action in range(len(problem.actions[view.seat]))]
    for j, name in enumerate(columns):
        x = STUB + (CELL + 1) * j
        chosen = played is not None and played[1] == j
        _choice(canvas, x + 1, 1, name, chosen=chosen)
        canvas.put(x + 3, 2, marks[j] if view.seat else "", "yellow")
    y = 3 if view.seat and look.regret is not None else 2
    lines = [*range(1, y), *(y + row for row in range(3 * len(rows)) if row % 3)]
    for i, name in enumerate(rows):
        canvas.put(0, y, "─" * STUB + ("┼" + "─" * CELL) * len(columns), "dim")
        chosen = played is not None and played[0] == i
        _choice(canvas, 0, y + 1, name, chosen=chosen)
        canvas.put(2, y + 2, "" if view.seat else marks[i], "yellow")
        for j in range(len(columns)):
            _cell(view, canvas, (i, j), y + 1, look)
        y += 3
    for row, j in product(lines, range(len(columns))):
        canvas.put(STUB + (CELL + 1) * j, row, "│", "dim")
    return y


def _choice(canvas: Canvas, x: int, y: int, name: str, *, chosen: bool) -> None:
    """An action at the edge of the table, with a mark where it was the last choice."""
    canvas.put(x, y, ">" if chosen else " ", "bold")
    canvas.put(x + 2, y, name)


def named(view: View[MatrixGame]) -> list[str]:
    """Both agents by name, and which of them the seat is."""
    you = {view.seat: " (you)"} if view.you == "you" else {}
    return [name + you.get(seat, "") for seat, name in enumerate(view.problem.agents)]


def called(view: View[MatrixGame]) -> list[str]:
    """Both agents, as the seat calls them."""
    agents = enumerate(view.problem.agents)
    return [view.you if seat == view.seat else name for seat, name in agents]


def _cell(view: View[MatrixGame], canvas: Canvas, at: tuple[int, int], y: int, look: Look) -> None:
    """What a pair of actions pays each: in brackets where it was the last play."""
    here = at == last(view)
    tried = look.outlook is not None and at[view.seat] == int(look.outlook.action)
    x = STUB + (CELL + 1) * at[1] + 1
    pays = zip(called(view), view.problem.payoffs[at], strict=True)
    for row, (name, pay) in enumerate(pays):
        style = "bold reverse" if here else "bold yellow" if tried else ""
        told_ = f"{name:<{CELL - 9}} {pay:>4g}"
        canvas.put(x + 1, y + row, f"[{told_}]" if here else f" {told_} ", style)


def initial(action: str) -> str:
    """What stands for an action in the rounds: a number, or its first letter."""
    return action if action.isdigit() else action[0].upper()


def _pays(view: View[MatrixGame], look: Look) -> list[str]:
    """What each reply pays for the action in question."""
    if look.outlook is None:
        return []
    problem, seat, mine = view.problem, view.seat, int(look.outlook.action)
    paid = problem.payoffs[mine, :, 0] if seat == 0 else problem.payoffs[:, mine, 1]
    replies = zip(paid, problem.actions[1 - seat], strict=True)
    first, *others = (f"{pay:g} {reply}" for pay, reply in replies)
    told_ = ", ".join([first.replace(" ", " against ", 1), *others])
    return [f"if {problem.action_name(seat, mine)}: {told_}"]


def paid_rounds(view: View[MatrixGame], canvas: Canvas, y: int, width: int) -> int:
    """Who did what and what it paid, so many columns a round, and the sums; the row after it.

    The rounds move to the left by several at a time: most of them only add a column.
    """
    problem = view.problem
    joints = [(int(first), int(second)) for first, second in view.joint or ()]
    room = max((width - STUB) // PAY, 1)
    step, past = max(room // 3, 1), max(len(joints) - room, 0)
    kept = joints[-(-past // step) * step :]
    for seat, name in enumerate(called(view)):
        total = sum(float(problem.payoffs[joint][seat]) for joint in joints)
        canvas.put(0, y + 2 * seat, name)
        canvas.put(0, y + 2 * seat + 1, f"total {total:g}", "dim")
        did = [initial(problem.actions[seat][joint[seat]]) for joint in kept]
        got = [f"{problem.payoffs[joint][seat]:g}" for joint in kept]
        canvas.put(STUB, y + 2 * seat, "".join(word.rjust(PAY) for word in did))
        canvas.put(STUB, y + 2 * seat + 1, "".join(pay.rjust(PAY) for pay in got))
    return y + 4


def _table(view: View[MatrixGame], canvas: Canvas, width: int) -> int:
    """The table, the last play in brackets; the row after it."""
    problem = view.problem
    rows, columns = problem.actions
    played = last(view)
    stub = max(max(map(len, rows)) + 1, width)
    for j, name in enumerate(columns):
        x = stub + j * (width + 1)
        canvas.put(x, 0, "│", "dim")
        chosen = played is not None and played[1] == j
        canvas.put(x + 1, 0, name[:width].center(width), "bold" if chosen else "")
    canvas.put(0, 1, "─" * stub + ("┼" + "─" * width) * len(columns), "dim")
    for i, name in enumerate(rows):
        mark = ">" if played and played[0] == i else " "
        canvas.put(0, i + 2, mark + name, "bold" if mark == ">" else "")
        for j in range(len(columns)):
            x = stub + j * (width + 1)
            pay = "{:g}, {:g}".format(*problem.payoffs[i, j])
            here = played == (i, j)
            canvas.put(x, i + 2, "│", "dim")
            shown = f"[{pay}]" if here else pay
            if len(shown) > width:
                shown = shown.replace(", ", ",")
            canvas.put(x + 1, i + 2, shown.center(width), "bold reverse" if here else "")
    return len(rows) + 2


def rounds(  # noqa: PLR0913 - a place on the canvas, and what goes there
    view: View[MatrixGame], canvas: Canvas, y: int, width: int, *, column: int, none: str = ""
) -> None:
    """Who did what, a row an agent and so many columns a round, the last rounds at the end."""
    problem = view.problem
    stub = max(map(len, problem.agents)) + 7
    joints = (view.joint or ())[-max((width - stub) // column, 1) :]
    for seat, agent in enumerate(named(view)):
        canvas.put(0, y + seat, agent)
        words = [problem.actions[seat][int(joint[seat])].upper() for joint in joints] or [none]
        row = "".join(word[: column - 1].rjust(column) for word in words)
        canvas.put(stub - 1, y + seat, row, "bold")


def panel(view: View[MatrixGame]) -> list[tuple[str, str]]:
    """What the board does not tell."""
    return [("discount", f"{view.problem.discount:g}")]


def told(view: View[MatrixGame]) -> str:
    """Who chose what."""
    problem = view.problem
    played = last(view)
    assert played
    both = zip(problem.agents, problem.actions, played, strict=True)
    return ". ".join(f"{agent} chose {names[action]}" for agent, names, action in both) + "."


def situation(view: View[MatrixGame]) -> str:
    """One sentence a cell, and the last round."""
    problem = view.problem
    rows, columns = problem.actions
    cells = [
        f"{mine} against {theirs}: {problem.payoffs[i, j, 0]:g} to {problem.agents[0]}, "
        f"{problem.payoffs[i, j, 1]:g} to {problem.agents[1]}."
        for i, mine in enumerate(rows)
        for j, theirs in enumerate(columns)
    ]
    before = [f"last round: {told(view)}"] if view.turn else []
    you = [f"you are {problem.agents[view.seat]}."] if view.you == "you" else []
    return " ".join([*you, *before, *cells])
