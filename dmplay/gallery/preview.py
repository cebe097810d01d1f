"""What the gallery tells of a problem: its first frame, its goal, its agents, your games of it."""

from textwrap import TextWrapper
from typing import NamedTuple

from rich.text import Text

from dmplay.core import Problem
from dmplay.describe import brief, counted
from dmplay.dice import Dice
from dmplay.finding import agents, problems
from dmplay.records import Record, Result
from dmplay.session import Session, View
from dmplay.terminal import clean
from dmplay.transcript.reading import Transcript
from dmplay.views.canvas import by_rows
from dmplay.views.style import Look, Needed, Style, fit, style_of

MANY = 8  # agents that are named


class Preview(NamedTuple):
    """A problem as one sees it who never played it."""

    kind: str
    about: str
    goal: str
    agents: list[str]
    watched: str  # the agent to be watched: the best of them
    style: Style
    view: View[Problem]

    def drawn(self, width: int, height: int, told: list[Text], *, ascii_: bool) -> list[Text]:
        """All of it in so much room, with what is told of your games; the board as large as can be.

        Where the room is small the agents go first, and then what the problem is about.
        """
        named = [row for row in told if row.plain]
        goal = wrapped(f"goal: {self.goal}", width)
        heads = [wrapped(self.about, width, "dim"), [*goal, Text("")]]
        feet = [[Text(""), *wrapped(self._agents, width, "dim")], named]
        for rows in ([*heads, *feet], [*heads, named], [heads[1], named], [heads[1]]):
            left = height - sum(map(len, rows))
            look = Look(width, max(left, 1), ascii_, large=True)
            board = fit(self.style, self.view, look)
            if not isinstance(board, Needed):
                at = 2 if heads[0] in rows else 1
                return [row for part in [*rows[:at], by_rows(board), *rows[at:]] for row in part]
        situation = wrapped(self.style.situation(self.view), width, "dim")
        return [*heads[0], *goal, Text(""), *situation, *feet[0], *named][:height]

    @property
    def _agents(self) -> str:
        more = f" and {len(self.agents) - MANY} more" if len(self.agents) > MANY else ""
        return f"agents: {', '.join(self.agents[:MANY])}{more}"


def wrapped(told: str, width: int, style: str = "") -> list[Text]:
    """A text in rows, no word cut in two at a hyphen."""
    rows = TextWrapper(max(width, 1), break_on_hyphens=False).wrap(clean(told))
    return [Text(row, style=style) for row in rows]


def preview(name: str, seed: int) -> Preview:
    """What there is to tell of a problem, under the dice of this seed."""
    problem = problems.load(name)
    style, roster = style_of(problem), agents.roster(problem)
    view = Session(problem, Dice(seed)).view(0)
    about = problems.docs(problem).partition("\n\n")[0]
    watched = roster.adviser or next(iter(roster.agents))
    others = [agent for agent in roster.agents if agent != watched]
    goal = "; ".join(map(clean, style.goal(view)))
    return Preview(problem.kind, about, goal, [watched, *others], watched, style, view)


def your_games(record: Record | None, left: Transcript | None) -> list[Text]:
    """Your best, your last and your unfinished game."""
    rows = []
    if record and record.best:
        rows.append(_row("best", _result(record.best)))
    if record and record.last != record.best:
        rows.append(_row("last", _result(record.last)))
    if left:
        turns = sum(block.kind == "turn" for block in left.blocks) - 1
        rows.append(_row("left", f"after {counted(turns, 'turn')}; c goes on"))
    return rows


def _row(label: str, told: str) -> Text:
    return Text(f"{label} ").append(told, style="bold")


def _result(result: Result) -> str:
    return f"{brief(result.returned)} in {counted(result.turns, 'turn')}, seed {result.seed}"
