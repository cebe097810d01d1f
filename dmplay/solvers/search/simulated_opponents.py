"""A model of the seats of simulated games: policies with memories, or uniformly random play."""

from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise

import numpy as np

from dmplay.core.arrays import Array, Reals
from dmplay.core.policy import Memory, Policy
from dmplay.core.problem import (
    Outcome,
    Problem,
    build_percept,
    find_wait_action,
    make_initial_observation,
    mark_inactive_agents,
)

SeatPolicies = tuple[Policy | None, ...]  # indexed by seat; None plays uniformly at random


@dataclass(frozen=True)
class OpponentModel:
    """The policies of the other seats, and of the own seat when its actions are not given."""

    problem: Problem
    seat: int
    fixed_policies: SeatPolicies = ()

    @cached_property
    def seat_policies(self) -> SeatPolicies:
        """The policy of each seat, None for uniformly random play."""
        return self.fixed_policies or (None,) * len(self.problem.agents)

    @cached_property
    def uniform_slices(self) -> tuple[slice, ...]:
        """The slices of a turn's uniforms used by each seat, then by nature."""
        counts = [1 if policy is None else policy.uniform_count for policy in self.seat_policies]
        # The seat has at least one uniform, also when its actions are given.
        counts[self.seat] = max(counts[self.seat], 1)
        ends = np.cumsum([0, *counts, self.problem.uniform_counts.step]).tolist()
        return tuple(slice(a, b) for a, b in pairwise(ends))

    @property
    def uniforms_per_turn(self) -> int:
        """The number of uniforms that a turn consumes."""
        return int(self.uniform_slices[-1].stop)

    @cached_property
    def memory_slices(self) -> list[slice]:
        """The slice of each seat's memory in the concatenated memories."""
        memories = self.begin_memories(make_start_state(self.problem))
        ends = np.cumsum([0, *map(len, memories)]).tolist()
        return [slice(a, b) for a, b in pairwise(ends)]

    def split_memory(self, memory: Memory) -> tuple[Memory, ...]:
        """Return the memory of each seat, split from the concatenated memories."""
        return tuple(memory[part] for part in self.memory_slices)

    def begin_memories(self, s: Array) -> tuple[Memory, ...]:
        """Return the memory of each seat before the first turn, given the start states."""
        observe = partial(make_initial_observation, self.problem, s)
        return tuple(
            policy.initial_memory(observe(seat)) if policy else ()
            for seat, policy in enumerate(self.seat_policies)
        )

    def choose_joint_actions(
        self, s: Array, memories: tuple[Memory, ...], seat_actions: Array | None, u: Reals
    ) -> Array:
        """Return joint actions `[N, n]`, with the seat's own actions if they are given.

        A given action that is illegal in a state is replaced by a random legal one. Inactive agents
        wait if any seat has a policy.
        """
        problem = self.problem
        legal_mask = problem.legal_actions_mask(s)
        columns: list[Array] = []
        for seat, policy in enumerate(self.seat_policies):
            seat_legal = None if legal_mask is None else legal_mask[:, seat]
            seat_uniforms = u[:, self.uniform_slices[seat]]
            if seat == self.seat and seat_actions is not None:
                actions = seat_actions
                # different states may share one action
                if seat_legal is not None and problem.action_counts[seat]:
                    is_legal = seat_legal[np.arange(len(seat_actions)), seat_actions]
                    sampled = problem.actions[seat].sample_actions(seat_uniforms[:, 0], seat_legal)
                    actions = np.where(is_legal, seat_actions, sampled)
            elif policy is None:
                actions = problem.actions[seat].sample_actions(seat_uniforms[:, 0], seat_legal)
            else:
                policy_uniforms = seat_uniforms[:, : policy.uniform_count]
                actions = policy.choose(memories[seat], seat_legal, policy_uniforms)
            columns.append(actions)
        is_single = len(columns) == 1
        joint = columns[0][:, None] if is_single else np.stack(columns, axis=1)
        if legal_mask is not None and any(self.seat_policies):
            for seat, is_inactive in enumerate(mark_inactive_agents(problem, s).T):
                if is_inactive.any():
                    joint[is_inactive, seat] = find_wait_action(problem, seat)
        return joint

    def step_states(self, s: Array, joint: Array, u: Reals) -> Outcome:
        """Return the outcome of joint actions; uses nature's uniforms of the turn."""
        return self.problem.step(s, joint, u[:, self.uniform_slices[-1]])

    def update_memories(
        self, memories: tuple[Memory, ...], joint: Array, outcome: Outcome
    ) -> tuple[Memory, ...]:
        """Return the memory of each seat after a turn."""
        if not any(self.seat_policies):
            return memories
        percept = partial(build_percept, self.problem, actions=joint, outcome=outcome)
        return tuple(
            () if policy is None else policy.update_memory(memory, percept(seat))
            for seat, (policy, memory) in enumerate(zip(self.seat_policies, memories, strict=True))
        )


def make_start_state(problem: Problem) -> Array:
    """Return one possible start state `[1, ...]`, that of uniforms of 0."""
    return problem.sample_initial_states(np.zeros((1, problem.uniform_counts.start)))
