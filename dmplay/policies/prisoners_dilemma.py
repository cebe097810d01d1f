"""Policies for the repeated prisoner's dilemma."""

from dmplay.core import Problem
from dmplay.policies._axelrod import AxelrodStrategy
from dmplay.policies._matrix_agents import FictitiousPlay, GradientAscent, HierarchicalSoftmax, Nash
from dmplay.policies._repeated import REPEATED_GAME_RULES
from dmplay.policies.roster import Roster


def build_roster(problem: Problem, seat: int) -> Roster:
    """Return the agents of the repeated dilemma.

    The hint provider ignores how an action changes the opponent's later actions.
    """
    return Roster(
        {
            **REPEATED_GAME_RULES,
            "nash": Nash,
            "best-response": FictitiousPlay,
            "softmax": HierarchicalSoftmax,
            "gradient-ascent": GradientAscent,
            "axelrod": AxelrodStrategy,
        },
        hint_provider="best-response",
        default_partner="tit-for-tat",
    )
