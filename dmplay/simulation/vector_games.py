"""Many simultaneous games for one learner in a fixed seat; policies play the other seats."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.policy import Memory, Policy, required_fields
from dmplay.core.problem import (
    Outcome,
    Problem,
    build_percept,
    make_initial_observation,
    validate_outcome,
)
from dmplay.core.spaces import ACTION_DECIMALS
from dmplay.core.uniforms import NATURE_STREAM
from dmplay.simulation.seat_spaces import IllegalActionRule, Info, SeatSpaces, TurnLimit
from dmplay.simulation.uniform_sources import UniformSource

POOLED_STARTS = 256  # starts that are made at once


class VectorGames:
    """A batch of games; a game that is over restarts with the next turn.

    The memories are those of the other seats' policies, and of the learner's observations.
    """

    def __init__(  # noqa: PLR0913, PLR0917 - each is the caller's to choose
        self,
        seat_spaces: SeatSpaces,
        policies: Sequence[Policy | None],
        uniform_source: UniformSource,
        game_count: int,
        limit: TurnLimit,
        illegal_rule: IllegalActionRule,
    ) -> None:
        self.problem = seat_spaces.problem
        self.seat_spaces = seat_spaces
        self.uniform_source = uniform_source
        self._policies = policies
        self._limit, self._illegal_rule = limit, illegal_rule
        self._all_rows, self._no_uniforms = np.arange(game_count), np.zeros((game_count, 0))
        self._start_pool: tuple[Array, list[Memory]] | None = None
        self._used_starts = 0
        self.reset()

    def reset(self) -> None:
        """Begin a new game in every row."""
        self._turns = np.zeros(len(self._all_rows), np.int64)
        # The steps count illegal actions, too; without these, they are the turns.
        is_always_legal = type(self.problem).legal_actions_mask is Problem.legal_actions_mask
        self._steps = self._turns if is_always_legal else self._turns.copy()
        self.done_rows = self._all_rows[:0]
        self._state, self._memories = self._start_games(self._all_rows)
        self.legal_actions_mask = self.problem.legal_actions_mask(self._state)

    def restart(self, rows: Ints) -> None:
        """Begin a new game in these rows only."""
        self._restart_without_rewards(rows, np.zeros(len(self._all_rows)))
        self.done_rows = np.setdiff1d(self.done_rows, rows)
        self.legal_actions_mask = self.problem.legal_actions_mask(self._state)

    def observe(self) -> tuple[Any, Info]:
        """Return the learner's current observations and info, as new arrays."""
        seat_spaces, turns_left = self.seat_spaces, self._limit.steps - self._steps
        memory, legal = self._memories[seat_spaces.seat], self.legal_actions_mask
        info = seat_spaces.make_info(
            None if legal is None else legal[:, seat_spaces.seat], turns_left
        )
        return seat_spaces.encode_memory(memory, self._state, turns_left), info

    def _start_games(self, rows: Ints) -> tuple[Array, list[Memory]]:
        """Begin new games in these rows, and return their states and memories.

        A few starts cost as much as many. Uniforms without episodes therefore make a pool of
        starts, which also serves the next restarts.
        """
        self.uniform_source.start_next_episode(rows)
        self._steps[rows] = 0
        if self._turns is not self._steps:
            self._turns[rows] = 0
        if self.uniform_source.has_episodes or len(rows) >= POOLED_STARTS:
            return self._make_starts(rows)
        end = self._used_starts + len(rows)
        if self._start_pool is None or end > POOLED_STARTS:
            self._start_pool, end = self._make_starts(np.zeros(POOLED_STARTS, int)), len(rows)
        starts, self._used_starts = slice(end - len(rows), end), end
        state, memories = self._start_pool
        return state[starts], [tuple(part[starts] for part in memory) for memory in memories]

    def _make_starts(self, rows: Ints) -> tuple[Array, list[Memory]]:
        """Return the states and memories of new games in these rows."""
        problem, start_count = self.problem, self.problem.uniform_counts.start
        u = self.uniform_source.generate_uniforms(NATURE_STREAM, self._turns, start_count, rows)
        state = problem.sample_initial_states(u)
        return state, [
            (policy or self.seat_spaces).initial_memory(
                make_initial_observation(problem, state, seat)
            )
            for seat, policy in enumerate(self._policies)
        ]

    def step(self, actions: Array) -> tuple[Reals, Bools, Bools]:
        """Play a turn; return the learner's rewards, terminated and truncated masks `[B]`."""
        problem, seat = self.problem, self.seat_spaces.seat
        self._steps += 1
        if self._turns is not self._steps:
            self._turns += 1
        joint, u = self._joint_actions(actions), self._no_uniforms
        if problem.uniform_counts.step:
            u = self.uniform_source.generate_uniforms(
                NATURE_STREAM, self._turns, problem.uniform_counts.step, self._all_rows
            )
        outcome = problem.step(self._state, joint, u)
        validate_outcome(problem, outcome)
        rewards = outcome.rewards[:, seat] + 0.0
        illegal_rows = self._apply_outcome(joint, outcome, rewards)
        if len(self.done_rows):
            self._restart_without_rewards(self.done_rows, rewards)
        terminated = problem.terminal(self._state)
        if self._illegal_rule.ends_episode and len(illegal_rows):
            terminated = terminated.copy()
            terminated[np.setdiff1d(illegal_rows, self.done_rows)] = True
        if self._limit.is_rule:
            terminated = terminated | (self._turns >= self._limit.steps)
        truncated = (self._steps >= self._limit.steps) > terminated
        (self.done_rows,) = (terminated | truncated).nonzero()
        self.legal_actions_mask = problem.legal_actions_mask(self._state)
        return rewards, terminated, truncated

    def _joint_actions(self, actions: Array) -> Array:
        """Return the joint actions `[B, n]` of the learner and the other seats' policies."""
        action_columns = [
            actions if policy is None else self._choose_actions(seat, policy)
            for seat, policy in enumerate(self._policies)
        ]
        joint = np.stack(action_columns, axis=1) if len(action_columns) > 1 else actions[:, None]
        return np.round(joint, ACTION_DECIMALS) + 0.0 if joint.dtype.kind == "f" else joint

    def _choose_actions(self, seat: int, policy: Policy) -> Array:
        """Return the actions `[B]` that a seat's policy chooses."""
        u = self.uniform_source.generate_uniforms(
            1 + seat, self._turns, policy.uniform_count, self._all_rows
        )
        legal = None if self.legal_actions_mask is None else self.legal_actions_mask[:, seat]
        return policy.choose(self._memories[seat], legal, u)

    def _apply_outcome(self, joint: Array, outcome: Outcome, rewards: Reals) -> Ints:
        """Store the outcome of a turn, and return the rows with an illegal action.

        Such a row keeps its state, turn and memories, and is paid as the rule says.
        """
        illegal_rows = np.zeros(0, np.int64)
        state = outcome.state
        numbered_memories = enumerate(zip(self._policies, self._memories, strict=True))
        memories = [
            self._update_memory(seat, *policy_and_memory, joint, outcome)
            for seat, policy_and_memory in numbered_memories
        ]
        if self.legal_actions_mask is not None:
            seats, actions = np.arange(joint.shape[1]), joint.astype(int)
            is_legal = self.legal_actions_mask[self._all_rows[:, None], seats, actions]
            illegal_rows = np.flatnonzero(~is_legal.all(axis=1))
            self._turns[illegal_rows] -= 1
            rewards[illegal_rows] = self._illegal_rule.reward
            state = _replace_rows(state, illegal_rows, self._state[illegal_rows])
            old_memories = [
                tuple(part[illegal_rows] for part in memory) for memory in self._memories
            ]
            memories = _replace_memory_rows(memories, illegal_rows, old_memories)
        self._state, self._memories = state, memories
        return illegal_rows

    def _update_memory(
        self, seat: int, policy: Policy | None, memory: Memory, joint: Array, outcome: Outcome
    ) -> Memory:
        """Return the memory `[B]` of a seat after a turn."""
        if policy is None and not memory:
            return memory
        follower = policy or self.seat_spaces
        percept = build_percept(self.problem, seat, joint, outcome, required_fields(follower))
        return follower.update_memory(memory, percept)

    def _restart_without_rewards(self, rows: Ints, rewards: Reals) -> None:
        """Restart the games in these rows and set their rewards to 0."""
        state, memories = self._start_games(rows)
        self._state = _replace_rows(self._state, rows, state)
        self._memories = _replace_memory_rows(self._memories, rows, memories)
        rewards[rows] = 0.0


def _replace_rows(array: Array, rows: Ints, new_values: Array) -> Array:
    """Return a copy of the array, in the same layout, with these rows replaced."""
    array = array.copy(order="K")
    array[rows] = new_values
    return array


def _replace_memory_rows(
    memories: list[Memory], rows: Ints, new_memories: list[Memory]
) -> list[Memory]:
    """Return the memories of all seats with these rows replaced."""
    if not any(memories):  # of one agent that sees the state
        return memories
    pairs = zip(memories, new_memories, strict=True)
    return [tuple(_replace_rows(a, rows, b) for a, b in zip(*pair, strict=True)) for pair in pairs]
