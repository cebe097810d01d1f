"""Problems of other libraries, whose state is the history of the game so far.

An environment of another library can neither be inspected nor, often, copied. Its random numbers
follow from uniforms that nature draws. The start, and for each turn the joint action and the
uniform, therefore determine its state, and replaying them leads a new environment there.
"""

import math
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from threading import RLock
from typing import ClassVar, NamedTuple, Protocol
from weakref import WeakKeyDictionary, WeakValueDictionary

import numpy as np

from dmplay.core.arrays import Array, Bools
from dmplay.core.chance import Chance, Uniform
from dmplay.core.problem import Outcome, Problem
from dmplay.core.spaces import Labels, RealVector, TextLine
from dmplay.errors import BadParameter, IllegalAction

MAX_SEED = 10**9  # number of generator seeds that a uniform of nine decimals distinguishes
# separators between turns, and between the parts of a turn
TURN_SEPARATOR, PART_SEPARATOR = "|", " "


JointAction = tuple[float, ...]
_REPLAY_LOCK = RLock()  # An agent may compute while the screen is drawn.


class GameHistory:
    """An immutable history: the start of a game, then each turn's joint action and uniform.

    Each history refers to the previous one, so a turn costs the same in a game of any length. Equal
    histories are one object, so they can be compared by identity.
    """

    __slots__ = ("__weakref__", "actions", "game", "previous", "uniform")
    _instances: ClassVar["WeakValueDictionary[tuple[object, ...], GameHistory]"] = (
        WeakValueDictionary()
    )

    game: str
    uniform: float
    actions: JointAction
    previous: "GameHistory | None"

    def __new__(
        cls,
        game: str,
        uniform: float,
        actions: JointAction = (),
        previous: "GameHistory | None" = None,
    ) -> "GameHistory":
        """Return the only history with these values."""
        with _REPLAY_LOCK:
            history = cls._instances.get((game, uniform, actions, id(previous)))
            if history is None:
                history = super().__new__(cls)
                history.game = game
                history.uniform = uniform
                history.actions = actions
                history.previous = previous
                cls._instances[game, uniform, actions, id(previous)] = history
            return history

    def __reduce__(self) -> tuple[object, ...]:
        return parse_history, (self.game, str(self))

    def __str__(self) -> str:
        return TURN_SEPARATOR.join(
            PART_SEPARATOR.join(map(repr, (history.uniform, *history.actions)))
            for history in self.path_from_start()
        )

    def path_from_start(self) -> "list[GameHistory]":
        """Return the histories from the start to this one."""
        histories, history = [self], self.previous
        while history:
            histories.append(history)
            history = history.previous
        return histories[::-1]


def parse_history(game: str, text: str) -> GameHistory:
    """Return the history that a text describes, as `str` writes it."""
    history: GameHistory | None = None
    for turn in text.split(TURN_SEPARATOR):
        draw, *actions = turn.split(PART_SEPARATOR)
        joint_action = tuple(
            float(word) if "." in word or "e" in word else int(word) for word in actions
        )
        history = GameHistory(game, float(draw), joint_action, history)
    assert history
    return history


class TimeStep(NamedTuple):
    """The result of a reset or a turn: rewards, end, legal actions, observations and state text."""

    rewards: tuple[float, ...]  # of the turn that led to this state
    over: bool
    legal_actions: tuple[Sequence[int], ...] | None  # for each agent; None if all are legal
    observations: tuple[object, ...]  # of each agent
    state_text: str = ""  # the state as the library writes it
    # for each agent, names that actions have only in this state
    action_labels: tuple[Mapping[int, str], ...] = ()


class ExternalEnvironment(Protocol):
    """A game of another library in its current state, which every turn changes."""

    def reset(self, uniform: float) -> TimeStep:
        """Start a new game whose random numbers follow from the uniform."""

    def step(self, actions: tuple[float, ...], uniform: float) -> TimeStep:
        """Play a turn whose random numbers follow from the uniform."""

    def clone(self) -> "ExternalEnvironment | None":
        """Return another environment in the same state; None if it cannot be copied."""


class _Checkpoint:
    """The time step at the end of a history, and an environment in that state, if there is one."""

    def __init__(self, time_step: TimeStep, environment: ExternalEnvironment | None) -> None:
        self.time_step, self.environment = time_step, environment


# Agents hold problems, so problems must not refer to these. Each lives as long as its history.
_CHECKPOINTS: "WeakKeyDictionary[GameHistory, _Checkpoint]" = WeakKeyDictionary()


@dataclass(frozen=True)
class ExternalProblem(Problem, ABC):
    """A problem that is played in an environment of another library."""

    name: str = field(default="", repr=False)  # identifies the problem; not a parameter

    state_count = math.inf

    @abstractmethod
    def make_environment(self) -> ExternalEnvironment:
        """Return an environment of this problem that has not been reset."""

    @property
    def source(self) -> str:
        """The name in messages: the file that the problem is read from, else its own name."""
        return self.name

    @property
    @abstractmethod
    def is_stochastic(self) -> bool:
        """True if nature draws random numbers in it."""

    def time_step_after(self, history: GameHistory) -> TimeStep:
        """Return the environment's time step after a history, replayed if it is not stored."""
        with _REPLAY_LOCK:
            checkpoint = _CHECKPOINTS.get(history)
            return (checkpoint or self._replay_history(history)).time_step

    def _replay_history(self, history: GameHistory) -> _Checkpoint:
        """Replay a history from its nearest checkpoint, and return a new checkpoint at its end."""
        path = history.path_from_start()
        replayed_count, environment = self._nearest_checkpoint(path)
        for history_step in path[replayed_count:]:
            time_step = (
                environment.step(history_step.actions, history_step.uniform)
                if history_step.previous
                else environment.reset(history_step.uniform)
            )
        checkpoint = _CHECKPOINTS[history] = _Checkpoint(time_step, environment)
        return checkpoint

    def _nearest_checkpoint(self, path: list[GameHistory]) -> tuple[int, ExternalEnvironment]:
        """Return the length of a path that an environment has already played, and the environment.

        The environment is a clone of the last checkpoint's. If it cannot be cloned, it is taken
        from the checkpoint. Without any, it is a new environment, and nothing is played.
        """
        for played_count in range(len(path) - 1, 0, -1):
            checkpoint = _CHECKPOINTS.get(path[played_count - 1])
            if checkpoint and checkpoint.environment:
                clone = checkpoint.environment.clone()
                environment = clone or checkpoint.environment
                checkpoint.environment = checkpoint.environment if clone else None
                return played_count, environment
        return 0, self.make_environment()

    def _time_steps(self, s: Array) -> list[TimeStep]:
        """Return the time step of each state."""
        return [self.time_step_after(history) for history in s[:, 0]]

    def _make_seed_chance(self, rows: int) -> tuple[Chance, ...]:
        """Return a uniform for each row, which seeds its random numbers; () if it has none."""
        return (Uniform(np.zeros(rows), np.ones(rows)),) if self.is_stochastic else ()

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Return a uniform for each row that determines all random numbers of the start."""
        return self._make_seed_chance(rows)

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """Return histories without turns, as states."""
        uniforms = events[0].tolist() if events else [0.0] * rows
        return stack_histories([GameHistory(self.name, uniform) for uniform in uniforms])

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Return a uniform for each row that determines all random numbers of the turn."""
        return self._make_seed_chance(len(s))

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Play a turn in the environment of each row; games that are over stay as they are."""
        uniforms = events[0].tolist() if events else [0.0] * len(s)
        next_states = stack_histories(
            list(map(self._extend_history, s[:, 0], a.tolist(), uniforms))
        )
        rewards = np.zeros((len(s), len(self.agents)))
        for row, (history, next_history) in enumerate(zip(s[:, 0], next_states[:, 0], strict=True)):
            rewards[row] = (
                0.0 if next_history is history else self.time_step_after(next_history).rewards
            )
        return Outcome(
            next_states,
            rewards,
            self.initial_observations(next_states) if self.partially_observable else next_states,
        )

    def _extend_history(
        self, history: GameHistory, actions: list[float], uniform: float
    ) -> GameHistory:
        """Return the history after a turn, or the same one if the game is over.

        Raises IllegalAction if an action is not legal.
        """
        time_step = self.time_step_after(history)
        for legal_actions, action in zip(
            time_step.legal_actions or (), actions, strict=bool(time_step.legal_actions)
        ):
            if action not in legal_actions and not time_step.over:
                raise IllegalAction(
                    f"{self.source}: got action {action:g}, which is not a legal action now"
                )
        return (
            history if time_step.over else GameHistory(self.name, uniform, tuple(actions), history)
        )

    def action_labels(self, s: Array) -> tuple[Labels, ...] | None:
        """Return the agents' action labels in this state; None if they are the usual ones.

        Labels that the environment does not rename stay the same.
        """
        names_by_agent = self.time_step_after(s[0]).action_labels
        pairs = zip(self.actions, names_by_agent, strict=bool(names_by_agent))
        if names_by_agent:
            return tuple(_replace_labels(space.labels, names) for space, names in pairs)
        return None

    def terminal(self, s: Array) -> Bools:
        """Return the mask `[B]` of terminal states."""
        return np.array([time_step.over for time_step in self._time_steps(s)], bool)

    def legal_actions_mask(self, s: Array) -> Bools | None:
        """Return the mask `[B, n, A]` of legal actions; None if all are legal."""
        time_steps = self._time_steps(s)
        if all(time_step.legal_actions is None for time_step in time_steps):
            return None
        mask = np.zeros((len(s), len(self.agents), max(self.action_counts)), bool)
        for row, time_step in enumerate(time_steps):
            for seat, action_count in enumerate(self.action_counts):
                mask[
                    row,
                    seat,
                    list(
                        time_step.legal_actions[seat]
                        if time_step.legal_actions
                        else range(action_count)
                    ),
                ] = True
        return mask

    def initial_observations(self, s: Array) -> Array:
        """Return each agent's observation of the states `[B, n, ...]`."""
        return np.array([time_step.observations for time_step in self._time_steps(s)])

    def format_transcript_state(self, s: Array) -> str:
        """Return the state as the library writes it, in one line.

        The history is not repeated: the turns of the transcript contain it.
        """
        return join_lines(self.time_step_after(s[0]).state_text)

    def draw_state(self, s: Array) -> str:
        """Return the state as the library writes it; '' if that is a single line."""
        return _drop_single_line(self.time_step_after(s[0]).state_text)

    def draw_observation(self, observation: Array) -> str:
        """Return a text observation; '' if it is a single line, or not text."""
        if isinstance(self.observations[0], TextLine):
            return _drop_single_line(str(observation))
        return ""

    def format_state(self, s: Array) -> str:
        """Return the history as text."""
        return str(s[0])

    def parse_state(self, text: str) -> Array:
        """Return the history that a text describes."""
        state: Array = stack_histories([parse_history(self.name, text)])[0]
        return state


@dataclass(frozen=True)
class EnvironmentProblem(ExternalProblem):
    """A stochastic environment that reports observations and rewards to its agents every turn."""

    is_stochastic = True

    @property
    def rewards_observable(self) -> bool:
        """True: agents receive their rewards."""
        return True


def _replace_labels(labels: Labels, new_names: Mapping[int, str]) -> Labels:
    """Return the labels with some replaced; a name used twice gets the action's number appended."""
    names = [new_names.get(n, label) for n, label in enumerate(labels)]
    count = Counter(map(str.lower, names))
    for n, name in new_names.items():
        names[n] = make_label_unique(name, n, count) if count[name.lower()] > 1 else name
    return Labels(names)


def make_label_unique(label: str, number: int, taken: Counter[str]) -> str:
    """Return the label with the number appended until no other label is equal, and count it.

    Labels are compared in lower case, as they are typed.
    """
    new_label = f"{label}-{number}"
    while taken[new_label.lower()]:
        new_label += f"-{number}"
    taken[new_label.lower()] += 1
    return new_label


def stack_histories(histories: list[GameHistory]) -> Array:
    """Return histories as an array of states `[B, 1]`."""
    column = np.empty((len(histories), 1), object)
    column[:, 0] = histories
    return column


def _drop_single_line(text: str) -> str:
    """Return a text of several lines; '' for a text of one line."""
    return text if "\n" in text else ""


def join_lines(text: str) -> str:
    """Return the non-empty lines of a text in one line."""
    return " / ".join(filter(None, (row.strip() for row in text.split("\n"))))


def seed_from_uniform(uniform: float) -> int:
    """Return the seed that a uniform of nine decimals determines."""
    return round(uniform * MAX_SEED)


def make_numbered_labels(first: int, count: int) -> Labels:
    """Return labels for `count` actions that are only numbered, from `first` on."""
    return Labels(map(str, range(first, first + count)))


def make_numbers_space(count: int, problem_name: str) -> RealVector:
    """Return an observation space of `count` numbers.

    Raises BadParameter for 0, or for more than people would read (MAX_OBSERVATION_NUMBERS).
    """
    if not 0 < count <= MAX_OBSERVATION_NUMBERS:
        explanation = f"an observation has {count} numbers, perhaps an image"
        raise BadParameter(
            f"{problem_name}: {explanation}; dmplay supports 1 to {MAX_OBSERVATION_NUMBERS}"
        )
    return RealVector(count)


MAX_OBSERVATION_NUMBERS = 1000
