"""Plans of two agents who hear the same."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from dmplay import belief
from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, Percept, parameter
from dmplay.policies._believing import SparseTransition, apply_by_group
from dmplay.policies.kinds import SeatPolicy
from dmplay.solvers import alpha_vectors, joint_plans
from dmplay.solvers.envelope import compute_upper_envelope
from dmplay.solvers.value_iteration import select_greedy_actions
from dmplay.tabular import joint_actions, tabulate

MAX_PLAN_TURNS = 4  # turns of a joint plan: with five there are too many to compare


@dataclass(frozen=True)
class SharedObservationPlan(SeatPolicy):
    """Follows the plans of `horizon` turns that together earn both most, made anew every turn.

    Both hear the same, so each knows what the other believes and plans. The values are the sum of
    both rewards over these turns.
    """

    horizon: int = parameter(
        MAX_PLAN_TURNS, f"turns planned, 1 to {MAX_PLAN_TURNS}", 1, MAX_PLAN_TURNS
    )

    def __post_init__(self) -> None:
        """Refuses more turns than it can plan."""
        super().__post_init__()
        _ = self._alpha_vectors  # refuses a game of too many plans

    @cached_property
    def _joint_actions(self) -> Ints:
        """Every joint action `[A, 2]`."""
        return joint_actions(self.problem)

    @cached_property
    def _alpha_vectors(self) -> list[Reals]:
        """What pairs of plans are worth from each state `[N, S]`, by their first joint action."""
        stage = joint_plans.build_unpruned_stage(self.problem, self.horizon)
        found = []
        for a, b in self._joint_actions:
            first, second = (
                stage.plans_by_agent[0].first_actions == a,
                stage.plans_by_agent[1].first_actions == b,
            )
            worth = stage.pair_values[:, first][:, :, second].reshape(len(stage.pair_values), -1).T
            found.append(worth[compute_upper_envelope(worth).needed_vectors])
        return found

    @cached_property
    def _belief_filter(self) -> "PartnerBeliefFilter":
        """By one's own action, the other's and what is heard."""
        tables = tabulate(self.problem)
        kinds = self.problem.observation_counts[self.seat]
        own = tables.observation_model.reshape(*tables.observation_model.shape[:2], -1, kinds).sum(
            axis=3 - self.seat
        )
        both = tables._replace(observation=own).joint_probabilities.transpose(1, 2, 0, 3)
        shaped: Reals = both.reshape(*self.problem.action_counts, *both.shape[1:])
        foreseen = shaped if self.seat == 0 else shaped.swapaxes(0, 1)
        anything = np.broadcast_to(foreseen.mean(axis=1, keepdims=True), foreseen.shape)
        return PartnerBeliefFilter.from_arrays(foreseen, anything)

    def initial_memory(self, observation: Array) -> Memory:
        """What both believe, the distribution of the start state, and do."""
        return self._make_memory(
            np.tile(belief.initial_belief(self.problem), (len(observation), 1))
        )

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Bayes' rule beside the partner's plan; where that is ruled out, beside a random one."""
        b, planned = memory
        turn = percept.action, planned[:, 1 - self.seat], percept.observation
        return self._make_memory(self._belief_filter.update_beliefs(b, turn))

    def _make_memory(self, b: Reals) -> Memory:
        """Beliefs, and the first of the best joint actions `[B, 2]`, the same for both seats."""
        return b, self._joint_actions.take(
            select_greedy_actions(self._joint_action_values(b)), axis=0
        )

    def _joint_action_values(self, b: Reals) -> Reals:
        """Q `[B, joint actions]` of beliefs `[B, S]`."""
        b = np.asfortranarray(b)  # state by state, once
        return np.stack(
            [alpha_vectors.compute_belief_values(vectors, b) for vectors in self._alpha_vectors]
        ).T

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """One's own part of the best joint action."""
        return memory[1][:, self.seat]

    def action_values(self, memory: Memory) -> Reals:
        """Q of each action beside the partner's best one."""
        q = self._joint_action_values(memory[0]).reshape(-1, *self.problem.action_counts)
        return np.asarray(q.max(axis=2 - self.seat))


class PartnerBeliefFilter(NamedTuple):
    """What turns teach beside a foreseen partner or, where this rules out what was seen, another.

    A turn is some numbers, of so many each: what was done and seen.
    """

    turn_shape: tuple[int, ...]
    expected: tuple[SparseTransition, ...]  # of each turn, row-major
    fallback: tuple[SparseTransition, ...]

    @classmethod
    def from_arrays(cls, expected: Reals, fallback: Reals) -> "PartnerBeliefFilter":
        """By how likely a turn leads from each state to the next, `[..., S, S']`."""
        *many, size, _ = expected.shape
        both = (each.reshape(-1, size, size) for each in (expected, fallback))
        return cls(tuple(many), *(tuple(map(SparseTransition.from_dense, each)) for each in both))

    def update_beliefs(self, b: Reals, turn: Sequence[Ints]) -> Reals:
        """The beliefs `[B, S]` after a turn, each part of it `[B]`."""
        place, *rest = turn
        for many, part in zip(self.turn_shape[1:], rest, strict=True):
            place = place * many + part
        return apply_by_group(b, place, self._update_rows)

    def _update_rows(self, beliefs: Reals, turn_index: int) -> Reals:
        after, likelihood = belief.apply_bayes_rule(self.expected[turn_index].propagate(beliefs))
        out = np.flatnonzero(likelihood == 0.0)
        if len(out):
            after[out] = belief.apply_bayes_rule(
                self.fallback[turn_index].propagate(beliefs[out])
            ).belief
        return after
