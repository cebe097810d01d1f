"""Payoff matrices as tables and words: rows are agent 1's actions."""

from collections.abc import Iterator

from rich.text import Text

from dmplay.matrix_game import MatrixGame
from dmplay.session import View
from dmplay.views.canvas import Canvas
from dmplay.views.style import Look

INITIAL = 2  # columns of an action's first letter in the rounds


def last(view: View[MatrixGame]) -> tuple[int, int] | None:
    """Both actions of the last round."""
    return (int(view.joint[-1][0]), int(view.joint[-1][1])) if view.joint else None


def boards(view: View[MatrixGame], look: Look) -> Iterator[Text]:
    """The table with the last play in brackets, and the rounds so far; then the table alone."""
    for width in (10, 8, 6):
        for history in (True, False):
            canvas = Canvas()
            bottom = _table(view, canvas, width)
            if history:
                rounds(view, canvas, bottom + 1, look.width, column=INITIAL)
            yield canvas.text()


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
    for seat, agent in enumerate(problem.agents):
        you = " (you)" if seat == view.seat else ""
        canvas.put(0, y + seat, f"{agent}{you}")
        words = [problem.actions[seat][int(joint[seat])].upper() for joint in joints] or [none]
        row = "".join(word[: column - 1].rjust(column) for word in words)
        canvas.put(stub - 1, y + seat, row, "bold")


def panel(view: View[MatrixGame]) -> list[tuple[str, str]]:
    """The last round and the sums."""
    problem = view.problem
    played = last(view)
    names = [problem.actions[seat][played[seat]] for seat in (0, 1)] if played else ["-", "-"]
    rewards = view.rewards or ()
    sums = [("reward", f"{rewards[-1]:g}" if rewards else "-"), ("total", f"{sum(rewards):g}")]
    return [*zip(problem.agents, names, strict=True), *sums, ("gamma", f"{problem.discount:g}")]


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
    return " ".join([f"you are {problem.agents[view.seat]}.", *before, *cells])
