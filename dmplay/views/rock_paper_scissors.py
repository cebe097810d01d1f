"""How rock-paper-scissors looks: figure F.15 with the last play."""

from dmplay.problems.rock_paper_scissors import RockPaperScissors
from dmplay.session import View
from dmplay.views._payoffs import boards, panel, situation, told

KEYS = {"r": "rock", "p": "paper", "s": "scissors"}


def goal(view: View[RockPaperScissors]) -> list[str]:
    """What beats what, and what that pays."""
    won = view.problem.payoffs.max()
    beats = "rock beats scissors beats paper beats rock"
    return [beats, f"the winner gets {won:g}, the loser {-won:g}", "both choose at once"]


__all__ = ["KEYS", "boards", "goal", "panel", "situation", "told"]
