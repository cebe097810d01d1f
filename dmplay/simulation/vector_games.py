"""Many simultaneous games for one learner in a fixed seat; policies play the other seats."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.policy import Memory, Policy, required_fields
from dmplay.core.problem import Outcome, build_percept, make_initial_observation, validate_outcome
from dmplay.core.spaces import ACTION_DECIMALS
from dmplay.core.uniforms import NATURE_STREAM
from dmplay.simulation.seat_spaces import IllegalActionRule, SeatSpaces
from dmplay.simulation.uniform_sources import UniformSource


class VectorGames:
    """A batch of games; a game that is over restarts with the next turn."""

    def __init__(  # noqa: PLR0913, PLR0917 - each is the caller's to choose
        self,
        seat_spaces: SeatSpaces,
        policies: Sequence[Policy | None],
        uniform_source: UniformSource,
        game_count: int,
        limit: int,
        illegal_rule: IllegalActionRule,
    ) -> None:
        self.problem = seat_spaces.problem
        self.seat_spaces = seat_spaces
        self.uniform_source = uniform_source
        self._policies = policies
        self._limit, self._illegal_rule = limit, illegal_rule
        self._all_rows, self._no_rows = np.arange(game_count), np.zeros(game_count, bool)
        self.reset()

    def reset(self) -> None:
        """Begin a new game in every row."""
        self._turns = np.zeros(len(self._all_rows), np.int64)
        self._steps = np.zeros(len(self._all_rows), np.int64)  # with those of illegal actions
        self.done_mask = self._no_rows
        self._state, self._memories, self.observations = self._start_games(self._all_rows)
        self.legal_actions_mask = self.problem.legal_actions_mask(self._state)

    def restart(self, rows: Ints) -> None:
        """Begin a new game in these rows only."""
        self._restart_without_rewards(rows, np.zeros(len(self._all_rows)))
        self.done_mask = self.done_mask.copy()
        self.done_mask[rows] = False
        self.legal_actions_mask = self.problem.legal_actions_mask(self._state)

    def _start_games(self, rows: Ints) -> tuple[Array, list[Memory], Array]:
        """Begin new games in these rows.

        Returns the states, the memories of the other seats' policies and the learner's
        observations.
        """
        problem = self.problem
        self.uniform_source.start_next_episode(rows)
        self._turns[rows] = self._steps[rows] = 0
        start_count = problem.uniform_counts.start
        u = self.uniform_source.generate_uniforms(NATURE_STREAM, self._turns, start_count, rows)
        state = problem.sample_initial_states(u)
        observe = partial(make_initial_observation, problem, state)
        memories: list[Memory] = [
            () if policy is None else policy.initial_memory(observe(seat))
            for seat, policy in enumerate(self._policies)
        ]
        first_observation = observe(self.seat_spaces.seat)
        return state, memories, self.seat_spaces.encode_observations(first_observation, None)

    def step(self, actions: Array) -> tuple[Reals, Bools, Bools]:
        """Play a turn; return the learner's rewards, terminated and truncated masks `[B]`."""
        problem, seat = self.problem, self.seat_spaces.seat
        self._turns += 1
        self._steps += 1
        joint = self._joint_actions(actions)
        u = self.uniform_source.generate_uniforms(
            NATURE_STREAM, self._turns, problem.uniform_counts.step, self._all_rows
        )
        outcome = problem.step(self._state, joint, u)
        validate_outcome(problem, outcome)
        rewards = outcome.rewards[:, seat] + 0.0
        illegal_rows = self._apply_outcome(joint, outcome, rewards)
        was_done = self.done_mask
        if self.done_mask.any():
            self._restart_without_rewards(np.flatnonzero(self.done_mask), rewards)
        terminated = problem.terminal(self._state)
        if self._illegal_rule.ends_episode and len(illegal_rows):
            terminated = terminated.copy()
            terminated[illegal_rows] |= ~was_done[illegal_rows]
        truncated = (self._steps >= self._limit) & ~terminated
        self.done_mask = terminated | truncated
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
        state, observations = outcome.state, self._observe(joint, outcome)
        numbered_policies = enumerate(zip(self._policies, self._memories, strict=True))
        memories = [
            self._update_memory(seat, *policy_and_memory, joint, outcome)
            for seat, policy_and_memory in numbered_policies
        ]
        if self.legal_actions_mask is not None:
            seats, actions = np.arange(joint.shape[1]), joint.astype(int)
            is_legal = self.legal_actions_mask[self._all_rows[:, None], seats, actions]
            illegal_rows = np.flatnonzero(~is_legal.all(axis=1))
            self._turns[illegal_rows] -= 1
            rewards[illegal_rows] = self._illegal_rule.reward
            state = _replace_rows(state, illegal_rows, self._state[illegal_rows])
            old_observations = self.observations[illegal_rows]
            observations = _replace_rows(observations, illegal_rows, old_observations)
            old_memories = [
                tuple(part[illegal_rows] for part in memory) for memory in self._memories
            ]
            memories = _replace_memory_rows(memories, illegal_rows, old_memories)
        self._state, self.observations, self._memories = state, observations, memories
        return illegal_rows

    def _update_memory(
        self, seat: int, policy: Policy | None, memory: Memory, joint: Array, outcome: Outcome
    ) -> Memory:
        """Return the memory `[B]` of a seat's policy after a turn; empty for the learner."""
        if policy is None:
            return ()
        percept = build_percept(self.problem, seat, joint, outcome, required_fields(policy))
        return policy.update_memory(memory, percept)

    def _observe(self, joint: Array, outcome: Outcome) -> Array:
        """Return the learner's encoded observations after a turn."""
        is_hidden, observations = self.problem.partially_observable, outcome.observations
        return self.seat_spaces.encode_observations(
            observations[:, self.seat_spaces.seat] if is_hidden else observations, joint
        )

    def _restart_without_rewards(self, rows: Ints, rewards: Reals) -> None:
        """Restart the games in these rows and set their rewards to 0."""
        state, memories, observations = self._start_games(rows)
        self._state = _replace_rows(self._state, rows, state)
        self.observations = _replace_rows(self.observations, rows, observations)
        self._memories = _replace_memory_rows(self._memories, rows, memories)
        rewards[rows] = 0.0


def _replace_rows(array: Array, rows: Ints, new_values: Array) -> Array:
    """Return a copy of the array with these rows replaced."""
    array = array.copy()
    array[rows] = new_values
    return array


def _replace_memory_rows(
    memories: list[Memory], rows: Ints, new_memories: list[Memory]
) -> list[Memory]:
    """Return the memories of all seats with these rows replaced."""
    pairs = zip(memories, new_memories, strict=True)
    return [tuple(_replace_rows(a, rows, b) for a, b in zip(*pair, strict=True)) for pair in pairs]
