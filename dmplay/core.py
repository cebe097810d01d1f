"""The problem, the outcome of a turn, and the policy: what everything else is written against."""

import inspect
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import Field, dataclass, field, fields
from functools import cached_property, lru_cache
from itertools import product
from typing import Any, ClassVar, NamedTuple, Protocol, Self, TypeVar

import numpy as np

from dmplay import places
from dmplay.budget import Budget
from dmplay.chance import (
    Array,
    Bools,
    Chance,
    FiniteChance,
    Ints,
    Reals,
    sample_all,
    sample_uniform_index,
)
from dmplay.errors import BadParameter, BadPolicy, IllegalAction, UnknownName

ACTION_DECIMALS = 9  # of a real-valued action, so that its text is the number
INTERVAL_GRID_SIZE = 21  # actions that stand for an interval
MAX_LISTING_BYTES = 384 * 2**20  # bytes of all states of a problem, or of what may come of them
INIT_REFUSED_MESSAGE = (
    "parameters are fields with a default, as `price: float = 5.0`, not of __init__"
)
NO_OBSERVATION_TEXT = "nothing yet"
WAIT_LABEL = "wait"  # the action of an agent whose turn it is not, where it is the only one
MAX_INTERNED_ARRAYS = 4096  # arrays of which one is told again where another is the same
DEFAULT_PARAMETER_BOUND = 1e6  # a parameter that says no bounds of its own, either way
READONLY_ERROR_WORDS = (
    "read-only",
    "WRITEABLE",
)  # what is said of a write, and of the wish to write

T = TypeVar("T")
Memory = tuple[Array, ...]
UpdateMethod = TypeVar("UpdateMethod", bound=Callable[..., Memory])


class Labels(tuple[str, ...]):
    """A finite set of names; the index is the value."""

    __slots__ = ()
    json_types: tuple[type, ...] = (str,)  # the types of an action in JSON

    @property
    def labels(self) -> "Labels":
        """The names to choose from: all of them."""
        return self

    @property
    def shape(self) -> tuple[int, ...]:
        """That of one observation: an index."""
        return ()

    def null_observation(self, rows: int) -> Ints:
        """What stands for nothing observed before the first turn `[B]`."""
        return np.full(rows, -1)

    def format_observation(self, observation: Array) -> str:
        """An observation in words."""
        return NO_OBSERVATION_TEXT if observation < 0 else self[int(observation)]

    def parse_action(self, text: str) -> int:
        """The action that a text names."""
        word = normalize_label(text)
        known: Sequence[str] = self if word in self else [normalize_label(label) for label in self]
        if word not in known:
            raise UnknownName("action", text.strip(), self)
        return known.index(word)

    def format_action(self, action: float) -> str:
        """The label of an action."""
        return str(self[int(action)])

    to_json_value = format_action  # as a transcript has it

    def validate_action(self, action: float, error_prefix: str, legal: Bools | None = None) -> int:
        """The action as it will act; raises IllegalAction for what is no index, or not legal."""
        if action not in range(len(self)):
            raise IllegalAction(
                f"{error_prefix}: got action {action}, expected 0 to {len(self) - 1}"
            )
        if legal is not None and not legal[int(action)]:
            told = f"{self[int(action)]} is not legal now; expected one of {self.describe_actions(legal)}"
            raise IllegalAction(f"{error_prefix}: {told}")
        return int(action)

    def sample_actions(self, u: Reals, legal: Bools | None) -> Ints:
        """Actions `[B]` by uniforms `[B]`, each that is legal `[B, A]` as likely."""
        return sample_uniform_index(len(self), u, legal)

    def candidate_actions(self) -> Ints:
        """The actions `[A]` that a search tries."""
        return np.arange(len(self))

    def describe_actions(self, legal: Bools | None = None) -> str:
        """The legal ones in words; '' for none."""
        return ", ".join(self if legal is None else (self[a] for a in np.flatnonzero(legal)))


@dataclass(frozen=True)
class Interval:
    """A continuous action set, bounds included."""

    low: float
    high: float
    json_types: ClassVar[tuple[type, ...]] = (int, float)  # the types of an action in JSON

    @property
    def labels(self) -> Labels:
        """The names to choose from: none, an action is a number."""
        return Labels()

    def parse_action(self, text: str) -> float:
        """The action that a text writes."""
        try:
            value = (
                round(float(text), ACTION_DECIMALS)
                if text.isascii() and "_" not in text
                else math.nan
            )
        except ValueError:
            value = math.nan
        if not self.low <= value <= self.high:
            raise BadParameter(f"action: got {text.strip()!r}, expected {self.describe_actions()}")
        return value + 0.0

    def format_action(self, action: float) -> str:
        """The number, in as many digits as it has."""
        return f"{action:.9g}"

    def to_json_value(self, action: float) -> float:
        """The number, as a transcript has it."""
        return float(action)

    def validate_action(
        self, action: float, error_prefix: str, legal: Bools | None = None
    ) -> float:
        """The action as it will act; raises IllegalAction for what is out of bounds."""
        if not self.low <= action <= self.high:
            raise IllegalAction(
                f"{error_prefix}: got {action:g}, expected {self.describe_actions()}"
            )
        return round(float(action), ACTION_DECIMALS) + 0.0

    def sample_actions(self, u: Reals, legal: Bools | None) -> Reals:
        """Actions `[B]` by uniforms `[B]`, each as likely."""
        return np.round(self.low + (self.high - self.low) * u, ACTION_DECIMALS)

    def candidate_actions(self) -> Reals:
        """The actions `[A]` that a search tries."""
        return np.asarray(
            np.round(np.linspace(self.low, self.high, INTERVAL_GRID_SIZE), ACTION_DECIMALS) + 0.0
        )

    def clip_actions(self, numbers: Reals) -> Reals:
        """The actions `[B]` that are closest to these numbers."""
        within = np.minimum(np.maximum(numbers, self.low), self.high)
        return np.asarray(within.round(ACTION_DECIMALS) + 0.0)

    def describe_actions(self, legal: Bools | None = None) -> str:
        """The span in words."""
        return f"a number from {self.low:g} to {self.high:g}"


def normalize_label(text: str) -> str:
    """A typed name as labels are written."""
    return text.strip().lower().replace("_", "-")


@dataclass(frozen=True)
class RealVector:
    """What an agent observes as real numbers: one, or a vector of so many."""

    size: int = 1

    @property
    def shape(self) -> tuple[int, ...]:
        """That of one observation."""
        return (self.size,) if self.size > 1 else ()

    def null_observation(self, rows: int) -> Reals:
        """What stands for nothing before the first turn `[B, ...]`."""
        return np.full((rows, *self.shape), np.nan)

    def format_observation(self, observation: Array) -> str:
        """An observation in words."""
        if np.isnan(observation).any():
            return NO_OBSERVATION_TEXT
        return ", ".join(f"{number:.6g}" for number in np.atleast_1d(observation))

    def to_json_value(self, observation: Array) -> float | list[float]:
        """An observation as a transcript has it."""
        found: float | list[float] = observation.tolist()
        return found


@dataclass(frozen=True)
class TextLine:
    """What an agent observes as a line of text."""

    shape: ClassVar[tuple[int, ...]] = ()

    def null_observation(self, rows: int) -> Array:
        """What stands for nothing before the first turn `[B]`."""
        return np.full(rows, "")

    def format_observation(self, observation: Array) -> str:
        """An observation in words."""
        return str(observation) or NO_OBSERVATION_TEXT

    def to_json_value(self, observation: Array) -> str:
        """An observation as a transcript has it."""
        return str(observation)


ObservationSpace = Labels | RealVector | TextLine  # what an agent can observe


class ContinuousStates(NamedTuple):
    """A state space that is part of R^dimensions."""

    dimensions: int


class UniformCounts(NamedTuple):
    """How many uniforms one row of the opening, and one row of a turn, consumes."""

    start: int
    step: int


class Outcome(NamedTuple):
    """What one joint action brings about, for B rows and n agents.

    `state` `[B, ...]`, `rewards` `[B, n]`, and `observations`: where states are hidden `[B, n]` by
    the index of a label (or text, or `[B, n, many]` numbers), else the next state itself.
    """

    state: Array  # [B, ...]
    rewards: Reals  # [B, n]
    observations: Array  # [B, n, ...]; the next state itself where agents see everything


class Percept(NamedTuple):
    """What one turn teaches one seat, for B rows."""

    action: Array  # [B], its own
    observation: Array  # [B, ...]; the next state where agents see everything
    actions: Array | None  # [B, n], the joint action where it is public
    reward: Reals | None  # [B], its own where it is observable


FIELD_OMITTED = np.zeros(0)  # stands for what nobody looks at


class Policy(Protocol):
    """How one seat of a problem acts; batch-first, so that it plays one game or many at once."""

    @property
    def uniform_count(self) -> int:
        """How many uniforms one row of one choice consumes."""

    def initial_memory(self, observation: Array) -> Memory:
        """The memory before the first turn: arrays, first axis the row.

        The observation is the start state where agents see everything, else nothing: -1 of labels,
        NaN of numbers, '' of texts.
        """

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """The memory after a turn."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """An action for each row `[B]`; `legal` `[B, A]`, `u` `[B, draws]`."""

    def action_values(self, memory: Memory) -> Reals | None:
        """The value of each action `[B, A]`, where the policy knows it."""


def requires_fields(*field_names: str) -> Callable[[UpdateMethod], UpdateMethod]:
    """Marks an `update` that looks at these parts of a percept alone: in many games at once the
    others are not copied for it.
    """

    def mark_update(update: UpdateMethod) -> UpdateMethod:
        vars(update)["required_fields"] = field_names
        return update

    return mark_update


def required_fields(policy: Policy) -> Collection[str]:
    """The parts of a percept that a policy looks at: all, unless it says so."""
    found: Collection[str] = getattr(policy.update_memory, "required_fields", Percept._fields)
    return found


def readonly_copy(array: Array) -> Array:
    """A copy that shares nothing with the game, and that nobody writes into."""
    copied = array.copy()
    copied.setflags(write=False)
    return copied


def array_bytes(array: Array) -> bytes:
    """The bytes of an array, or of one number: what is the same has the same."""
    if array.ndim:  # an array keeps what its `data` needs as long as it lives
        return array.tobytes()
    return array.data.tobytes()


def intern_array(array: Array) -> Array:
    """A copy into which nobody ever can write; where its like was told before, that one."""
    return (
        readonly_copy(array)
        if array.dtype.hasobject
        else _interned_from_bytes(array_bytes(array), array.dtype, array.shape)
    )


@lru_cache(MAX_INTERNED_ARRAYS)
def _interned_from_bytes(data: bytes, dtype: "np.dtype[Any]", shape: tuple[int, ...]) -> Array:
    return np.ndarray(shape, dtype, data)


def make_readonly(array: Array) -> Array:
    """An array that was just made, into which nobody writes from now on."""
    array.setflags(write=False)
    return array


def check_problem(problem: object, turn_limit: int | None) -> None:
    """Refuses what is no problem, as its name is not, and what is no number of turns."""
    if not isinstance(problem, Problem):
        raise BadParameter(f"got {problem!r}, expected a problem, as of dmplay.load")
    if turn_limit is not None and (not isinstance(turn_limit, INTEGER_TYPES) or turn_limit < 0):
        raise BadParameter(f"turns: got {turn_limit!r}, expected a whole number, 0 or more")


def check_policy(policy: object, seat: int) -> None:
    """Refuses what is no policy, as an agent's name is not."""
    if not hasattr(policy, "choose"):
        told = f"expected a policy, as of dmplay.agent(problem, {seat}, ...)"
        raise BadPolicy(f"seat {seat}: got {policy!r}, {told}")


def call_policy(error_prefix: object, method: Callable[..., T], *args: object) -> T:
    """What a policy's method answers; raises BadPolicy where it writes into what it is given."""
    try:
        return method(*args)
    except ValueError as error:
        if not any(word in str(error) for word in READONLY_ERROR_WORDS):
            raise
        name = method.__qualname__
        raise BadPolicy(
            f"{error_prefix}: {name} writes into what it was given; copy it first"
        ) from None


def parameter(  # noqa: PLR0913 - each is the problem's to choose
    default: T,
    description: str,
    low: float | None = None,
    high: float | None = None,
    *,
    exclusive_low: bool = False,
    choices: Sequence[str] = (),
) -> T:
    """A dataclass field with its meaning and, for numbers, its bounds.

    Without bounds of its own a number is at most a million, or ten times its default; one that must
    be `above` its low is so by a millionth at least. A word is one of those that it is said to be
    `among`, or any.
    """
    far = (
        max(DEFAULT_PARAMETER_BOUND, 10 * abs(default))
        if isinstance(default, int | float)
        else DEFAULT_PARAMETER_BOUND
    )
    low, high = -far if low is None else low, far if high is None else high
    low += 1 / DEFAULT_PARAMETER_BOUND if exclusive_low else 0
    facts = {"meaning": description, "low": low, "high": high, "among": choices}
    return field(default=default, metadata=facts)


INTEGER_TYPES, NUMBER_TYPES = (int, np.integer), (int, float, np.number)
PARAMETER_TYPES: Mapping[type, tuple[str, tuple[type, ...]]] = {  # what may stand for a default
    int: ("a whole number", INTEGER_TYPES),
    float: ("a number", NUMBER_TYPES),
    bool: ("true or false", (bool, np.bool_)),
    str: ("text", (str,)),
}
MAX_PRINTED_NUMBER = 1e300  # a number that can be told


def check_parameters(instance: Any) -> None:
    """Refuses what the `parameter` of a dataclass cannot be: another kind, or out of bounds."""
    for one in fields(instance):
        if "low" in one.metadata and type(one.default) in PARAMETER_TYPES:
            _check_parameter(getattr(instance, one.name), one)


def _check_parameter(value: object, parameter_field: Field[Any]) -> None:
    """Refuses one value of a parameter that is a number, a flag or a word."""
    words, kinds = PARAMETER_TYPES[type(parameter_field.default)]
    flag = isinstance(value, bool | np.bool_)
    if not isinstance(value, kinds) or flag != isinstance(parameter_field.default, bool):
        raise BadParameter(f"{parameter_field.name}: got {value!r}, expected {words}")
    if isinstance(value, str) and value not in (parameter_field.metadata["among"] or (value,)):
        among = ", ".join(parameter_field.metadata["among"])
        raise BadParameter(f"{parameter_field.name}: got {value!r}, expected one of {among}")
    if flag or isinstance(value, str):
        return
    number: Any = value
    low, high = (parameter_field.metadata[key] for key in ("low", "high"))
    if not low <= number <= high:
        got = f"{number:g}" if abs(number) <= MAX_PRINTED_NUMBER else "a number beyond all bounds"
        most = f" and at most {high:g}" if high < DEFAULT_PARAMETER_BOUND or number > high else ""
        raise BadParameter(
            f"{parameter_field.name}: got {got}, expected a number at least {low:g}{most}"
        )


@dataclass(frozen=True)
class Problem(ABC):
    """A decision problem: n agents, one Markov state; arrays are batch-first and C-ordered.

    A fact that never varies is a plain class attribute; one that depends on the parameters is a
    property. The dynamics are `chance` and `move`; everything else is derived from these two.
    """

    discount: float = parameter(1.0, "factor on the rewards of each later turn", 0.0, 1.0)

    def __init_subclass__(cls) -> None:
        """Takes a plain attribute of a parameter's name, as `discount = 0.95`, for its default."""
        super().__init_subclass__()
        if "__init__" in vars(cls):
            where = places.locate_definition(cls, "__init__")
            raise BadParameter(f"{where} __init__: {INIT_REFUSED_MESSAGE}")
        bases = [_ensure_dataclass(base) for base in cls.__bases__ if issubclass(base, Problem)]
        known = {one.name: one.type for base in bases for one in fields(base)}
        own = inspect.get_annotations(cls)
        plain = {name: known[name] for name in known if name in vars(cls) and name not in own}
        if plain:
            cls.__annotations__ = plain | own

    def __new__(cls, *args: object, **kwargs: object) -> Self:
        """An instance, of a subclass without a decorator too."""
        _ensure_dataclass(cls)
        return super().__new__(cls)

    @property
    def agents(self) -> tuple[str, ...]:
        """The names of the agents, in seat order."""
        return ("agent",)

    @property
    @abstractmethod
    def actions(self) -> tuple[Labels | Interval, ...]:
        """The action set of each agent."""

    @cached_property
    def action_counts(self) -> tuple[int, ...]:
        """How many actions each agent has to choose from; 0 where it chooses a number."""
        return tuple(len(known.labels) for known in self.actions)

    @property
    def observations(self) -> tuple[ObservationSpace, ...]:
        """What each agent observes, all of one kind; () where every agent sees the state."""
        return ()

    @cached_property
    def observation_counts(self) -> tuple[int, ...]:
        """How many observations each agent can make; BadParameter where they have no labels."""
        labels = [one for one in self.observations if isinstance(one, Labels)]
        if len(labels) < len(self.observations):
            name = type(self).__name__
            raise BadParameter(f"{name} has observations without labels: they cannot be listed")
        return tuple(map(len, labels))

    @cached_property
    def partially_observable(self) -> bool:
        """Whether agents see less than the state."""
        return bool(self.observations)

    @property
    def state_count(self) -> int | float | ContinuousStates:
        """How many states: a count, `math.inf`, or a part of R^dimensions; 1 for simple games."""
        return 1

    @property
    def horizon(self) -> int | None:
        """The default number of turns: one of play, the dynamics have none."""
        return None

    @property
    def can_run_forever(self) -> bool:
        """Whether games may go on for ever, so that those of agents alone have a limit of turns."""
        return True

    @property
    def shared_reward(self) -> bool:
        """Whether all agents always receive the same reward."""
        return False

    @property
    def reward_bounds(self) -> tuple[float, float] | None:
        """The least and the greatest reward of a turn; None where the problem does not say."""
        return None

    @property
    def state_bounds(self) -> tuple[Array, Array] | None:
        """The least and the greatest of each number of a state, where the problem says so."""
        return None

    @property
    def rewards_observable(self) -> bool:
        """Whether a seat may see its reward each turn; a hidden state it would betray."""
        return not self.partially_observable

    @property
    def action_aliases(self) -> Mapping[str, str]:
        """Other names of actions."""
        return {}

    def __post_init__(self) -> None:
        """Refuses parameters out of bounds."""
        check_parameters(self)

    @abstractmethod
    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """What nature draws before the game."""

    @abstractmethod
    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """The start states `[rows, ...]` that these draws mean."""

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """What nature draws in this turn: independent chances; nothing unless overridden."""
        return ()

    @abstractmethod
    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """What happens when the draws come out so."""

    @abstractmethod
    def format_state(self, s: Array) -> str:
        """One state, without the batch axis, as one line of text that loses nothing."""

    @abstractmethod
    def parse_state(self, text: str) -> Array:
        """The state that `notation` wrote."""

    def terminal(self, s: Array) -> Bools:
        """Which rows are over; a terminal state absorbs and pays nothing."""
        return np.zeros(len(s), bool)

    def legal_actions_mask(self, s: Array) -> Bools | None:
        """Which actions `[B, n, A]` the state allows; None for all."""
        return None

    def action_labels(self, s: Array) -> tuple[Labels, ...] | None:
        """What the actions of each agent are called in one state, where that depends on it.

        As many names as there are labels in `actions`, which mean the same in every state, and
        which transcripts hold; None stands for these. A seat reads its names: they tell it no more
        than it may know.
        """
        return None

    def inactive_agents(self, s: Array) -> Bools:
        """Which agents `[B, n]` are not asked, as it is another's turn: all they may is wait."""
        waits = np.zeros((len(s), len(self.agents)), bool)
        legal = self.legal_actions_mask(s) if len(self.agents) > 1 else None
        if legal is None:
            return waits
        for seat, known in enumerate(self.actions):
            if WAIT_LABEL in known.labels:
                able = legal[:, seat]
                waits[:, seat] = able[:, known.labels.index(WAIT_LABEL)] & (
                    able.sum(axis=1) == 1
                )
        return waits

    def wait_action(self, seat: int) -> int:
        """The action of a seat that only waits."""
        return self.actions[seat].labels.index(WAIT_LABEL)

    def format_transcript_state(self, s: Array) -> str:
        """What a transcript writes of a state: its notation, unless that grows with the game."""
        return self.format_state(s)

    def description(self) -> str:
        """What it is, in the words of whoever wrote it."""
        return inspect.getdoc(type(self)) or ""

    def enumerate_states(self) -> Array:
        """Every state of a finite problem `[S, ...]`, in the order of their indices."""
        if not isinstance(self.state_count, int):
            raise BadParameter(f"{type(self).__name__} has no finite list of states")
        check_listing_size(self, self.state_count)
        return np.arange(self.state_count)

    def state_indices(self, s: Array) -> Ints:
        """The place `[B]` of each state in `enumerated`."""
        return s

    def joint_belief_update(
        self, belief: Reals, actions: Sequence[int | None], observations: Sequence[int | None]
    ) -> Reals:
        """The probability `[S]` of these observations and each next state, from a belief `[S]`.

        None stands for what is not known: an unknown action is taken to be uniformly random, an
        unknown observation says nothing.
        """
        support = np.flatnonzero(belief)
        known = zip(actions, self.action_counts, strict=True)
        each = [range(many) if a is None else (a,) for a, many in known]
        choices = np.array(list(product(*each)))
        states = self.enumerate_states()[support]
        p, outcome = enumerate_outcomes(
            self, np.repeat(states, len(choices), axis=0), np.tile(choices, (len(states), 1))
        )
        weight = p * np.repeat(belief[support] / len(choices), len(choices))[:, None]
        for seat, observation in enumerate(observations):
            if observation is not None:
                weight = weight * (outcome.observations[:, :, seat] == observation)
        after = next_state_indices(self, outcome).reshape(-1)
        return np.bincount(after, weight.reshape(-1), minlength=len(belief)).astype(float)

    @cached_property
    def uniform_counts(self) -> UniformCounts:
        """How many uniforms one row of the opening and of a turn consumes."""
        opening = self.initial_chance(1)
        start = sum(chance.uniform_count for chance in opening)
        s = self.initial_states(1, sample_all(opening, np.zeros((1, start))))
        a = np.array([[known.candidate_actions()[0] for known in self.actions]])
        return UniformCounts(
            start, sum(chance.uniform_count for chance in self.chance(s, a))
        )

    def sample_initial_states(self, u: Reals) -> Array:
        """Start states `[B, ...]` from uniforms `[B, draws.start]`."""
        return self.initial_states(len(u), sample_all(self.initial_chance(len(u)), u))

    def step(self, s: Array, a: Array, u: Reals) -> Outcome:
        """One turn of B rows: states, joint actions `[B, n]`, uniforms `[B, draws.step]`."""
        return self.resolve_events(s, a, sample_all(self.chance(s, a), u))

    def initial_observations(self, s: Array) -> Array:
        """What each agent observes of a hidden start `[B, n, ...]`: nothing unless overridden."""
        return np.stack([known.null_observation(len(s)) for known in self.observations], axis=1)

    def initial_observation(self, s: Array, seat: int) -> Array:
        """What a seat sees before the first turn: the state `[B, ...]`, or what it may of it."""
        return readonly_copy(
            self.initial_observations(s)[:, seat] if self.partially_observable else s
        )

    def build_percept(
        self,
        seat: int,
        actions: Array,
        outcome: Outcome,
        field_names: Collection[str] = Percept._fields,
    ) -> Percept:
        """What a turn by the joint actions `[B, n]` teaches a seat, in arrays of its own.

        Only the parts that are named are copied; the others are empty.
        """

        def copy_if_required(name: str, array: Array) -> Array:
            return readonly_copy(array) if name in field_names else FIELD_OMITTED

        seen = outcome.observations[:, seat] if self.partially_observable else outcome.observations
        return Percept(
            copy_if_required("action", actions[:, seat]),
            copy_if_required("observation", seen),
            None if self.partially_observable else copy_if_required("actions", actions),
            copy_if_required("reward", outcome.rewards[:, seat])
            if self.rewards_observable
            else None,
        )

    @property
    def kind(self) -> str:
        """The field's name for this class of problem, derived from its facts."""
        if self.state_count == 1:
            return "simple game"
        if len(self.agents) == 1:
            return "POMDP" if self.partially_observable else "MDP"
        if not self.partially_observable:
            return "Markov game"
        return "Dec-POMDP" if self.shared_reward else "POMG"

    def seat_index(self, name: str) -> int:
        """The index of the agent of this name."""
        if name not in self.agents:
            raise UnknownName("seat", name, self.agents)
        return int(self.agents.index(name))

    def parse_action(self, seat: int, text: str) -> float:
        """The action that a person's text names: an index, or a number of the interval."""
        return self.actions[seat].parse_action(self.action_aliases.get(normalize_label(text), text))

    def format_action(self, seat: int, action: float) -> str:
        """The label of an action, or its number."""
        return self.actions[seat].format_action(action)


def _ensure_dataclass(problem_class: type[Problem]) -> type[Problem]:
    """A subclass, made the frozen dataclass that it stands for where no decorator did."""
    return (
        problem_class
        if "__dataclass_fields__" in vars(problem_class)
        else dataclass(frozen=True)(problem_class)
    )


class OutcomeDistribution(NamedTuple):
    """Every outcome of a turn with its probability, for B rows and K joint events."""

    probabilities: Reals  # [B, K]
    outcomes: Outcome  # arrays [B, K, ...]


def enumerate_outcomes(problem: Problem, s: Array, a: Array) -> OutcomeDistribution:
    """Every outcome of the joint actions `a` `[B, n]` in the states `s` `[B, ...]`, as indices.

    The probabilities are `[B, K]`, the arrays of the outcome `[B, K, ...]`. Raises IllegalAction
    for the index of no action, BadParameter where chance draws real numbers, TooMuch where there
    are too many to list. States are not looked at, nor whether actions are legal there.
    """
    for agent, known, chosen in zip(problem.agents, problem.actions, a.T, strict=True):
        for one in (chosen.min(), chosen.max()) if known.labels and len(a) else ():
            known.validate_action(one.item(), agent)
    chances = _require_finite_chances(problem, problem.chance(s, a))
    rows = len(s)
    probabilities, events = _enumerate_joint_events(chances, rows)
    many = probabilities.shape[1]
    outcome = problem.resolve_events(np.repeat(s, many, axis=0), np.repeat(a, many, axis=0), events)
    shaped = [part.reshape(rows, many, *part.shape[1:]) for part in outcome]
    return OutcomeDistribution(probabilities, Outcome(*shaped))


def enumerate_possible_outcomes(
    problem: Problem, s: Array, a: Array
) -> tuple[Ints, Reals, Outcome]:
    """The outcomes `[N]` of `exact` that can happen: of which row each is, and how likely."""
    probabilities, events = _enumerate_joint_events(
        _require_finite_chances(problem, problem.chance(s, a)), len(s)
    )
    row, _ = likely = np.nonzero(probabilities)
    drawn = tuple(event.reshape(probabilities.shape)[likely] for event in events)
    return row, probabilities[likely], problem.resolve_events(s[row], a[row], drawn)


def check_listing_size(problem: Problem, number_count: float) -> None:
    """Refuses a list of so many numbers of a problem's states, before it is made."""
    what = f"{type(problem).__name__}: a list of its states"
    Budget(what, "try a smaller problem", memory_limit=MAX_LISTING_BYTES).check_memory(
        24.0 * number_count
    )


def next_state_indices(problem: Problem, outcome: Outcome) -> Ints:
    """The indices `[B, K]` of the next states that `exact` lists."""
    rows, many, *state = outcome.state.shape
    return checked_state_indices(problem, outcome.state.reshape(rows * many, *state)).reshape(
        rows, many
    )


def checked_state_indices(problem: Problem, s: Array) -> Ints:
    """The place `[B]` of each state in `enumerated`; refuses what is no state of the problem."""
    places, count = problem.state_indices(s), problem.state_count
    if isinstance(count, int) and len(s) and not 0 <= places.min() <= places.max() < count:
        got = f"{places.min()} to {places.max()}"
        raise BadParameter(f"got states {got}, expected 0 to {count - 1}, as many as there are")
    return places


def initial_state_distribution(problem: Problem) -> tuple[Reals, Array]:
    """Every start state `[K, ...]` with its probability `[K]`; a state may come up twice."""
    probabilities, events = _enumerate_joint_events(
        _require_finite_chances(problem, problem.initial_chance(1)), 1
    )
    return probabilities[0], problem.initial_states(probabilities.shape[1], events)


def _require_finite_chances(
    problem: Problem, chances: tuple[Chance, ...]
) -> tuple[FiniteChance, ...]:
    finite = tuple(chance for chance in chances if isinstance(chance, FiniteChance))
    if len(finite) < len(chances):
        name = type(problem).__name__
        raise BadParameter(f"{name} draws real numbers: its outcomes cannot be listed")
    return finite


def _enumerate_joint_events(
    chances: tuple[FiniteChance, ...], rows: int
) -> tuple[Reals, tuple[Array, ...]]:
    """Probabilities `[B, K]` of all joint events, and these events, each `[B * K]`."""
    each = [np.broadcast_to(p, (rows, p.shape[1])) for p in (c.probabilities() for c in chances)]
    many = math.prod(p.shape[1] for p in each)
    what = f"listing {rows * many} outcomes one by one"
    budget = Budget(what, "try a smaller problem", memory_limit=MAX_LISTING_BYTES)
    budget.check_memory(8.0 * rows * many * (4 + 3 * len(each)))
    combined = np.indices([p.shape[1] for p in each]).reshape(len(each), many)
    probabilities = np.ones((rows, many))
    events = []
    for chosen, p in zip(combined, each, strict=True):
        probabilities = probabilities * p[:, chosen]
        # An event that cannot happen here is replaced by the first: its weight is 0 anyhow.
        events.append(np.where(p[:, chosen] > 0, chosen, 0).reshape(-1))
    return probabilities, tuple(events)
