"""The parts of a seat's observation for reinforcement-learning libraries, and their spaces."""

from abc import ABC
from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from gymnasium import spaces

from dmplay.core.arrays import Array, Ints
from dmplay.core.policy import GameFollower, Memory, Percept
from dmplay.core.problem import Problem
from dmplay.core.spaces import Interval, Labels, RealVector, TextLine
from dmplay.errors import BadParameter, UnknownName

Space = spaces.Space[Any]
OBSERVED_PARTS = ("observation", "belief", "history", "state", "turns")
MAX_HISTORY_TURNS = 1000  # all rows of an observed history exist from the start
TEXT_OBSERVATION_MESSAGE = "the observation is text, which has no Gymnasium space"


class ObservedPart(ABC):
    """A part of the observation: its space, and its values in many games.

    Unless a subclass overrides them, its memory is one array, which is also the observation.
    """

    space: Space
    memory_size = 1  # arrays of the memory

    def initial_memory(self, observation: Array) -> Memory:
        """Return the memory before the first turn."""
        return ()

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the memory after a turn."""
        return ()

    def encode(self, memory: Memory, state: Array, turns_left: Ints) -> Array:
        """Return the current values `[B, ...]` of the space, as a new array."""
        return memory[0].copy(order="K")


class CurrentState(ObservedPart):
    """The state of the problem, also if it is hidden from the seat."""

    memory_size = 0

    def __init__(self, problem: Problem) -> None:
        self.space = make_state_space(problem)

    def encode(self, memory: Memory, state: Array, turns_left: Ints) -> Array:
        """Return the states `[B, ...]`, in the same layout."""
        return state.astype(cast("Any", self.space.dtype), order="K")


class TurnsLeft(ObservedPart):
    """The number of steps until the limit of an episode."""

    memory_size = 0

    def __init__(self, turns: int) -> None:
        self.space = spaces.Box(0, turns, (1,), np.int64)

    def encode(self, memory: Memory, state: Array, turns_left: Ints) -> Array:
        """Return the turns left `[B, 1]`."""
        return turns_left[:, None].copy()


class LastObservation(ObservedPart):
    """The last observation of a hidden state; labels have one more index for none yet."""

    def __init__(self, observations: Labels | RealVector | TextLine) -> None:
        self._observations = observations
        if isinstance(observations, Labels):
            self.space = spaces.Discrete(len(observations) + 1)
        elif isinstance(observations, RealVector):
            self.space = spaces.Box(-np.inf, np.inf, observations.shape, np.float64)
        else:
            raise BadParameter(TEXT_OBSERVATION_MESSAGE)

    def initial_memory(self, observation: Array) -> Memory:
        """Return the observations as values of the space."""
        if isinstance(self._observations, Labels):
            return (np.where(observation < 0, len(self._observations), observation),)
        return (np.nan_to_num(observation),)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the new observations as values of the space."""
        return self.initial_memory(percept.observation)


class LastJointAction(ObservedPart):
    """The actions of all agents in the last round, each plus one; zeros before the first."""

    def __init__(self, problem: Problem) -> None:
        self.space = spaces.MultiDiscrete([count + 1 for count in problem.action_counts])

    def initial_memory(self, observation: Array) -> Memory:
        """Return zeros `[B, n]`."""
        return (np.zeros((len(observation), *cast("Any", self.space.shape)), np.int64),)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the actions `[B, n]` of the turn, each plus one."""
        assert percept.actions is not None
        return (percept.actions.astype(np.int64) + 1,)


class PlayHistory(ObservedPart):
    """All turns of a game as rows `[turns + 1, columns]`, of which the first is the start.

    The columns are 1, the actions of the turn, and the observation after it. The actions are those
    of all agents if they see the states, else that of the seat. Rows of later turns are 0.
    """

    def __init__(self, problem: Problem, seat: int, turns: int) -> None:
        if turns > MAX_HISTORY_TURNS:
            got = f"a history of {turns} turns"
            raise BadParameter(
                f"observe: got {got}, expected turns= of at most {MAX_HISTORY_TURNS}"
            )
        is_hidden = problem.partially_observable
        self._observation = make_last_observation(problem, seat)
        columns = [make_action_space(problem.actions[seat])]
        if not is_hidden:
            columns = [make_action_space(actions) for actions in problem.actions]
        # In a game of one state, the observation would repeat the actions.
        self._has_observation = is_hidden or problem.state_count != 1
        if self._has_observation:
            columns.append(self._observation.space)
        lows, highs = zip(*map(_find_bounds, columns), strict=True)
        low, high = np.concatenate([[0], *lows]), np.concatenate([[1], *highs])
        shape = turns + 1, len(low)
        self.space = spaces.Box(
            np.broadcast_to(np.minimum(low, 0), shape),
            np.broadcast_to(np.maximum(high, 0), shape),
            dtype=np.float64 if low.dtype.kind == "f" else np.int64,
        )

    def initial_memory(self, observation: Array) -> Memory:
        """Return the rows `[B, turns + 1, columns]` of games that start."""
        shape = len(observation), *cast("Any", self.space.shape)
        rows = np.zeros(shape, self.space.dtype)
        rows[:, 0, 0] = 1
        self._write_observation(rows[:, 0], observation)
        return (rows,)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the rows with one more turn."""
        rows = memory[0].copy()
        turns = rows[:, :, 0].sum(axis=1).astype(np.int64)
        turns = np.minimum(turns, rows.shape[1] - 1)  # finished games play on until they restart
        actions = percept.action[:, None] if percept.actions is None else percept.actions
        new_rows = np.zeros_like(rows[:, 0])
        new_rows[:, 0] = 1
        new_rows[:, 1 : 1 + actions.shape[1]] = actions
        self._write_observation(new_rows, percept.observation)
        rows[np.arange(len(rows)), turns] = new_rows
        return (rows,)

    def _write_observation(self, rows: Array, observation: Array) -> None:
        """Write observations `[B, ...]` into the last columns of rows `[B, columns]`."""
        if self._has_observation:
            memory = self._observation.initial_memory(observation)
            values = (memory[0] if memory else observation).reshape(len(rows), -1)
            rows[:, rows.shape[1] - values.shape[1] :] = values


class SeatBelief(ObservedPart):
    """The probability of each hidden state, given all that the seat has observed."""

    def __init__(self, problem: Problem, beliefs: GameFollower) -> None:
        self.space = spaces.Box(0.0, 1.0, (len(problem.enumerate_states()),), np.float64)
        self._beliefs = beliefs

    def initial_memory(self, observation: Array) -> Memory:
        """Return the beliefs `[B, S]` before the first turn."""
        return self._beliefs.initial_memory(observation)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the beliefs `[B, S]` after a turn."""
        return self._beliefs.update_memory(memory, percept)


def read_observed_names(observe: object) -> list[str]:
    """Return the names of the parts of an observation: one, several joined by +, or a list.

    Raise UnknownName for a name that is not in OBSERVED_PARTS, BadParameter for anything else.
    """
    values = observe.split("+") if isinstance(observe, str) else observe
    if (
        not isinstance(values, Sequence)
        or not values
        or not all(isinstance(v, str) for v in values)
    ):
        expected = f"one or several of {', '.join(OBSERVED_PARTS)}"
        raise BadParameter(f"observe: got {observe!r}, expected {expected}")
    names = [value.strip() for value in values]
    for name in names:
        if name not in OBSERVED_PARTS:
            raise UnknownName("part of an observation", name, OBSERVED_PARTS, "observe")
        if names.count(name) > 1:
            raise BadParameter(f"observe: got {name} more than once, expected it once")
    return names


def make_part(
    name: str, problem: Problem, seat: int, turns: int, beliefs: GameFollower | None
) -> ObservedPart:
    """Return the part of an observation with this name; raise BadParameter if there is none.

    `turns` is the limit of an episode, and `beliefs` computes the beliefs of the seat.
    """
    if name == "belief":
        if beliefs is None:
            reason = "no hidden states; observe the state"
            if problem.partially_observable:
                reason = "too many hidden states; observe the history"
            raise BadParameter(f"observe: got belief, but the problem has {reason}")
        return SeatBelief(problem, beliefs)
    if name == "history":
        return PlayHistory(problem, seat, turns)
    if name == "state":
        return CurrentState(problem)
    return TurnsLeft(turns) if name == "turns" else make_last_observation(problem, seat)


def make_last_observation(problem: Problem, seat: int) -> ObservedPart:
    """Return the usual observation of a seat.

    It is the last observation of a hidden state, the last joint action in a game of one state, or
    else the state.
    """
    if problem.partially_observable:
        return LastObservation(problem.observations[seat])
    return LastJointAction(problem) if problem.state_count == 1 else CurrentState(problem)


def make_action_space(actions: Labels | Interval) -> Space:
    """Return the space of a set of actions."""
    if isinstance(actions, Interval):
        return spaces.Box(actions.low, actions.high, (1,), np.float64)
    return spaces.Discrete(len(actions))


def make_state_space(problem: Problem) -> Space:
    """Return the space of the states of a problem; raise BadParameter if they are text."""
    state = problem.sample_initial_states(np.zeros((1, problem.uniform_counts.start)))[0]
    if state.dtype.kind == "f":
        return spaces.Box(-np.inf, np.inf, state.shape, np.float64)
    if isinstance(problem.state_count, int):
        sizes = problem.enumerate_states().max(axis=0) + 1
        return spaces.MultiDiscrete(sizes) if np.ndim(sizes) else spaces.Discrete(int(sizes))
    if state.dtype.kind not in "iu":
        raise BadParameter(TEXT_OBSERVATION_MESSAGE)
    low, high = np.iinfo(state.dtype).min // 2, np.iinfo(state.dtype).max // 2
    return spaces.Box(low, high, state.shape, state.dtype.type)


def _find_bounds(space: Space) -> tuple[Array, Array]:
    """Return the least and the greatest values `[columns]` of a space."""
    if isinstance(space, spaces.Discrete):
        return np.array([0]), np.array([int(space.n) - 1])
    if isinstance(space, spaces.MultiDiscrete):
        return np.zeros(space.nvec.size, np.int64), space.nvec.reshape(-1) - 1
    assert isinstance(space, spaces.Box)
    return space.low.reshape(-1), space.high.reshape(-1)
