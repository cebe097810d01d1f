"""Problems whose state is all that happened: a world of another library is led there again.

Such a world can neither be looked into nor, often, copied. What it draws it draws by numbers that
nature drew; so the start, and for each turn the joint action and the draw, say where it stands.
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

from dmplay.chance import Array, Bools, Chance, Uniform
from dmplay.core import Labels, Outcome, Problem, RealVector, TextLine
from dmplay.errors import BadParameter, IllegalAction

MAX_SEED = 10**9  # of the generators that a draw of nine decimals can tell apart
TURN_SEPARATOR, PART_SEPARATOR = "|", " "  # what stands between turns, and between the parts of one


JointAction = tuple[float, ...]
_REPLAY_LOCK = RLock()  # an agent may think while the screen is drawn


class GameHistory:
    """A start of a game, then the joint action and the draw of each turn: never changed.

    Each holds the one before it, so that a turn costs the same in a game of any length; and there
    is one for all that happened alike, so that two are equal where they are the same.
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
        """The one of which this is told."""
        with _REPLAY_LOCK:
            one = cls._instances.get((game, uniform, actions, id(previous)))
            if one is None:
                one = super().__new__(cls)
                one.game, one.uniform, one.actions, one.previous = game, uniform, actions, previous
                cls._instances[game, uniform, actions, id(previous)] = one
            return one

    def __reduce__(self) -> tuple[object, ...]:
        return parse_history, (self.game, str(self))

    def __str__(self) -> str:
        return TURN_SEPARATOR.join(
            PART_SEPARATOR.join(map(repr, (one.uniform, *one.actions)))
            for one in self.path_from_start()
        )

    def path_from_start(self) -> "list[GameHistory]":
        """The histories that led here, the start first and this last."""
        led, one = [self], self.previous
        while one:
            led.append(one)
            one = one.previous
        return led[::-1]


def parse_history(game: str, text: str) -> GameHistory:
    """The history that a text tells of."""
    found: GameHistory | None = None
    for turn in text.split(TURN_SEPARATOR):
        draw, *actions = turn.split(PART_SEPARATOR)
        done = tuple(float(word) if "." in word or "e" in word else int(word) for word in actions)
        found = GameHistory(game, float(draw), done, found)
    assert found
    return found


class TimeStep(NamedTuple):
    """What a world says where it stands."""

    rewards: tuple[float, ...]  # of the turn that led there
    over: bool
    legal_actions: tuple[Sequence[int], ...] | None  # for each agent; None for all
    observations: tuple[object, ...]  # what each agent observes
    state_text: str = ""  # the state in its own words
    action_labels: tuple[
        Mapping[int, str], ...
    ] = ()  # actions of each agent by their names here alone


class ExternalEnvironment(Protocol):
    """A game of another library as it stands; it changes as it is played."""

    def reset(self, uniform: float) -> TimeStep:
        """Begins it anew, with what this number draws."""

    def step(self, actions: tuple[float, ...], uniform: float) -> TimeStep:
        """Plays a turn, with what this number draws."""

    def clone(self) -> "ExternalEnvironment | None":
        """Another that stands where this one does; None where there cannot be one."""


class _Checkpoint:
    """What is known at the end of a history; and the world that stands there, if one does."""

    def __init__(self, time_step: TimeStep, environment: ExternalEnvironment | None) -> None:
        self.time_step, self.environment = time_step, environment


# Nothing leads from a problem, which agents hold, to these; each goes with its history.
_CHECKPOINTS: "WeakKeyDictionary[GameHistory, _Checkpoint]" = WeakKeyDictionary()


@dataclass(frozen=True)
class ExternalProblem(Problem, ABC):
    """A problem of another library."""

    name: str = field(default="", repr=False)  # it is this problem's, not a parameter

    state_count = math.inf

    @abstractmethod
    def make_environment(self) -> ExternalEnvironment:
        """A world of this problem that was not begun."""

    @property
    @abstractmethod
    def is_stochastic(self) -> bool:
        """Whether nature draws anything."""

    def time_step_after(self, history: GameHistory) -> TimeStep:
        """What its world says after this happened."""
        with _REPLAY_LOCK:
            stage = _CHECKPOINTS.get(history)
            return (stage or self._replay_history(history)).time_step

    def _replay_history(self, history: GameHistory) -> _Checkpoint:
        """Leads a world to the end of a history, from the last place where one stands."""
        path = history.path_from_start()
        at, world = self._nearest_checkpoint(path)
        for one in path[at:]:
            known = (
                world.step(one.actions, one.uniform) if one.previous else world.reset(one.uniform)
            )
        stage = _CHECKPOINTS[history] = _Checkpoint(known, world)
        return stage

    def _nearest_checkpoint(self, path: list[GameHistory]) -> tuple[int, ExternalEnvironment]:
        """A world, and how much of a path lies behind it."""
        for behind in range(len(path) - 1, 0, -1):
            stage = _CHECKPOINTS.get(path[behind - 1])
            if stage and stage.environment:
                copy = stage.environment.clone()
                world = copy or stage.environment
                stage.environment = stage.environment if copy else None
                return behind, world
        return 0, self.make_environment()

    def _time_steps(self, s: Array) -> list[TimeStep]:
        return [self.time_step_after(history) for history in s[:, 0]]

    def _seed_chance(self, rows: int) -> tuple[Chance, ...]:
        return (Uniform(np.zeros(rows), np.ones(rows)),) if self.is_stochastic else ()

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """A number from which all that the world draws first follows."""
        return self._seed_chance(rows)

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """A history of nothing yet."""
        draws = events[0].tolist() if events else [0.0] * rows
        return _to_state_column([GameHistory(self.name, draw) for draw in draws])

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """A number from which all that the world draws in this turn follows."""
        return self._seed_chance(len(s))

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """A world is led on, for each row."""
        draws = events[0].tolist() if events else [0.0] * len(s)
        moved = _to_state_column(
            list(map(self._extend_history, s[:, 0], a.tolist(), draws))
        )
        paid = np.zeros((len(s), len(self.agents)))
        for row, (before, after) in enumerate(zip(s[:, 0], moved[:, 0], strict=True)):
            paid[row] = 0.0 if after is before else self.time_step_after(after).rewards
        return Outcome(
            moved, paid, self.initial_observations(moved) if self.partially_observable else moved
        )

    def _extend_history(
        self, history: GameHistory, actions: list[float], uniform: float
    ) -> GameHistory:
        known = self.time_step_after(history)
        for able, action in zip(
            known.legal_actions or (), actions, strict=bool(known.legal_actions)
        ):
            if action not in able and not known.over:
                raise IllegalAction(f"{self.name}: got action {action:g}, which is not legal here")
        return history if known.over else GameHistory(self.name, uniform, tuple(actions), history)

    def action_labels(self, s: Array) -> tuple[Labels, ...] | None:
        """The names that the world gives to what can be done here; the rest keeps its own."""
        every = self.time_step_after(s[0]).action_labels
        pairs = zip(self.actions, every, strict=bool(every))
        return tuple(_rename_labels(one.labels, called) for one, called in pairs) if every else None

    def terminal(self, s: Array) -> Bools:
        """Where the world says so."""
        return np.array([known.over for known in self._time_steps(s)], bool)

    def legal_actions_mask(self, s: Array) -> Bools | None:
        """What the world says, where it says anything."""
        every = self._time_steps(s)
        if all(known.legal_actions is None for known in every):
            return None
        able = np.zeros((len(s), len(self.agents), max(self.action_counts)), bool)
        for row, known in enumerate(every):
            for seat, many in enumerate(self.action_counts):
                able[
                    row,
                    seat,
                    list(known.legal_actions[seat] if known.legal_actions else range(many)),
                ] = True
        return able

    def initial_observations(self, s: Array) -> Array:
        """What each agent observes where the world stands."""
        return np.array([known.observations for known in self._time_steps(s)])

    def format_transcript_state(self, s: Array) -> str:
        """The state in the world's own words; how it came about stands in the turns."""
        return join_lines(self.time_step_after(s[0]).state_text)

    def draw_state(self, s: Array) -> str:
        """The state in the world's own words, where these are several lines."""
        return _keep_if_multiline(self.time_step_after(s[0]).state_text)

    def draw_observation(self, observation: Array) -> str:
        """What is observed, where it is several lines of text."""
        return (
            _keep_if_multiline(str(observation))
            if isinstance(self.observations[0], TextLine)
            else ""
        )

    def format_state(self, s: Array) -> str:
        """All that happened."""
        return str(s[0])

    def parse_state(self, text: str) -> Array:
        """The history that the text tells of."""
        state: Array = _to_state_column([parse_history(self.name, text)])[0]
        return state


@dataclass(frozen=True)
class EnvironmentProblem(ExternalProblem):
    """A world that draws, and tells agents what they observe and are paid in every turn."""

    is_stochastic = True

    @property
    def rewards_observable(self) -> bool:
        """They are told."""
        return True


def _rename_labels(labels: Labels, new_names: Mapping[int, str]) -> Labels:
    """The labels, some under other names; a name that is another's has its number added."""
    names = [new_names.get(n, label) for n, label in enumerate(labels)]
    count = Counter(map(str.lower, names))
    for n, name in new_names.items():
        names[n] = f"{name}-{n}" if count[name.lower()] > 1 else name
    return Labels(names)


def _to_state_column(histories: list[GameHistory]) -> Array:
    column = np.empty((len(histories), 1), object)
    column[:, 0] = histories
    return column


def _keep_if_multiline(text: str) -> str:
    return text if "\n" in text else ""


def join_lines(text: str) -> str:
    """Several lines as one."""
    return " / ".join(filter(None, (row.strip() for row in text.split("\n"))))


def seed_from_uniform(uniform: float) -> int:
    """The seed that a draw of nine decimals is."""
    return round(uniform * MAX_SEED)


def make_numbered_labels(first: int, count: int) -> Labels:
    """Actions that have no names but numbers."""
    return Labels(map(str, range(first, first + count)))


def make_numbers_space(count: int, problem_name: str) -> RealVector:
    """An observation of so many numbers; raises BadParameter where nobody would read them."""
    if not 0 < count <= MAX_OBSERVATION_NUMBERS:
        what = f"what is observed are {count} numbers, perhaps a picture"
        raise BadParameter(
            f"{problem_name}: {what}; dmplay plays what has 1 to {MAX_OBSERVATION_NUMBERS}"
        )
    return RealVector(count)


MAX_OBSERVATION_NUMBERS = 1000
