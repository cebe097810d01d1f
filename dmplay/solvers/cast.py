"""Who acts in each seat of simulated games: agents with memories of their own, or random play."""

from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise

import numpy as np

from dmplay.chance import Array, Reals
from dmplay.columns import stack_columns
from dmplay.core import Memory, Outcome, Policy, Problem

SeatPolicies = tuple[Policy | None, ...]  # of each seat; None for any action, each as likely


@dataclass(frozen=True)
class OpponentModel:
    """Those who act beside one seat, and in it where it does not choose for itself."""

    problem: Problem
    seat: int
    fixed_policies: SeatPolicies = ()

    @cached_property
    def seat_policies(self) -> SeatPolicies:
        """Who acts in each seat."""
        return self.fixed_policies or (None,) * len(self.problem.agents)

    @cached_property
    def uniform_slices(self) -> tuple[slice, ...]:
        """Which uniforms of a turn are whose: those of each seat, then nature's."""
        each = [1 if one is None else one.uniform_count for one in self.seat_policies]
        each[self.seat] = max(each[self.seat], 1)  # where it chooses they are its own
        ends = np.cumsum([0, *each, self.problem.uniform_counts.step]).tolist()
        return tuple(slice(a, b) for a, b in pairwise(ends))

    @property
    def uniforms_per_turn(self) -> int:
        """How many uniforms a turn consumes."""
        return int(self.uniform_slices[-1].stop)

    @cached_property
    def memory_slices(self) -> list[slice]:
        """Where in what they remember, one after another, each actor's is."""
        ends = np.cumsum(
            [0, *map(len, self.begin_memories(make_start_state(self.problem)))]
        ).tolist()
        return [slice(a, b) for a, b in pairwise(ends)]

    def split_memory(self, memory: Memory) -> tuple[Memory, ...]:
        """What each actor remembers, of what all do."""
        return tuple(memory[part] for part in self.memory_slices)

    def begin_memories(self, s: Array) -> tuple[Memory, ...]:
        """What the actors remember before the first turn of games that begin so."""
        return tuple(
            () if actor is None else actor.initial_memory(self.problem.initial_observation(s, seat))
            for seat, actor in enumerate(self.seat_policies)
        )

    def choose_joint_actions(
        self, s: Array, memories: tuple[Memory, ...], seat_actions: Array | None, u: Reals
    ) -> Array:
        """Joint actions `[N, n]`: the seat's where they are given, else as its actor has it."""
        problem = self.problem
        legal = problem.legal_actions_mask(s)
        chosen: list[Array] = []
        for seat, actor in enumerate(self.seat_policies):
            able = None if legal is None else legal[:, seat]
            now = u[:, self.uniform_slices[seat]]
            if seat == self.seat and seat_actions is not None:
                column = seat_actions
                if able is not None and problem.action_counts[seat]:  # what unlike states share
                    fits = able[np.arange(len(seat_actions)), seat_actions]
                    column = np.where(
                        fits, seat_actions, problem.actions[seat].sample_actions(now[:, 0], able)
                    )
            elif actor is None:
                column = problem.actions[seat].sample_actions(now[:, 0], able)
            else:
                column = actor.choose(memories[seat], able, now[:, : actor.uniform_count])
            chosen.append(column)
        alone = len(chosen) == 1
        joint = chosen[0][:, None] if alone else stack_columns(chosen, np.result_type(*chosen).type)
        if legal is not None and any(self.seat_policies):
            for seat, waits in enumerate(problem.inactive_agents(s).T):
                if waits.any():
                    joint[waits, seat] = problem.wait_action(seat)
        return joint

    def step_states(self, s: Array, joint: Array, u: Reals) -> Outcome:
        """What comes of joint actions."""
        return self.problem.step(s, joint, u[:, self.uniform_slices[-1]])

    def update_memories(
        self, memories: tuple[Memory, ...], joint: Array, outcome: Outcome
    ) -> tuple[Memory, ...]:
        """What the actors remember after a turn."""
        if not any(self.seat_policies):
            return memories
        percept = partial(self.problem.build_percept, actions=joint, outcome=outcome)
        return tuple(
            () if actor is None else actor.update_memory(memory, percept(seat))
            for seat, (actor, memory) in enumerate(zip(self.seat_policies, memories, strict=True))
        )


def make_start_state(problem: Problem) -> Array:
    """Some start state `[1, ...]`."""
    return problem.sample_initial_states(np.zeros((1, problem.uniform_counts.start)))
