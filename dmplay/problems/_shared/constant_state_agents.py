"""Policies for a hidden state that never changes and is learned from the outcomes of actions."""

from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property
from itertools import count

import numpy as np

from dmplay.agents.base import AdviceQuestion
from dmplay.agents.belief_policy import BeliefPolicy, GreedyBeliefPolicy
from dmplay.agents.horizon import MAX_HORIZON, HorizonPolicy
from dmplay.algorithms.thompson import sample_best_actions
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.best_actions import select_greedy_actions
from dmplay.core.chance import weighted_sum
from dmplay.core.memoization import memoize
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory
from dmplay.core.problem import Problem
from dmplay.core.tabular import tabulate
from dmplay.solvers.pomdp.bounded_search import BoundedSearch


@dataclass(frozen=True)
class Greedy(GreedyBeliefPolicy):
    """Takes the action with the highest expected reward of this turn."""

    @cached_property
    def _rewards(self) -> Reals:
        """The expected reward `[S, A]` of each action in each hidden state."""
        return tabulate(self.problem).rewards[:, :, 0]

    def action_values(self, memory: Memory) -> Reals:
        """Return the expected reward of each action this turn."""
        return weighted_sum(memory[0], self._rewards)


@dataclass(frozen=True)
class ThompsonSampling(BeliefPolicy):
    """Samples a state from its belief and takes the best action for that state."""

    uniform_count = 1  # for the state

    @cached_property
    def _best_actions(self) -> Ints:
        """The first of the best actions for each state."""
        return select_greedy_actions(tabulate(self.problem).rewards[:, :, 0])

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the best actions for sampled states (Thompson sampling, section 15.4)."""
        return sample_best_actions(memory[0], self._best_actions, u)


@dataclass(frozen=True)
class Optimal(HorizonPolicy, GreedyBeliefPolicy):
    """Takes the best action for its belief and the turns left, by exact search."""

    horizon: int = parameter(10, "number of turns planned", 1, MAX_HORIZON)

    plans_whole_game = True
    repeats_plan = True
    max_planned_turns = 20

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return exact values."""
        return super().values_basis(question)._replace(accuracy=Accuracy.EXACT)

    @cached_property
    def _q_cache(self) -> dict[int, dict[bytes, Reals]]:
        """Q-values computed so far, by the turns left, then by the belief."""
        return {}

    def values_with_turns_left(self, info_state: Reals, turns_left: int | None) -> Reals:
        """Return Q `[B, A]` of beliefs `[B, S]` with these rewards to come."""
        q, inverse = self._find_or_compute_values(info_state, turns_left)
        return q.take(inverse, axis=0)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the first of the best actions, computed once for each distinct belief."""

        def choose_best(b: Reals, turns_left: int | None) -> Array:
            """Return the actions `[B]` with these turns left."""
            q, inverse = self._find_or_compute_values(b, turns_left)
            return select_greedy_actions(q).take(inverse)

        return self.apply_by_turns_left(choose_best, memory)

    def _find_or_compute_values(self, b: Reals, turns_left: int | None) -> tuple[Reals, Ints]:
        """Return Q `[K, A]` of the K distinct beliefs, and the index `[B]` of each row's belief.

        A belief that was looked up before is not searched again.
        """
        assert turns_left is not None
        cache = self._q_cache.setdefault(turns_left, {})
        keys = np.ascontiguousarray(b).view(f"V{b.shape[1] * b.itemsize}")[:, 0].tolist()
        indices = defaultdict[bytes, int](count().__next__)
        inverse = np.fromiter(map(indices.__getitem__, keys), np.int64, len(keys))
        if new_keys := [key for key in indices if key not in cache]:
            beliefs = np.frombuffer(b"".join(new_keys)).reshape(len(new_keys), -1)
            new_q = _build_search(self.problem).compute_action_values(beliefs, turns_left)
            cache.update(zip(new_keys, new_q, strict=True))
        return np.array([cache[key] for key in indices]), inverse


@memoize
def _build_search(problem: Problem) -> BoundedSearch:
    """Return the bounded search of a problem."""
    return BoundedSearch(tabulate(problem), problem.discount)
