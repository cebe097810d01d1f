"""What the gallery tells of a problem: its first frame, its goal, its agents, your games of it."""

from textwrap import TextWrapper
from typing import NamedTuple

from rich.text import Text

from dmplay.core import Problem
from dmplay.describe import format_count, format_score
from dmplay.dice import SeededUniforms
from dmplay.finding import agents, problems
from dmplay.records import GameResult, ProblemRecord
from dmplay.session import Session, View
from dmplay.terminal import escape_unprintable
from dmplay.transcript.reading import Transcript
from dmplay.views.canvas import split_rows
from dmplay.views.style import DrawOptions, TooSmallNotice, ViewModule, fit_board, load_view_module

MAX_AGENTS_SHOWN = 8  # agents that are named


class ProblemPreview(NamedTuple):
    """A problem as one sees it who never played it."""

    kind: str
    summary: str
    goal: str
    agents: list[str]
    best_agent: str  # the agent to be watched: the best of them
    view_module: ViewModule
    view: View[Problem]

    def render_rows(
        self, width: int, height: int, your_games: list[Text], *, ascii_: bool
    ) -> list[Text]:
        """All of it in so much room, with what is told of your games; the board as large as can be.

        Where the room is small the agents go first, and then what the problem is about.
        """
        named = [row for row in your_games if row.plain]
        goal = wrap_text(f"goal: {self.goal}", width)
        heads = [wrap_text(self.summary, width, "dim"), [*goal, Text("")]]
        feet = [[Text(""), *wrap_text(self._agents_line, width, "dim")], named]
        for rows in ([*heads, *feet], [*heads, named], [heads[1], named], [heads[1]]):
            left = height - sum(map(len, rows))
            look = DrawOptions(width, max(left, 1), ascii_, allow_large=True)
            board = fit_board(self.view_module, self.view, look)
            if not isinstance(board, TooSmallNotice):
                at = 2 if heads[0] in rows else 1
                return [row for part in [*rows[:at], split_rows(board), *rows[at:]] for row in part]
        situation = wrap_text(self.view_module.describe_situation(self.view), width, "dim")
        return [*heads[0], *goal, Text(""), *situation, *feet[0], *named][:height]

    @property
    def _agents_line(self) -> str:
        more = (
            f" and {len(self.agents) - MAX_AGENTS_SHOWN} more"
            if len(self.agents) > MAX_AGENTS_SHOWN
            else ""
        )
        return f"agents: {', '.join(self.agents[:MAX_AGENTS_SHOWN])}{more}"


def wrap_text(text: str, width: int, style: str = "") -> list[Text]:
    """A text in rows, no word cut in two at a hyphen."""
    rows = TextWrapper(max(width, 1), break_on_hyphens=False).wrap(escape_unprintable(text))
    return [Text(row, style=style) for row in rows]


def make_preview(problem_name: str, seed: int) -> ProblemPreview:
    """What there is to tell of a problem, under the dice of this seed."""
    problem = problems.load_problem(problem_name)
    style, roster = load_view_module(problem), agents.load_roster(problem)
    view = Session(problem, SeededUniforms(seed)).view(0)
    about = problems.full_description(problem).partition("\n\n")[0]
    watched = roster.hint_provider or next(iter(roster.agents))
    others = [agent for agent in roster.agents if agent != watched]
    goal = "; ".join(map(escape_unprintable, style.goal_lines(view)))
    return ProblemPreview(problem.kind, about, goal, [watched, *others], watched, style, view)


def your_game_rows(record: ProblemRecord | None, unfinished_game: Transcript | None) -> list[Text]:
    """Your best, your last and your unfinished game."""
    rows = []
    if record and record.best:
        rows.append(_label_row("best", _format_result(record.best)))
    if record and record.last != record.best:
        rows.append(_label_row("last", _format_result(record.last)))
    if unfinished_game:
        turns = sum(block.kind == "turn" for block in unfinished_game.blocks) - 1
        rows.append(_label_row("left", f"after {format_count(turns, 'turn')}; c goes on"))
    return rows


def _label_row(label: str, value: str) -> Text:
    return Text(f"{label} ").append(value, style="bold")


def _format_result(result: GameResult) -> str:
    return f"{format_score(result.discounted_return)} in {format_count(result.turns, 'turn')}, seed {result.seed}"
