"""Policies for the repeated prisoner's dilemma."""

from dmplay.agents.available_agents import Roster
from dmplay.agents.axelrod_strategy import AxelrodStrategy
from dmplay.agents.matrix_game_agents import (
    FictitiousPlay,
    GradientAscent,
    HierarchicalSoftmax,
    Nash,
)
from dmplay.agents.random_agent import Random
from dmplay.agents.repeated_game_planning import RepeatedGamePlan
from dmplay.agents.repeated_game_rules import REPEATED_GAME_RULES


class Plan(RepeatedGamePlan):
    """Plans all rounds left for the other agent's rule, or for each rule that it may follow."""

    candidate_rules = {**REPEATED_GAME_RULES, "random": Random}  # noqa: RUF012 - never written


AGENTS = Roster(
    {**REPEATED_GAME_RULES, "nash": Nash, "best-response": FictitiousPlay,
     "softmax": HierarchicalSoftmax, "gradient-ascent": GradientAscent,
     "axelrod": AxelrodStrategy, "plan-rounds": Plan},
    hint_provider="plan-rounds", default_partner="tit-for-tat", batch_agent="best-response",
    rule_of_thumb="tit-for-tat",
)  # fmt: skip
