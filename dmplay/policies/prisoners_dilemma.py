"""Policies for the repeated prisoner's dilemma."""

from dmplay.core import Problem
from dmplay.policies._axelrod import Axelrod
from dmplay.policies._matrix_agents import BestResponse, GradientAscent, Nash, Softmax
from dmplay.policies._repeated import RULES
from dmplay.policies.roster import Roster


def roster(problem: Problem, seat: int) -> Roster:
    """Who plays the repeated dilemma; the adviser takes no account of what a play provokes."""
    return Roster(
        {**RULES, "nash": Nash, "best-response": BestResponse, "softmax": Softmax,
         "gradient-ascent": GradientAscent, "axelrod": Axelrod},
        adviser="best-response", partner="tit-for-tat",
    )  # fmt: skip
