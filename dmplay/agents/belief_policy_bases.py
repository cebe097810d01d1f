"""Belief policies that know the value of each action, for an infinite horizon or the turns left."""

from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import Self

from dmplay.agents.base import AdviceQuestion, GreedyPolicy
from dmplay.agents.belief_policy import BeliefAndTurnPolicy, BeliefPolicy, apply_by_group
from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.best_actions import select_greedy_actions
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory
from dmplay.core.text import format_count

MAX_HORIZON = 1000  # maximum number of turns that are planned
NEGLIGIBLE_WEIGHT = 1e-12  # discount**turns below which the end of a game is ignored


@dataclass(frozen=True)
class GreedyBeliefPolicy(GreedyPolicy, BeliefPolicy):
    """A belief policy that takes the first of the actions with the greatest value."""


@dataclass(frozen=True)
class FiniteHorizonPolicy(GreedyBeliefPolicy):
    """A policy that plans a fixed number of turns, at least one."""

    horizon: int = parameter(10, "number of turns planned", 1, MAX_HORIZON)

    def adapt_to_game(self, question: AdviceQuestion) -> Self:
        """Return a policy that does not plan beyond the end of the game."""
        turns = question.turn_limit
        return self if turns is None else replace(self, horizon=min(turns, self.horizon))

    def describe_scope(self, turns: int | None) -> str:
        """Return the number of turns it plans ahead in every turn, of which fewer may be left."""
        return "" if turns == 1 else f"{format_count(self.horizon, 'turn')} ahead"


@dataclass(frozen=True)
class RemainingHorizonPolicy(BeliefAndTurnPolicy, FiniteHorizonPolicy):
    """A policy that plans the turns left of `horizon`, and after these starts again.

    The memory is the belief and the number of turns done.
    """

    plans_whole_game = True
    MAX_PLANNED_TURNS = 100  # turns that it can plan in time

    @property
    def planned_turns(self) -> int:
        """The number of turns of a plan; after these it begins again."""
        return self.horizon

    @abstractmethod
    def finite_horizon_values(self, b: Reals, turns_left: int) -> Reals:
        """Return Q `[B, A]` of beliefs `[B, S]` with `turns_left` rewards to come."""

    def best_actions(self, b: Reals, turns_left: int) -> Array:
        """Return the first of the best actions `[B]` by `finite_horizon_values`."""
        q = self.finite_horizon_values(b, turns_left)
        return select_greedy_actions(q, self.problem.reward_scale)

    def action_values(self, memory: Memory) -> Reals:
        """Return Q of each action with the turns left."""
        return apply_by_group(memory[0], self._turns_left(memory), self.finite_horizon_values)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the first of the best actions with the turns left."""
        return apply_by_group(memory[0], self._turns_left(memory), self.best_actions)

    def _turns_left(self, memory: Memory) -> Ints:
        """Return the number of rewards to come `[B]`."""
        return self.horizon - memory[1] % self.horizon

    def adapt_to_game(self, question: AdviceQuestion) -> Self:
        """Return a policy that plans the whole game, if that is possible in time."""
        turns = question.turn_limit
        if turns is None or turns > self.MAX_PLANNED_TURNS:
            return super().adapt_to_game(question)
        return replace(self, horizon=turns)

    def describe_scope(self, turns: int | None) -> str:
        """Return the number of turns that it plans at a time if it is not that of the game."""
        return "" if turns == self.horizon else describe_plan_length(self.horizon)


def describe_plan_length(turns: int) -> str:
    """Return the scope of values of a plan that begins again after `turns` turns."""
    return f"in plans of {format_count(turns, 'turn')}"
