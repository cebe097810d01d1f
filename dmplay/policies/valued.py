"""Believers that know what each action is worth, for good or with some turns to go."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, parameter
from dmplay.policies._believing import BeliefAndTurnPolicy, BeliefPolicy, apply_by_group
from dmplay.policies.kinds import GreedyPolicy
from dmplay.solvers.value_iteration import select_greedy_actions

MAX_HORIZON = 1000  # turns that are planned
NEGLIGIBLE_WEIGHT = 1e-12  # weight of a turn from which on a game is worth what it is without end


@dataclass(frozen=True)
class GreedyBeliefPolicy(GreedyPolicy, BeliefPolicy):
    """Takes the first of the actions that are worth most."""


@dataclass(frozen=True)
class FiniteHorizonPolicy(GreedyBeliefPolicy):
    """Plans a number of turns, at least one."""

    horizon: int = parameter(10, "turns planned", 1, MAX_HORIZON)

    def adapt_to_game(self, turns: int | None, rivals: Sequence[str]) -> Self:
        """One that does not look beyond the end."""
        return self if turns is None else replace(self, horizon=min(turns, self.horizon))


@dataclass(frozen=True)
class RemainingHorizonPolicy(BeliefAndTurnPolicy, FiniteHorizonPolicy):
    """Plans the turns that are left of `horizon`; when they are over it starts again.

    The memory is the belief and the number of turns done.
    """

    plans_whole_game = True
    MAX_PLANNED_TURNS = 100  # turns that it can plan in time

    @abstractmethod
    def finite_horizon_values(self, b: Reals, turns_left: int) -> Reals:
        """Q `[B, A]` of beliefs `[B, S]` with so many rewards to come."""

    def best_actions(self, b: Reals, turns_left: int) -> Array:
        """The first of the best actions `[B]`, as of `ahead`."""
        return select_greedy_actions(self.finite_horizon_values(b, turns_left))

    def action_values(self, memory: Memory) -> Reals:
        """Q of each action with the turns that are left."""
        return apply_by_group(memory[0], self._turns_left(memory), self.finite_horizon_values)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The first of the best actions with the turns that are left."""
        return apply_by_group(memory[0], self._turns_left(memory), self.best_actions)

    def _turns_left(self, memory: Memory) -> Ints:
        """The rewards to come `[B]`."""
        return self.horizon - memory[1] % self.horizon

    def adapt_to_game(self, turns: int | None, rivals: Sequence[str]) -> Self:
        """One that plans the whole game, where that can be done in time."""
        if turns is None or turns > self.MAX_PLANNED_TURNS:
            return super().adapt_to_game(turns, rivals)
        return replace(self, horizon=turns)
