"""The view of the prisoner's dilemma: figure F.14 with the last actions."""

from dmplay.core.session import View
from dmplay.core.text import format_count
from dmplay.draw import payoff_table
from dmplay.views.protocol import FinishedGame, Lesson

from .rules import PrisonersDilemma

KEYS = {"c": "cooperate", "d": "defect"}
iter_boards, panel_rows = payoff_table.iter_boards, payoff_table.panel_rows
describe_turn, describe_situation = payoff_table.describe_turn, payoff_table.describe_situation


def goal_lines(view: View[PrisonersDilemma]) -> list[str]:
    """Return the goal, the story, and the reward of each pair of actions, as clauses."""
    other = view.problem.agents[1 - view.seat]
    (cc, cd), (dc, dd) = view.problem.payoffs[:, :, 0]
    return [
        "spend few years in prison over all rounds",
        f"what {other} gets does not count",
        "cooperate = silent, defect = blame",
        "a year costs 1",
        f"if {other} cooperates: cooperate pays {cc:g}, defect {dc:g}",
        f"if {other} defects: cooperate pays {cd:g}, defect {dd:g}",
        "both choose at the same time",
    ]


def lesson(view: View[PrisonersDilemma]) -> Lesson:
    """Return the three sentences that introduce the problem: role, objective and rewards."""
    you, other = (view.problem.agents[seat] for seat in (view.seat, 1 - view.seat))
    (cc, cd), (dc, dd) = view.problem.payoffs[:, :, 0]
    return Lesson(
        f"You are {you}, a prisoner; in every round you cooperate (stay silent) or defect (blame "
        f"{other}), and {other} chooses at the same time",
        f"You want few years in prison, whatever {other} gets; a year costs 1",
        f"Cooperating pays {cc:g} if {other} does it too, else {cd:g}; defecting pays {dc:g} if "
        f"{other} cooperates, else {dd:g}",
        "cooperate",
    )


def describe_end(game: FinishedGame[PrisonersDilemma]) -> str:
    """Return the rounds in which both cooperated and each defected, and the years of each."""
    rounds, defections = format_count(len(game.actions), "round"), game.actions.sum(axis=0)
    both = int((game.actions == 0).all(axis=1).sum())
    other = 1 - game.seat
    name, years = game.problem.agents[other], -game.rewards.sum(axis=0)
    return (
        f"both cooperated in {both} of {rounds}; {game.player} defected in "
        f"{defections[game.seat]}, {name} in {defections[other]}; "
        f"prison: {game.player} {format_count(years[game.seat], 'year', 'g')}, {name} "
        f"{years[other]:g}"
    )
