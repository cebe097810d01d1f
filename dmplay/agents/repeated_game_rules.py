"""Classical rules for repeated games of two with two actions each; 0 cooperates, 1 defects.

The cooperative action is the one with that label, or else the one that pays the opponent more on
average.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.agents.base import RepeatedGameRule
from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory, Percept, requires_fields
from dmplay.solvers.games import bimatrix_game

COOPERATE_LABEL = "cooperate"


@dataclass(frozen=True)
class CooperateDefectRule(RepeatedGameRule):
    """A rule whose actions are to cooperate and to defect."""

    @cached_property
    def cooperative_actions(self) -> Ints:
        """The cooperative action of each seat, `[2]`."""
        payoffs = bimatrix_game.build_payoffs(self.problem)
        actions = []
        for seat, space in enumerate(self.problem.actions):
            opponent_totals = payoffs[..., 1 - seat].sum(axis=1 - seat)
            is_named = COOPERATE_LABEL in space.labels
            actions.append(
                space.labels.index(COOPERATE_LABEL) if is_named else opponent_totals.argmax()
            )
        return np.array(actions)

    def update_rule_memory(self, memory: Ints, own_actions: Ints, opponent_actions: Ints) -> Array:
        """Return the memory of the rule after a round."""
        return self.reply(own_actions, opponent_actions)

    def choose_next_actions(self, memory: Ints, u: Reals) -> Ints:
        """Return the next actions `[B]`: the memory itself, unless overridden."""
        return memory

    @requires_fields("actions")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the memory after a round, from both agents' actions."""
        assert percept.actions is not None
        seats = self.seat, 1 - self.seat
        own_actions, opponent_actions = (
            percept.actions[:, seat] ^ self.cooperative_actions[seat] for seat in seats
        )
        return (self.update_rule_memory(memory[0], own_actions, opponent_actions),)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the actions that the rule prescribes."""
        return np.asarray(
            self.choose_next_actions(memory[0], u) ^ self.cooperative_actions[self.seat]
        )


@dataclass(frozen=True)
class TitForTat(CooperateDefectRule):
    """Cooperates first, then repeats the opponent's last action."""

    def reply(self, own_actions: Ints, opponent_actions: Ints) -> Array:
        """Return the opponent's last action."""
        return opponent_actions


@dataclass(frozen=True)
class SuspiciousTitForTat(TitForTat):
    """Defects first, then repeats the opponent's last action."""

    first_action = 1


@dataclass(frozen=True)
class Grim(CooperateDefectRule):
    """Cooperates until either agent defects, then always defects."""

    def reply(self, own_actions: Ints, opponent_actions: Ints) -> Array:
        """Return 1, defect, once either agent has defected."""
        return np.asarray(own_actions | opponent_actions)


@dataclass(frozen=True)
class WinStayLoseShift(CooperateDefectRule):
    """Cooperates first and after rounds in which both cooperated or both defected, else defects."""

    def reply(self, own_actions: Ints, opponent_actions: Ints) -> Array:
        """Return 1, defect, after a round in which the actions differed."""
        return np.asarray(own_actions != opponent_actions, np.int64)


@dataclass(frozen=True)
class AlwaysCooperate(CooperateDefectRule):
    """Always cooperates."""

    def reply(self, own_actions: Ints, opponent_actions: Ints) -> Array:
        """Return 0, cooperate."""
        return 0 * own_actions


@dataclass(frozen=True)
class AlwaysDefect(CooperateDefectRule):
    """Always defects."""

    first_action = 1

    def reply(self, own_actions: Ints, opponent_actions: Ints) -> Array:
        """Return 1, defect."""
        return 0 * own_actions + 1


@dataclass(frozen=True)
class GenerousTitForTat(TitForTat):
    """Repeats the opponent's last action, but cooperates first and sometimes after a defection."""

    forgiveness: float = parameter(1 / 3, "probability of forgiving a defection", 0.0, 1.0)

    uniform_count = 1  # for forgiving

    def choice_probabilities(self, memory: Memory) -> Reals:
        """Return the probability `[B, A]` of each action: a defection may be forgiven."""
        defects = memory[0] * (1.0 - self.forgiveness)
        by_rule = np.stack([1.0 - defects, defects], axis=1)
        is_swapped = self.cooperative_actions[self.seat] == 1
        return by_rule[:, ::-1] if is_swapped else by_rule

    def choose_next_actions(self, memory: Ints, u: Reals) -> Ints:
        """Return 1, defect, after a defection that is not forgiven."""
        return np.asarray(memory * (u[:, 0] >= self.forgiveness), np.int64)


@dataclass(frozen=True)
class _OpponentCountRule(CooperateDefectRule):
    """A rule that acts on a count about the opponent, which starts at 0."""

    def update_rule_memory(self, memory: Ints, own_actions: Ints, opponent_actions: Ints) -> Array:
        """Return the count after the opponent's last action."""
        return self.reply(memory, opponent_actions)


@dataclass(frozen=True)
class TitForTwoTats(_OpponentCountRule):
    """Cooperates unless the opponent defected in both of the last two rounds."""

    def reply(self, own_actions: Ints, opponent_actions: Ints) -> Array:
        """Return the number of defections in a row of the opponent, from the previous count."""
        return np.where(opponent_actions == 1, own_actions + 1, 0)

    def choose_next_actions(self, memory: Ints, u: Reals) -> Ints:
        """Return 1, defect, after two defections in a row."""
        return np.asarray(memory >= 2, np.int64)


@dataclass(frozen=True)
class TwoTitsForTat(_OpponentCountRule):
    """Cooperates except in the two rounds after each defection by the opponent."""

    def reply(self, own_actions: Ints, opponent_actions: Ints) -> Array:
        """Return the number of defections that are due, from the previous count."""
        return np.where(opponent_actions == 1, 2, np.maximum(own_actions - 1, 0))

    def choose_next_actions(self, memory: Ints, u: Reals) -> Ints:
        """Return 1, defect, while a defection is due."""
        return np.asarray(memory > 0, np.int64)


@dataclass(frozen=True)
class Majority(_OpponentCountRule):
    """Cooperates unless the opponent defected in more than half of the rounds so far."""

    def reply(self, own_actions: Ints, opponent_actions: Ints) -> Array:
        """Return the opponent's defections minus its cooperations, from the previous count."""
        return own_actions + 2 * opponent_actions - 1

    def choose_next_actions(self, memory: Ints, u: Reals) -> Ints:
        """Return 1, defect, if the opponent has defected more often than not."""
        return np.asarray(memory > 0, np.int64)


REPEATED_GAME_RULES: dict[str, type[CooperateDefectRule]] = {
    "tit-for-tat": TitForTat, "suspicious-tit-for-tat": SuspiciousTitForTat, "grim": Grim,
    "win-stay-lose-shift": WinStayLoseShift, "always-cooperate": AlwaysCooperate,
    "always-defect": AlwaysDefect, "generous-tit-for-tat": GenerousTitForTat,
    "tit-for-two-tats": TitForTwoTats, "two-tits-for-tat": TwoTitsForTat, "majority": Majority,
}  # fmt: skip
