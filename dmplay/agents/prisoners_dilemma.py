"""Policies for the repeated prisoner's dilemma."""

from dmplay.agents._axelrod_strategy import AxelrodStrategy
from dmplay.agents._matrix_game_agents import (
    FictitiousPlay,
    GradientAscent,
    HierarchicalSoftmax,
    Nash,
)
from dmplay.agents._repeated_game_rules import REPEATED_GAME_RULES
from dmplay.agents.available_agents import Roster
from dmplay.core.problem import Problem


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
