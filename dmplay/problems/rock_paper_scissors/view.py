"""The view of rock-paper-scissors: figure F.15 with the last actions."""

from dmplay.core.session import View
from dmplay.core.text import format_count
from dmplay.draw import payoff_table
from dmplay.views.protocol import FinishedGame, Lesson

from .rules import RockPaperScissors

KEYS = {"r": "rock", "p": "paper", "s": "scissors"}
iter_boards = payoff_table.iter_boards
describe_turn, describe_situation = payoff_table.describe_turn, payoff_table.describe_situation


def goal_lines(view: View[RockPaperScissors]) -> list[str]:
    """Return the goal, the rule and the rewards of the winner and the loser, as clauses."""
    win_reward = view.problem.payoffs.max()
    return [
        f"win more rounds than {view.problem.agents[1 - view.seat]}",
        "rock beats scissors, scissors paper, paper rock",
        f"the winner gets {win_reward:g}, the loser {-win_reward:g}",
        "both choose at the same time",
    ]


def panel_rows(view: View[RockPaperScissors]) -> list[tuple[str, str]]:
    """Return the side panel's rows: the discount, and how often the player chose each action."""
    labels = view.problem.actions[view.seat].labels
    counts = zip(labels, [view.actions.count(a) for a in range(len(labels))], strict=True)
    chosen = " ".join(f"{payoff_table.abbreviate_action(a)}{count}" for a, count in counts)
    return [*payoff_table.panel_rows(view), (f"{view.player_label} used", chosen)]


def lesson(view: View[RockPaperScissors]) -> Lesson:
    """Return the three sentences that introduce the problem: role, objective and rewards."""
    you, other = (view.problem.agents[seat] for seat in (view.seat, 1 - view.seat))
    win_reward = view.problem.payoffs.max()
    return Lesson(
        f"You are {you} and choose at the same time as {other}, in every round",
        f"You want to beat {other}: rock beats scissors, scissors beat paper, paper beats rock",
        f"A win pays {win_reward:g}, a loss costs {win_reward:g}, and a draw pays nothing",
        "scissors",
    )


def describe_end(game: FinishedGame[RockPaperScissors]) -> str:
    """Return the rounds that the player won, lost and drew."""
    rewards = game.rewards[:, game.seat]
    wins, losses = int((rewards > 0).sum()), int((rewards < 0).sum())
    draws, rounds = len(rewards) - wins - losses, format_count(len(rewards), "round")
    return f"{game.player} won {wins}, lost {losses} and drew {draws} of {rounds}"
