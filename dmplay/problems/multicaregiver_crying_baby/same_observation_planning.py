"""Joint plans of two agents that make the same observations."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from dmplay.agents.base import AdviceQuestion, SeatPolicy
from dmplay.agents.belief_policy import SparseTransition, apply_by_group
from dmplay.core import belief
from dmplay.core.action_values import Accuracy, Horizon, ValuesBasis
from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.best_actions import select_greedy_actions
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory, Percept
from dmplay.core.tabular import joint_actions, tabulate
from dmplay.solvers.decpomdp import joint_plan_dynamic_programming
from dmplay.solvers.pomdp import exact_pomdp
from dmplay.solvers.pomdp.upper_envelope import compute_upper_envelope

MAX_PLAN_TURNS = 4  # With five turns there are too many plans to compare.


@dataclass(frozen=True)
class SharedObservationPlan(SeatPolicy):
    """Follows the joint plan of `horizon` turns with the most total reward; replans every turn.

    Both agents observe the same, so each knows the other's belief and plan. The values are the
    sum of both rewards over these turns.
    """

    horizon: int = parameter(
        MAX_PLAN_TURNS, f"number of turns planned, 1 to {MAX_PLAN_TURNS}", 1, MAX_PLAN_TURNS
    )

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return estimated values of the turns it plans ahead, of which fewer may be left."""
        basis = super().values_basis(question)
        return basis._replace(
            accuracy=Accuracy.ESTIMATED,
            horizon=Horizon.AHEAD,
            horizon_turns=self.horizon,
            method="joint plan that both agents follow, for the sum of their rewards",
        )

    def __post_init__(self) -> None:
        """Raise an error for a horizon out of bounds, or with too many plans."""
        super().__post_init__()
        _ = self._alpha_vectors  # raises an error if there are too many plans

    @cached_property
    def _joint_actions(self) -> Ints:
        """All joint actions `[A, 2]`."""
        return joint_actions(self.problem)

    @cached_property
    def _alpha_vectors(self) -> list[Reals]:
        """The values `[N, S]` of pairs of plans in each state, by their first joint action."""
        stage = joint_plan_dynamic_programming.build_unpruned_stage(self.problem, self.horizon)
        vectors = []
        for a, b in self._joint_actions:
            first = stage.plans_by_agent[0].first_actions == a
            second = stage.plans_by_agent[1].first_actions == b
            pair_values = stage.pair_values[:, first][:, :, second]
            pair_values = pair_values.reshape(len(pair_values), -1).T
            vectors.append(pair_values[compute_upper_envelope(pair_values).needed_vectors])
        return vectors

    @cached_property
    def _belief_filter(self) -> "PartnerBeliefFilter":
        """The belief filter, by own action, the partner's action and the observation."""
        tables = tabulate(self.problem)
        observation_count = self.problem.observation_counts[self.seat]
        own_observations = tables.observation_model.reshape(
            *tables.observation_model.shape[:2], -1, observation_count
        ).sum(axis=3 - self.seat)
        joint = tables._replace(observation=own_observations).joint_probabilities
        joint = joint.transpose(1, 2, 0, 3)
        expected = joint.reshape(*self.problem.action_counts, *joint.shape[1:])
        if self.seat == 1:
            expected = expected.swapaxes(0, 1)
        fallback = np.broadcast_to(expected.mean(axis=1, keepdims=True), expected.shape)
        return PartnerBeliefFilter.from_arrays(expected, fallback)

    def initial_memory(self, observation: Array) -> Memory:
        """Return the initial belief, and the joint action that both agents take first."""
        b = belief.initial_belief(self.problem)
        return self._make_plan_memory(np.tile(b, (len(observation), 1)))

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the belief after a turn, by Bayes' rule, and the next joint action.

        The partner is taken to follow its plan or, if the observation rules that out, to act at
        random.
        """
        b, planned_actions = memory
        turn = percept.action, planned_actions[:, 1 - self.seat], percept.observation
        return self._make_plan_memory(self._belief_filter.update_beliefs(b, turn))

    def _make_plan_memory(self, b: Reals) -> Memory:
        """Return beliefs with the first best joint action `[B, 2]`, the same for both seats."""
        best = select_greedy_actions(self._joint_action_values(b), self.problem.reward_scale)
        return b, self._joint_actions.take(best, axis=0)

    def _joint_action_values(self, b: Reals) -> Reals:
        """Return Q `[B, joint actions]` of beliefs `[B, S]`."""
        b = np.asfortranarray(b)  # converted to state by state once, for all vectors
        sets = self._alpha_vectors
        return np.stack([exact_pomdp.compute_belief_values(vectors, b) for vectors in sets]).T

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the seat's own part of the best joint action."""
        return memory[1][:, self.seat]

    def action_values(self, memory: Memory) -> Reals:
        """Return Q of each action, with the partner's best action."""
        q = self._joint_action_values(memory[0]).reshape(-1, *self.problem.action_counts)
        return np.asarray(q.max(axis=2 - self.seat))


class PartnerBeliefFilter(NamedTuple):
    """A belief filter by the expected partner or, if the observation rules that out, by another.

    A turn consists of indices for the actions and the observation; `turn_shape` has their sizes.
    """

    turn_shape: tuple[int, ...]
    expected: tuple[SparseTransition, ...]  # of each turn, row-major
    fallback: tuple[SparseTransition, ...]

    @classmethod
    def from_arrays(cls, expected: Reals, fallback: Reals) -> "PartnerBeliefFilter":
        """Return a filter from the probabilities of each turn and next state, `[..., S, S']`."""
        *sizes, state_count, _ = expected.shape
        tables = (table.reshape(-1, state_count, state_count) for table in (expected, fallback))
        return cls(
            tuple(sizes), *(tuple(map(SparseTransition.from_dense, table)) for table in tables)
        )

    def update_beliefs(self, b: Reals, turn: Sequence[Ints]) -> Reals:
        """Return the beliefs `[B, S]` after a turn, whose indices are `[B]` each."""
        turn_index, *remaining = turn
        for size, index in zip(self.turn_shape[1:], remaining, strict=True):
            turn_index = turn_index * size + index
        return apply_by_group(b, turn_index, self._update_rows)

    def _update_rows(self, beliefs: Reals, turn_index: int) -> Reals:
        """Return the beliefs after the turn with this index."""
        expected, fallback = self.expected[turn_index], self.fallback[turn_index]
        posterior, likelihood = belief.apply_bayes_rule(expected.propagate(beliefs))
        ruled_out = np.flatnonzero(likelihood == 0.0)
        if len(ruled_out):
            next_states = fallback.propagate(beliefs[ruled_out])
            posterior[ruled_out] = belief.apply_bayes_rule(next_states).belief
        return posterior
