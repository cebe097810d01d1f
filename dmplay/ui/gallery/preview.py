"""The gallery's preview of a problem: first board, goal, agents, and the player's games."""

from datetime import date
from typing import NamedTuple

from rich.text import Text

from dmplay.core.problem import Problem
from dmplay.core.session import Session, View
from dmplay.core.text import escape_unprintable, format_count, format_score
from dmplay.core.uniforms import SeededUniforms
from dmplay.draw.canvas import split_rows, wrap_text
from dmplay.draw.options import DrawOptions
from dmplay.game.player_records import GameResult, ProblemRecord
from dmplay.game.start_seeds import choose_daily_seed
from dmplay.registry import agents, problems
from dmplay.transcript.reader import TranscriptOutline
from dmplay.tutor.lesson_list import LessonOutline
from dmplay.views.protocol import TooSmallNotice, ViewModule, fit_board, load_view_module

MAX_AGENTS_SHOWN = 8  # maximum number of agent names
FIRST_GAME_SUMMARY = (
    "Enter starts a game of three minutes. While you play, rows above the board say what to do. "
    "It is shown here until you have finished it."
)


class ProblemPreview(NamedTuple):
    """A problem as the gallery shows it before the first turn."""

    kind: str
    summary: str
    goal: str
    agents: list[str]
    best_agent: str  # best agent, offered for watching
    view_module: ViewModule
    view: View[Problem]
    daily_seed: int  # of the game of the day, whose first state is shown

    def render_rows(
        self, width: int, height: int, your_games: list[Text], *, ascii_: bool
    ) -> list[Text]:
        """Return the preview as at most `height` rows, with the largest board that fits.

        If space is short, the agents go first, then the summary, then the player's games, and
        finally the situation in words takes the place of the board.
        """
        game_rows = [row for row in your_games if row.plain]
        goal_rows = wrap_text(f"goal: {self.goal}", width)
        parts_above = [wrap_text(self.summary, width, "dim"), [*goal_rows, Text("")]]
        parts_below = [[Text(""), *wrap_text(self._agents_line, width, "dim")], game_rows]
        for rows in (
            [*parts_above, *parts_below],
            [*parts_above, game_rows],
            [parts_above[1], game_rows],
            [parts_above[1]],
        ):
            board_height = height - sum(map(len, rows))
            options = DrawOptions(width, max(board_height, 1), ascii_, allow_large=True)
            board = fit_board(self.view_module, self.view, options)
            if not isinstance(board, TooSmallNotice):
                index = 2 if parts_above[0] in rows else 1
                return [
                    row
                    for part in [*rows[:index], split_rows(board), *rows[index:]]
                    for row in part
                ]
        situation = wrap_text(self.view_module.describe_situation(self.view), width, "dim")
        return [*parts_above[0], *goal_rows, Text(""), *situation, *parts_below[0], *game_rows][
            :height
        ]

    @property
    def _agents_line(self) -> str:
        """The names of the agents in one line; '' if there are none."""
        if not self.agents:
            return ""
        suffix = ""
        if len(self.agents) > MAX_AGENTS_SHOWN:
            suffix = f" and {len(self.agents) - MAX_AGENTS_SHOWN} more"
        return f"agents: {', '.join(self.agents[:MAX_AGENTS_SHOWN])}{suffix}"


def make_preview(problem_name: str, today: date, seed: int | None = None) -> ProblemPreview:
    """Return the preview of a problem, with the first state of its game of the day or of a seed."""
    problem = problems.load_problem(problem_name)
    view_module, roster = load_view_module(problem), agents.load_roster(problem)
    seed = choose_daily_seed(problem, today) if seed is None else seed
    view = Session(problem, SeededUniforms(seed)).view(0)
    summary = problems.problem_docstring(problem).partition("\n\n")[0]
    best_agent = roster.hint_provider or next(iter(roster.agents))
    others = [agent for agent in roster.agents if agent != best_agent]
    goal = "; ".join(map(escape_unprintable, view_module.goal_lines(view)))
    return ProblemPreview(
        problem.kind, summary, goal, [best_agent, *others], best_agent, view_module, view, seed
    )


def make_first_game_preview(lesson: LessonOutline, today: date) -> ProblemPreview:
    """Return the preview of the first game at its position."""
    preview = make_preview(lesson.position["problem"], today, lesson.position["seed"])
    minutes = format_count(lesson.minutes, "minute")
    return preview._replace(kind=minutes, summary=FIRST_GAME_SUMMARY, agents=[])


def your_game_rows(
    record: ProblemRecord | None, unfinished_game: TranscriptOutline | None, ghost: str
) -> list[Text]:
    """Return the rows about the player's record, last result, unfinished game and ghost."""
    rows = []
    if record and record.best:
        rows.append(_format_labelled_row("record", _format_result(record.best)))
    if record and record.medal:
        rows.append(_format_labelled_row("best medal", record.medal))
    if record and record.last != record.best:
        rows.append(_format_labelled_row("last", _format_result(record.last)))
    if unfinished_game:
        turns_text = format_count(unfinished_game.turns, "turn")
        rows.append(_format_labelled_row("unfinished", f"after {turns_text}; c resumes it"))
    if ghost:
        rows.append(_format_labelled_row("ghost", ghost))
    return rows


def _format_labelled_row(label: str, value: str) -> Text:
    """Return a row of a label and a bold value."""
    return Text(f"{label} ").append(value, style="bold")


def _format_result(result: GameResult) -> str:
    """Format a result as return, number of turns and seed."""
    return (
        f"{format_score(result.discounted_return)} in "
        f"{format_count(result.turns, 'turn')}, seed {result.seed}"
    )
