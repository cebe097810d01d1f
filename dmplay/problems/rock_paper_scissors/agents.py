"""Policies for rock-paper-scissors."""

from dataclasses import dataclass

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import RepeatedGameRule
from dmplay.agents.matrix_game_agents import FictitiousPlay, GradientAscent, Nash
from dmplay.agents.random_agent import Random
from dmplay.agents.repeated_game_planning import RepeatedGamePlan
from dmplay.core.arrays import Array, Ints


@dataclass(frozen=True)
class BeatLast(RepeatedGameRule):
    """Plays rock first, then the action that beats the opponent's last one."""

    def reply(self, own_actions: Ints, opponent_actions: Ints) -> Array:
        """Return the actions that beat the opponent's.

        Each action is beaten by the next: rock by paper, paper by scissors, scissors by rock.
        """
        return (opponent_actions + 1) % 3


class Plan(RepeatedGamePlan):
    """Plans all rounds left for the other agent's rule, or for each rule that it may follow."""

    candidate_rules = {  # noqa: RUF012 - never written
        "uniform": Random, "beat-last": BeatLast, "frequency": FictitiousPlay,
    }  # fmt: skip


AGENTS = Roster(
    {"uniform": Random, "nash": Nash, "beat-last": BeatLast, "frequency": FictitiousPlay,
     "gradient-ascent": GradientAscent, "plan-rounds": Plan},
    hint_provider="plan-rounds", default_partner="frequency", batch_agent="frequency",
    rule_of_thumb="beat-last",
)  # fmt: skip
