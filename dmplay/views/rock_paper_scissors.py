"""How rock-paper-scissors looks: figure F.15 with the last play."""

from dmplay.problems.rock_paper_scissors import RockPaperScissors
from dmplay.session import View
from dmplay.views._payoffs import describe_situation, describe_turn, iter_boards, panel_rows
from dmplay.views.style import Lesson

KEYS = {"r": "rock", "p": "paper", "s": "scissors"}


def goal_lines(view: View[RockPaperScissors]) -> list[str]:
    """What beats what, and what that pays."""
    won = view.problem.payoffs.max()
    beats = "rock beats scissors beats paper beats rock"
    return [beats, f"the winner gets {won:g}, the loser {-won:g}", "both choose at once"]


def lesson(view: View[RockPaperScissors]) -> Lesson:
    """Who chooses, and what each pair of choices pays."""
    you, other = (view.problem.agents[seat] for seat in (view.seat, 1 - view.seat))
    won = view.problem.payoffs.max()
    return Lesson(
        f"You are {you} and choose at the same time as {other}, again and again",
        "You want to beat the other: rock beats scissors, scissors paper, and paper rock",
        f"A win pays {won:g}, a loss costs {won:g}, and two of a kind pay nothing",
        "scissors",
    )


__all__ = [
    "KEYS",
    "describe_situation",
    "describe_turn",
    "goal_lines",
    "iter_boards",
    "lesson",
    "panel_rows",
]
