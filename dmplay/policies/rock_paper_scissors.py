"""Policies for rock-paper-scissors."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, Percept
from dmplay.policies._kinds import Rule
from dmplay.policies.general import Random
from dmplay.problems.rock_paper_scissors import RockPaperScissors
from dmplay.solvers.value_iteration import best


@dataclass(frozen=True)
class BeatLast(Rule):
    """Rock first, then what beats the other's last."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """Each is beaten by the next: rock by paper, paper by scissors, scissors by rock."""
        return (other + 1) % 3


@dataclass(frozen=True)
class Frequency:
    """The best reply to how often the other has played each action so far (fictitious play)."""

    problem: RockPaperScissors
    seat: int

    @property
    def draws(self) -> int:
        """None."""
        return 0

    def begin(self, observation: Array) -> Memory:
        """No action counted yet."""
        return (np.zeros((len(observation), 3), np.int64),)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """One more."""
        assert percept.actions is not None
        other = percept.actions[:, 1 - self.seat]
        return (memory[0] + (other[:, None] == np.arange(3)),)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The first of the best replies: rock where nothing is known."""
        return np.asarray(np.argmax(best(self.values(memory)), axis=1))

    def values(self, memory: Memory) -> Reals:
        """The reward expected against these frequencies."""
        counts = memory[0]
        rounds = counts[:, :1] + counts[:, 1:2] + counts[:, 2:]
        each = np.moveaxis(self.problem.payoffs[:, :, self.seat], 1 - self.seat, 0)
        total = counts[:, :1] * each[0] + counts[:, 1:2] * each[1] + counts[:, 2:] * each[2]
        return np.asarray(total / np.maximum(rounds, 1))


POLICIES = {"uniform": Random, "beat-last": BeatLast, "frequency": Frequency}
PARTNER = "frequency"
HINT = "frequency"
