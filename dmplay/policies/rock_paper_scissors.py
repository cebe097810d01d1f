"""Policies for rock-paper-scissors."""

from dataclasses import dataclass

from dmplay.chance import Array, Ints
from dmplay.core import Problem
from dmplay.policies._matrix_agents import FictitiousPlay, GradientAscent, Nash
from dmplay.policies.general import Random
from dmplay.policies.kinds import RepeatedGameRule
from dmplay.policies.roster import Roster


@dataclass(frozen=True)
class BeatLast(RepeatedGameRule):
    """Plays rock first, then the action that beats the opponent's last one."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """Return the actions that beat the opponent's.

        Each action is beaten by the next: rock by paper, paper by scissors, scissors by rock.
        """
        return (other + 1) % 3


def build_roster(problem: Problem, seat: int) -> Roster:
    """Return the agents of rock-paper-scissors."""
    return Roster(
        {"uniform": Random, "nash": Nash, "beat-last": BeatLast, "frequency": FictitiousPlay,
         "gradient-ascent": GradientAscent},
        hint_provider="frequency", default_partner="frequency",
    )  # fmt: skip
