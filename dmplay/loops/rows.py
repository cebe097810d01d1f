"""Many games at once for one learner, who has the same seat in each; agents have the others."""

from collections.abc import Sequence

import numpy as np

from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import ACTION_DECIMALS, Memory, Outcome, Policy, required_fields
from dmplay.dice import NATURE_STREAM
from dmplay.loops.luck import UniformSource
from dmplay.loops.seat import SeatSpaces


class VectorGames:
    """The games; one that is over begins anew with the next turn."""

    def __init__(
        self,
        seat_spaces: SeatSpaces,
        policies: Sequence[Policy | None],
        uniform_source: UniformSource,
        game_count: int,
        limit: int | None,
    ) -> None:
        self.problem, self.seat_spaces, self.uniform_source = (
            seat_spaces.problem,
            seat_spaces,
            uniform_source,
        )
        self._policies = policies
        self._limit = limit
        self._all_rows, self._no_rows = np.arange(game_count), np.zeros(game_count, bool)
        self.reset()

    def reset(self) -> None:
        """Begins a new game in every row."""
        self._turns = np.zeros(len(self._all_rows), np.int64)
        self.done_mask = self._no_rows
        self._state, self._memories, self.observations = self._start_games(self._all_rows)
        self.legal_actions_mask = self.problem.legal_actions_mask(self._state)

    def _start_games(self, rows: Ints) -> tuple[Array, list[Memory], Array]:
        """New games in these rows: states, what the others remember, what the learner sees."""
        problem = self.problem
        self.uniform_source.start_next_episode(rows)
        self._turns[rows] = 0
        state = problem.sample_initial_states(
            self.uniform_source.generate_uniforms(
                NATURE_STREAM, self._turns, problem.uniform_counts.start, rows
            )
        )
        memories: list[Memory] = [
            ()
            if policy is None
            else policy.initial_memory(problem.initial_observation(state, place))
            for place, policy in enumerate(self._policies)
        ]
        first = problem.initial_observation(state, self.seat_spaces.seat)
        return state, memories, self.seat_spaces.encode_observations(first, None)

    def step(self, actions: Array) -> tuple[Reals, Bools, Bools]:
        """Plays a turn by the learner's actions; rewards, and which games are over or cut short."""
        problem, seat = self.problem, self.seat_spaces.seat
        self._turns += 1
        joint = self._joint_actions(actions)
        u = self.uniform_source.generate_uniforms(
            NATURE_STREAM, self._turns, problem.uniform_counts.step, self._all_rows
        )
        outcome = problem.step(self._state, joint, u)
        rewards = outcome.rewards[:, seat] + 0.0
        self._apply_outcome(joint, outcome, rewards)
        if self.done_mask.any():
            self._restart_games(np.flatnonzero(self.done_mask), rewards)
        terminated, truncated = problem.terminal(self._state), self._no_rows
        if self._limit is not None:
            truncated = (self._turns >= self._limit) & ~terminated
        self.done_mask = terminated | truncated
        self.legal_actions_mask = problem.legal_actions_mask(self._state)
        return rewards, terminated, truncated

    def _joint_actions(self, actions: Array) -> Array:
        """The joint actions `[B, n]`: the learner's, and those of the other seats."""
        chosen = [
            actions if policy is None else self._choose_actions(place, policy)
            for place, policy in enumerate(self._policies)
        ]
        joint = np.stack(chosen, axis=1) if len(chosen) > 1 else actions[:, None]
        return np.round(joint, ACTION_DECIMALS) + 0.0 if joint.dtype.kind == "f" else joint

    def _choose_actions(self, seat: int, policy: Policy) -> Array:
        u = self.uniform_source.generate_uniforms(
            1 + seat, self._turns, policy.uniform_count, self._all_rows
        )
        legal = None if self.legal_actions_mask is None else self.legal_actions_mask[:, seat]
        return policy.choose(self._memories[seat], legal, u)

    def _apply_outcome(self, joint: Array, outcome: Outcome, rewards: Reals) -> None:
        """Goes on to what came of the turn; where a move was not legal there was none."""
        state, seen = outcome.state, self._observe(joint, outcome)
        each = enumerate(zip(self._policies, self._memories, strict=True))
        memories = [self._update_memory(place, *who, joint, outcome) for place, who in each]
        if self.legal_actions_mask is not None:
            able = self.legal_actions_mask[
                self._all_rows[:, None], np.arange(joint.shape[1]), joint.astype(int)
            ]
            stuck = np.flatnonzero(~able.all(axis=1))
            self._turns[stuck], rewards[stuck] = self._turns[stuck] - 1, 0.0
            state, seen = (
                _replace_rows(state, stuck, self._state[stuck]),
                _replace_rows(seen, stuck, self.observations[stuck]),
            )
            memories = _replace_memory_rows(
                memories, stuck, [_select_rows(one, stuck) for one in self._memories]
            )
        self._state, self.observations, self._memories = state, seen, memories

    def _update_memory(
        self, seat: int, policy: Policy | None, memory: Memory, joint: Array, outcome: Outcome
    ) -> Memory:
        """What somebody in another seat remembers after a turn."""
        if policy is None:
            return ()
        percept = self.problem.build_percept(seat, joint, outcome, required_fields(policy))
        return policy.update_memory(memory, percept)

    def _observe(self, joint: Array, outcome: Outcome) -> Array:
        hidden, seen = self.problem.partially_observable, outcome.observations
        return self.seat_spaces.encode_observations(
            seen[:, self.seat_spaces.seat] if hidden else seen, joint
        )

    def _restart_games(self, rows: Ints, rewards: Reals) -> None:
        """New games where they were over, which pay nothing yet."""
        state, memories, seen = self._start_games(rows)
        self._state, self.observations = (
            _replace_rows(self._state, rows, state),
            _replace_rows(self.observations, rows, seen),
        )
        self._memories = _replace_memory_rows(self._memories, rows, memories)
        rewards[rows] = 0.0


def _replace_rows(array: Array, rows: Ints, new_values: Array) -> Array:
    """The array with these rows instead."""
    array = array.copy()
    array[rows] = new_values
    return array


def _select_rows(memory: Memory, rows: Ints) -> Memory:
    return tuple(part[rows] for part in memory)


def _replace_memory_rows(
    memories: list[Memory], rows: Ints, new_memories: list[Memory]
) -> list[Memory]:
    """What the others remember, with these rows instead."""
    pairs = zip(memories, new_memories, strict=True)
    return [tuple(_replace_rows(a, rows, b) for a, b in zip(*pair, strict=True)) for pair in pairs]
