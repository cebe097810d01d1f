"""The base classes of problems and policies, and the exact enumeration of outcomes."""

import inspect
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import Field, dataclass, field, fields
from functools import cached_property
from itertools import product
from typing import Any, ClassVar, NamedTuple, Protocol, Self, TypeGuard, TypeVar

import numpy as np

from dmplay import user_code_locations
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
from dmplay.work_budget import Budget

ACTION_DECIMALS = 9  # decimals of a real-valued action, so that its text is exactly the number
INTERVAL_GRID_SIZE = 21  # actions that represent an interval in a search
MAX_LISTING_BYTES = 384 * 2**20  # maximum bytes of an array over all states, or over their outcomes
INIT_REFUSED_MESSAGE = (
    "parameters are fields with a default, as `price: float = 5.0`, not of __init__"
)
NO_OBSERVATION_TEXT = "nothing yet"
WAIT_LABEL = "wait"  # label of the only legal action of an inactive agent
DEFAULT_PARAMETER_BOUND = 1e6  # largest absolute value of a parameter without bounds
READONLY_ERROR_WORDS = (
    "read-only",
    "WRITEABLE",
)  # in NumPy's errors for writing to an array, and for making it writable

T = TypeVar("T")
Memory = tuple[Array, ...]
UpdateMethod = TypeVar("UpdateMethod", bound=Callable[..., Memory])


class Labels(tuple[str, ...]):
    """A finite set of labels, like Gymnasium's Discrete; a value is the index of a label."""

    __slots__ = ()
    json_types: tuple[type, ...] = (str,)  # the types of an action in JSON

    @property
    def labels(self) -> "Labels":
        """The labels to choose from: all of them."""
        return self

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one observation: (), because it is an index."""
        return ()

    def null_observation(self, rows: int) -> Ints:
        """Return the null observations `[B]` used before the first turn: -1."""
        return np.full(rows, -1)

    def format_observation(self, observation: Array) -> str:
        """Return an observation as text: its label, or "nothing yet" for a null observation."""
        return NO_OBSERVATION_TEXT if observation < 0 else self[int(observation)]

    def parse_action(self, text: str) -> int:
        """Return the index of the action that a text names; raise UnknownName if there is none."""
        word = normalize_label(text)
        labels: Sequence[str] = self if word in self else [normalize_label(label) for label in self]
        if word not in labels:
            raise UnknownName("action", text.strip(), self)
        return labels.index(word)

    def format_action(self, action: float) -> str:
        """Return the label of an action."""
        return str(self[int(action)])

    to_json_value = format_action  # the value that a transcript records

    def validate_action(self, action: float, error_prefix: str, legal: Bools | None = None) -> int:
        """Return the action as an int; raise IllegalAction if it is not an index, or not legal."""
        if action not in range(len(self)):
            raise IllegalAction(
                f"{error_prefix}: got action {action}, expected 0 to {len(self) - 1}"
            )
        if legal is not None and not legal[int(action)]:
            message = (
                f"{self[int(action)]} is not legal now; "
                f"expected one of {self.describe_actions(legal)}"
            )
            raise IllegalAction(f"{error_prefix}: {message}")
        return int(action)

    def sample_actions(self, u: Reals, legal: Bools | None) -> Ints:
        """Return actions `[B]` by uniforms `[B]`; the legal ones `[B, A]` are equally likely."""
        return sample_uniform_index(len(self), u, legal)

    def candidate_actions(self) -> Ints:
        """Return the actions `[A]` that a search tries: all indices."""
        return np.arange(len(self))

    def describe_actions(self, legal: Bools | None = None) -> str:
        """Return the legal labels as comma-separated text; "" if there are none."""
        return ", ".join(self if legal is None else (self[a] for a in np.flatnonzero(legal)))


@dataclass(frozen=True)
class Interval:
    """A continuous action set with inclusive bounds, like Gymnasium's Box of one number."""

    low: float
    high: float
    json_types: ClassVar[tuple[type, ...]] = (int, float)  # the types of an action in JSON

    @property
    def labels(self) -> Labels:
        """The labels to choose from: none, because an action is a number."""
        return Labels()

    def parse_action(self, text: str) -> float:
        """Return the action that a text writes, rounded; raise BadParameter if it is out of
        bounds.
        """
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
        """Return the number with up to nine significant digits."""
        return f"{action:.9g}"

    def to_json_value(self, action: float) -> float:
        """Return the number as a transcript records it."""
        return float(action)

    def validate_action(
        self, action: float, error_prefix: str, legal: Bools | None = None
    ) -> float:
        """Return the action rounded to ACTION_DECIMALS; raise IllegalAction if it is out of
        bounds.
        """
        if not self.low <= action <= self.high:
            raise IllegalAction(
                f"{error_prefix}: got {action:g}, expected {self.describe_actions()}"
            )
        return round(float(action), ACTION_DECIMALS) + 0.0

    def sample_actions(self, u: Reals, legal: Bools | None) -> Reals:
        """Return uniformly distributed actions `[B]` by uniforms `[B]`."""
        return np.round(self.low + (self.high - self.low) * u, ACTION_DECIMALS)

    def candidate_actions(self) -> Reals:
        """Return the actions `[A]` that a search tries: an evenly spaced grid."""
        return np.asarray(
            np.round(np.linspace(self.low, self.high, INTERVAL_GRID_SIZE), ACTION_DECIMALS) + 0.0
        )

    def clip_actions(self, numbers: Reals) -> Reals:
        """Return the actions `[B]` closest to these numbers."""
        clipped = np.minimum(np.maximum(numbers, self.low), self.high)
        return np.asarray(clipped.round(ACTION_DECIMALS) + 0.0)

    def describe_actions(self, legal: Bools | None = None) -> str:
        """Return the interval as text."""
        return f"a number from {self.low:g} to {self.high:g}"


def normalize_label(text: str) -> str:
    """Return a typed name as labels are written: stripped, lower case, with hyphens."""
    return text.strip().lower().replace("_", "-")


@dataclass(frozen=True)
class RealVector:
    """The observation space of one real number, or of a vector of `size` real numbers."""

    size: int = 1

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one observation."""
        return (self.size,) if self.size > 1 else ()

    def null_observation(self, rows: int) -> Reals:
        """Return the null observations `[B, ...]` used before the first turn: NaN."""
        return np.full((rows, *self.shape), np.nan)

    def format_observation(self, observation: Array) -> str:
        """Return an observation as text, or "nothing yet" for a null observation."""
        if np.isnan(observation).any():
            return NO_OBSERVATION_TEXT
        return ", ".join(f"{number:.6g}" for number in np.atleast_1d(observation))

    def to_json_value(self, observation: Array) -> float | list[float]:
        """Return an observation as a transcript records it."""
        value: float | list[float] = observation.tolist()
        return value


@dataclass(frozen=True)
class TextLine:
    """The observation space of a line of text."""

    shape: ClassVar[tuple[int, ...]] = ()

    def null_observation(self, rows: int) -> Array:
        """Return the null observations `[B]` used before the first turn: empty texts."""
        return np.full(rows, "")

    def format_observation(self, observation: Array) -> str:
        """Return an observation as text, or "nothing yet" for a null observation."""
        return str(observation) or NO_OBSERVATION_TEXT

    def to_json_value(self, observation: Array) -> str:
        """Return an observation as a transcript records it."""
        return str(observation)


ObservationSpace = Labels | RealVector | TextLine  # the observation space of one agent


class ContinuousStates(NamedTuple):
    """A state space that is part of R^dimensions."""

    dimensions: int


class UniformCounts(NamedTuple):
    """The number of uniforms that one row consumes at the start, and in each turn."""

    start: int
    step: int


class Outcome(NamedTuple):
    """The outcome of one joint action, for B rows and n agents.

    The arrays are `state` `[B, ...]` and `rewards` `[B, n]`. In a partially observable problem,
    `observations` are label indices or texts `[B, n]`, or numbers `[B, n, size]`; else they are the
    next state itself.
    """

    state: Array  # [B, ...]
    rewards: Reals  # [B, n]
    observations: Array  # [B, n, ...]; the next state itself if it is fully observable


class Percept(NamedTuple):
    """The information that one seat receives in one turn, for B rows."""

    action: Array  # [B], the seat's own action
    observation: Array  # [B, ...]; the next state if it is fully observable
    actions: Array | None  # [B, n], the joint action if the state is fully observable
    reward: Reals | None  # [B], the seat's own reward if rewards are observable


FIELD_OMITTED = np.zeros(0)  # placeholder for a percept field that the policy does not read


class Policy(Protocol):
    """The interface of a policy for one seat, which plays a batch of one game or of many."""

    @property
    def uniform_count(self) -> int:
        """The number of uniforms that one row of one choice consumes."""

    def initial_memory(self, observation: Array) -> Memory:
        """Return the memory before the first turn: arrays whose first axis is the row.

        The observation is the initial state if it is fully observable, else a null observation: -1
        for labels, NaN for numbers, "" for texts.
        """

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the memory after a turn."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return an action for each row `[B]`; `legal` is `[B, A]`, `u` is `[B, uniform_count]`."""

    def action_values(self, memory: Memory) -> Reals | None:
        """Return the value of each action `[B, A]`, or None if the policy has no values."""


def requires_fields(*field_names: str) -> Callable[[UpdateMethod], UpdateMethod]:
    """Return a decorator for an `update_memory` that reads only these fields of a percept.

    In batches of games, the other fields are not copied for it.
    """

    def mark_update(update: UpdateMethod) -> UpdateMethod:
        """Store the field names on the method and return it."""
        vars(update)["required_fields"] = field_names
        return update

    return mark_update


def required_fields(policy: Policy) -> Collection[str]:
    """Return the percept fields that a policy reads: all, unless it declares fewer."""
    field_names: Collection[str] = getattr(policy.update_memory, "required_fields", Percept._fields)
    return field_names


def readonly_copy(array: Array) -> Array:
    """Return a read-only copy of an array."""
    copy = array.copy()
    copy.setflags(write=False)
    return copy


def array_bytes(array: Array) -> bytes:
    """Return the bytes of an array or a number; equal arrays have equal bytes."""
    if array.ndim:  # `data` would leave buffer information in the array for as long as it lives.
        return array.tobytes()
    return array.data.tobytes()


def select_seat_observations(observations: Array, seat: int) -> Array:
    """Return one seat's observations `[B, ...]` of those of all seats `[B, n, ...]`.

    NumPy stores texts with the length of the longest one. Texts are copied, because this length
    would reveal how long the other seats' texts are.
    """
    column: Array = observations[:, seat]
    return np.array(column.tolist(), str) if column.dtype.kind == "U" else column


def make_readonly(array: Array) -> Array:
    """Make a newly created array read-only and return it."""
    array.setflags(write=False)
    return array


def check_problem(problem: object, turn_limit: int | None) -> None:
    """Raise BadParameter unless this is a Problem and the turn limit is None, or 0 or more."""
    if not isinstance(problem, Problem):
        source = "dmplay.load_problem(NAME)"
        if isinstance(problem, type) and issubclass(problem, Problem):
            source = f"{problem.__name__}()"
        raise BadParameter(f"got {problem!r}, expected a problem, such as {source}")
    if turn_limit is not None and (not isinstance(turn_limit, INTEGER_TYPES) or turn_limit < 0):
        raise BadParameter(f"turns: got {turn_limit!r}, expected a whole number, 0 or more")


def check_rewards(problem: "Problem", rewards: Reals) -> None:
    """Raise BadParameter if a reward `[B, n]` is NaN, infinite or too large to be summed.

    The error names the line of user-defined code. Without it, a NaN would be written into files
    that no reader accepts.
    """
    if (
        rewards.min(initial=0.0) >= -MAX_REWARD  # False for NaN
        and rewards.max(initial=0.0) <= MAX_REWARD
    ):
        return
    invalid = ~(np.abs(rewards) <= MAX_REWARD)
    name = user_code_locations.locate_definition(type(problem), "resolve_events")
    raise BadParameter(
        f"{name or type(problem).__name__} resolve_events: got the reward {rewards[invalid][0]:g} "
        f"of {problem.agents[int(invalid.nonzero()[1][0])]}, expected a number "
        f"from {-MAX_REWARD:g} to {MAX_REWARD:g}"
    )


def check_policy(policy: object, seat: int) -> None:
    """Raise BadPolicy if this is not a policy, for example an agent's name or a class."""
    if isinstance(policy, type):
        name = policy.__name__
        expected = f"expected a policy made of it, as {name}(problem, {seat})"
        raise BadPolicy(f"seat {seat}: got the class {name}, {expected}")
    if not hasattr(policy, "choose"):
        expected = f"expected a policy, such as dmplay.load_agent(problem, {seat}, NAME)"
        raise BadPolicy(f"seat {seat}: got {policy!r}, {expected}")


def check_policies(problem: "Problem", policies: object) -> None:
    """Raise BadPolicy unless this is a sequence with a policy for each seat of a problem."""
    if not is_policy_sequence(policies) or len(policies) != len(problem.agents):
        got, agents = describe_policies(policies), ", ".join(problem.agents)
        raise BadPolicy(f"got {got}, expected one for each of {agents}")
    for seat, policy in enumerate(policies):
        check_policy(policy, seat)


def is_policy_sequence(policies: object) -> TypeGuard[Sequence[object]]:
    """Return whether this can be the policies of all seats: a sequence, but not a name."""
    return isinstance(policies, Sequence) and not isinstance(policies, str)


def describe_policies(policies: object) -> str:
    """Return the number of policies as text, or the repr of anything but a sequence."""
    if not is_policy_sequence(policies):
        return repr(policies)
    return f"{len(policies)} {'policy' if len(policies) == 1 else 'policies'}"


def call_policy(error_prefix: object, method: Callable[..., T], *args: object) -> T:
    """Return the result of a policy's method; raise BadPolicy if it writes to an argument."""
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
    """Return a dataclass field with a description and, for numbers, its bounds.

    A missing bound is a million in absolute value, or ten times the default if that is more.
    `exclusive_low` raises the lower bound by a millionth. A text must be one of `choices`, or any
    text if there are none.
    """
    bound = (
        max(DEFAULT_PARAMETER_BOUND, 10 * abs(default))
        if isinstance(default, int | float)
        else DEFAULT_PARAMETER_BOUND
    )
    low, high = -bound if low is None else low, bound if high is None else high
    low += 1 / DEFAULT_PARAMETER_BOUND if exclusive_low else 0
    metadata = {"meaning": description, "low": low, "high": high, "among": choices}
    return field(default=default, metadata=metadata)


INTEGER_TYPES, NUMBER_TYPES = (int, np.integer), (int, float, np.number)
MAX_REWARD = 1e290  # of one turn; the sum over any game is finite, too
# type of the default -> name of the expected type, accepted types
PARAMETER_TYPES: Mapping[type, tuple[str, tuple[type, ...]]] = {
    int: ("a whole number", INTEGER_TYPES),
    float: ("a number", NUMBER_TYPES),
    bool: ("true or false", (bool, np.bool_)),
    str: ("text", (str,)),
}
MAX_PRINTED_NUMBER = 1e300  # largest number that an error message prints


def check_parameters(instance: Any) -> None:
    """Raise BadParameter if a dataclass parameter has a wrong type or is out of bounds."""
    for parameter_field in fields(instance):
        if "low" in parameter_field.metadata and type(parameter_field.default) in PARAMETER_TYPES:
            _check_parameter(getattr(instance, parameter_field.name), parameter_field)


def _check_parameter(value: object, parameter_field: Field[Any]) -> None:
    """Raise BadParameter if one parameter, a number, a flag or a text, has an invalid value."""
    type_name, types = PARAMETER_TYPES[type(parameter_field.default)]
    is_bool = isinstance(value, bool | np.bool_)
    if not isinstance(value, types) or is_bool != isinstance(parameter_field.default, bool):
        raise BadParameter(f"{parameter_field.name}: got {value!r}, expected {type_name}")
    if isinstance(value, str) and value not in (parameter_field.metadata["among"] or (value,)):
        allowed_texts = ", ".join(parameter_field.metadata["among"])
        raise BadParameter(
            f"{parameter_field.name}: got {value!r}, expected one of {allowed_texts}"
        )
    if is_bool or isinstance(value, str):
        return
    number: Any = value
    low, high = (parameter_field.metadata[key] for key in ("low", "high"))
    if not low <= number <= high:
        got = f"{number:g}" if abs(number) <= MAX_PRINTED_NUMBER else "a number beyond all bounds"
        upper_text = (
            f" and at most {high:g}" if high < DEFAULT_PARAMETER_BOUND or number > high else ""
        )
        raise BadParameter(
            f"{parameter_field.name}: got {got}, expected a number at least {low:g}{upper_text}"
        )


@dataclass(frozen=True)
class Problem(ABC):
    """A decision problem with n agents and one Markov state.

    Arrays are batch-first and C-ordered. An attribute that never varies is a plain class attribute;
    one that depends on the parameters is a property. The dynamics are `chance` and
    `resolve_events`; everything else is derived from these two.
    """

    discount: float = parameter(1.0, "factor on the rewards of each later turn", 0.0, 1.0)

    def __init_subclass__(cls) -> None:
        """Use a class attribute with a parameter's name, such as `discount = 0.95`, as its
        default.
        """
        super().__init_subclass__()
        if "__init__" in vars(cls):
            location = user_code_locations.locate_definition(cls, "__init__")
            raise BadParameter(f"{location} __init__: {INIT_REFUSED_MESSAGE}")
        bases = [_ensure_dataclass(base) for base in cls.__bases__ if issubclass(base, Problem)]
        inherited_types = {
            base_field.name: base_field.type for base in bases for base_field in fields(base)
        }
        annotations = inspect.get_annotations(cls)
        new_default_types = {
            name: inherited_types[name]
            for name in inherited_types
            if name in vars(cls) and name not in annotations
        }
        if new_default_types:
            cls.__annotations__ = new_default_types | annotations

    def __new__(cls, *args: object, **kwargs: object) -> Self:
        """Return an instance; a subclass without a decorator becomes a dataclass first."""
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
        """The number of actions of each agent; 0 if its actions are real numbers."""
        return tuple(len(action_set.labels) for action_set in self.actions)

    @property
    def observations(self) -> tuple[ObservationSpace, ...]:
        """The observation space of each agent, all of one type; () if agents see the state."""
        return ()

    @cached_property
    def observation_counts(self) -> tuple[int, ...]:
        """The number of possible observations of each agent; BadParameter if they have no
        labels.
        """
        labels = [space for space in self.observations if isinstance(space, Labels)]
        if len(labels) < len(self.observations):
            name = type(self).__name__
            raise BadParameter(f"{name} has observations without labels: they cannot be listed")
        return tuple(map(len, labels))

    @cached_property
    def partially_observable(self) -> bool:
        """True if agents see less than the state."""
        return bool(self.observations)

    @property
    def state_count(self) -> int | float | ContinuousStates:
        """The number of states, `math.inf`, or a part of R^dimensions; 1 for simple games."""
        return 1

    @property
    def horizon(self) -> int | None:
        """The default number of turns in play, or None; the dynamics have no horizon."""
        return None

    @property
    def can_run_forever(self) -> bool:
        """True if a game may never end, so that games of agents alone need a turn limit."""
        return True

    @property
    def shared_reward(self) -> bool:
        """True if all agents always receive the same reward."""
        return False

    @property
    def reward_bounds(self) -> tuple[float, float] | None:
        """The smallest and the largest reward of a turn, or None if unknown."""
        return None

    @property
    def state_bounds(self) -> tuple[Array, Array] | None:
        """The smallest and the largest value of each number of a state, or None if unknown."""
        return None

    @property
    def rewards_observable(self) -> bool:
        """True if a seat may see its reward each turn; by default only if states are not hidden."""
        return not self.partially_observable

    @property
    def action_aliases(self) -> Mapping[str, str]:
        """Other names of actions: alias -> label."""
        return {}

    def __post_init__(self) -> None:
        """Raise BadParameter if a parameter has a wrong type or is out of bounds."""
        check_parameters(self)

    @abstractmethod
    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Return the independent chances that are sampled before the game."""

    @abstractmethod
    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """Return the initial states `[rows, ...]` for the sampled events."""

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Return the independent chances that are sampled in this turn; none unless overridden."""
        return ()

    @abstractmethod
    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Return the outcome of the joint actions `a` in the states `s` for the sampled events."""

    @abstractmethod
    def format_state(self, s: Array) -> str:
        """Return one state, without the batch axis, as a line of text that loses nothing."""

    @abstractmethod
    def parse_state(self, text: str) -> Array:
        """Return the state that `format_state` wrote."""

    def terminal(self, s: Array) -> Bools:
        """Return a mask `[B]` of the terminal states, which absorb and have reward 0."""
        return np.zeros(len(s), bool)

    def legal_actions_mask(self, s: Array) -> Bools | None:
        """Return the mask `[B, n, A]` of the legal actions; None if all are legal."""
        return None

    def action_labels(self, s: Array) -> tuple[Labels, ...] | None:
        """Return the action labels of each agent in one state, or None if they do not depend on it.

        There are as many as in `actions`, whose labels mean the same in every state and are those
        that transcripts record. A seat reads its labels, so they must reveal only what the seat may
        know.
        """
        return None

    def inactive_agents(self, s: Array) -> Bools:
        """Return a mask `[B, n]` of the inactive agents, whose only legal action is to wait."""
        inactive = np.zeros((len(s), len(self.agents)), bool)
        legal = self.legal_actions_mask(s) if len(self.agents) > 1 else None
        if legal is None:
            return inactive
        for seat, action_set in enumerate(self.actions):
            if WAIT_LABEL in action_set.labels:
                seat_legal = legal[:, seat]
                inactive[:, seat] = seat_legal[:, action_set.labels.index(WAIT_LABEL)] & (
                    seat_legal.sum(axis=1) == 1
                )
        return inactive

    def wait_action(self, seat: int) -> int:
        """Return the index of the wait action of a seat."""
        return self.actions[seat].labels.index(WAIT_LABEL)

    def format_transcript_state(self, s: Array) -> str:
        """Return the state as transcripts record it: `format_state`, unless it grows with the
        game.
        """
        return self.format_state(s)

    def description(self) -> str:
        """Return the description of the problem: the docstring of its class."""
        return inspect.getdoc(type(self)) or ""

    def enumerate_states(self) -> Array:
        """Return all states of a finite problem `[S, ...]` in index order; else raise
        BadParameter.
        """
        if not isinstance(self.state_count, int):
            raise BadParameter(f"{type(self).__name__} has no finite list of states")
        check_listing_size(self, self.state_count)
        return np.arange(self.state_count)

    def state_indices(self, s: Array) -> Ints:
        """Return the index `[B]` of each state in `enumerate_states`."""
        return s

    def joint_belief_update(
        self, belief: Reals, actions: Sequence[int | None], observations: Sequence[int | None]
    ) -> Reals:
        """Return the joint probability `[S]` of these observations and each next state.

        The current state has the distribution `belief` `[S]`. None means unknown: an unknown action
        is taken to be uniformly random, an unknown observation is ignored.
        """
        support = np.flatnonzero(belief)
        pairs = zip(actions, self.action_counts, strict=True)
        options = [range(action_count) if a is None else (a,) for a, action_count in pairs]
        joint_actions = np.array(list(product(*options)))
        states = self.enumerate_states()[support]
        p, outcome = enumerate_outcomes(
            self,
            np.repeat(states, len(joint_actions), axis=0),
            np.tile(joint_actions, (len(states), 1)),
        )
        weight = p * np.repeat(belief[support] / len(joint_actions), len(joint_actions))[:, None]
        for seat, observation in enumerate(observations):
            if observation is not None:
                weight = weight * (outcome.observations[:, :, seat] == observation)
        next_states = next_state_indices(self, outcome).reshape(-1)
        return np.bincount(next_states, weight.reshape(-1), minlength=len(belief)).astype(float)

    @cached_property
    def uniform_counts(self) -> UniformCounts:
        """The number of uniforms that one row consumes at the start, and in each turn."""
        initial_chances = self.initial_chance(1)
        start_count = sum(chance.uniform_count for chance in initial_chances)
        s = self.initial_states(1, sample_all(initial_chances, np.zeros((1, start_count))))
        a = np.array([[action_set.candidate_actions()[0] for action_set in self.actions]])
        return UniformCounts(start_count, sum(chance.uniform_count for chance in self.chance(s, a)))

    def sample_initial_states(self, u: Reals) -> Array:
        """Return initial states `[B, ...]` from uniforms `[B, uniform_counts.start]`."""
        return self.initial_states(len(u), sample_all(self.initial_chance(len(u)), u))

    def step(self, s: Array, a: Array, u: Reals) -> Outcome:
        """Return the outcome of one turn of B rows.

        The states are `s`, the joint actions `a` `[B, n]`, the uniforms `u` `[B,
        uniform_counts.step]`.
        """
        return self.resolve_events(s, a, sample_all(self.chance(s, a), u))

    def initial_observations(self, s: Array) -> Array:
        """Return the observations `[B, n, ...]` of hidden initial states; null unless
        overridden.
        """
        return np.stack([space.null_observation(len(s)) for space in self.observations], axis=1)

    def initial_observation(self, s: Array, seat: int) -> Array:
        """Return a seat's initial observations `[B, ...]`: the states if it sees them."""
        return readonly_copy(
            select_seat_observations(self.initial_observations(s), seat)
            if self.partially_observable
            else s
        )

    def build_percept(
        self,
        seat: int,
        actions: Array,
        outcome: Outcome,
        field_names: Collection[str] = Percept._fields,
    ) -> Percept:
        """Return the information that a turn with joint actions `[B, n]` gives a seat, as copies.

        Only the fields in `field_names` are copied; the others are empty.
        """

        def copy_if_required(name: str, array: Array) -> Array:
            """Return a copy of an array if its field is required, else FIELD_OMITTED."""
            return readonly_copy(array) if name in field_names else FIELD_OMITTED

        observation = (
            select_seat_observations(outcome.observations, seat)
            if self.partially_observable
            else outcome.observations
        )
        return Percept(
            copy_if_required("action", actions[:, seat]),
            copy_if_required("observation", observation),
            None if self.partially_observable else copy_if_required("actions", actions),
            copy_if_required("reward", outcome.rewards[:, seat])
            if self.rewards_observable
            else None,
        )

    @property
    def kind(self) -> str:
        """The class of problem, such as MDP, POMDP or Markov game, derived from its attributes."""
        if self.state_count == 1:
            return "simple game"
        if len(self.agents) == 1:
            return "POMDP" if self.partially_observable else "MDP"
        if not self.partially_observable:
            return "Markov game"
        return "Dec-POMDP" if self.shared_reward else "POMG"

    def seat_index(self, name: str) -> int:
        """Return the index of the agent with this name; raise UnknownName if there is none."""
        if name not in self.agents:
            raise UnknownName("seat", name, self.agents)
        return int(self.agents.index(name))

    def parse_action(self, seat: int, text: str) -> float:
        """Return the action that a typed text names: an index, or a number of the interval."""
        return self.actions[seat].parse_action(self.action_aliases.get(normalize_label(text), text))

    def format_action(self, seat: int, action: float) -> str:
        """Return the label of an action, or its number as text."""
        return self.actions[seat].format_action(action)


def _ensure_dataclass(problem_class: type[Problem]) -> type[Problem]:
    """Return a subclass as a frozen dataclass, applying the decorator if it is missing."""
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
    """Return every outcome of joint actions in these states, with its probability.

    The states `s` are `[B, ...]`, the joint actions `a` `[B, n]`, given as indices. The
    probabilities are `[B, K]`, the arrays of the outcomes `[B, K, ...]`. Raise IllegalAction for an
    index without an action, BadParameter if chance samples real numbers, BudgetExceeded if there
    are too many outcomes to list. The states, and the legality of the actions in them, are not
    checked.
    """
    check_problem(problem, None)
    for agent, action_set, seat_actions in zip(problem.agents, problem.actions, a.T, strict=True):
        for action in (
            (seat_actions.min(), seat_actions.max()) if action_set.labels and len(a) else ()
        ):
            action_set.validate_action(action.item(), agent)
    chances = _require_finite_chances(problem, problem.chance(s, a))
    row_count = len(s)
    probabilities, events = _enumerate_joint_events(chances, row_count)
    event_count = probabilities.shape[1]
    outcome = problem.resolve_events(
        np.repeat(s, event_count, axis=0), np.repeat(a, event_count, axis=0), events
    )
    check_rewards(problem, outcome.rewards)
    arrays = [array.reshape(row_count, event_count, *array.shape[1:]) for array in outcome]
    return OutcomeDistribution(probabilities, Outcome(*arrays))


def enumerate_possible_outcomes(
    problem: Problem, s: Array, a: Array
) -> tuple[Ints, Reals, Outcome]:
    """Return the N outcomes of positive probability: their rows, probabilities and outcomes."""
    probabilities, events = _enumerate_joint_events(
        _require_finite_chances(problem, problem.chance(s, a)), len(s)
    )
    row, _ = nonzero = np.nonzero(probabilities)
    possible_events = tuple(event.reshape(probabilities.shape)[nonzero] for event in events)
    outcome = problem.resolve_events(s[row], a[row], possible_events)
    check_rewards(problem, outcome.rewards)
    return row, probabilities[nonzero], outcome


def check_listing_size(problem: Problem, number_count: float) -> None:
    """Raise BudgetExceeded if a list of this many numbers over the states would be too large."""
    task = f"{type(problem).__name__}: a list of its states"
    Budget(task, "try a smaller problem", memory_limit=MAX_LISTING_BYTES).check_memory(
        24.0 * number_count
    )


def next_state_indices(problem: Problem, outcome: Outcome) -> Ints:
    """Return the indices `[B, K]` of the next states that `enumerate_outcomes` lists."""
    row_count, event_count, *state_shape = outcome.state.shape
    return checked_state_indices(
        problem, outcome.state.reshape(row_count * event_count, *state_shape)
    ).reshape(row_count, event_count)


def checked_state_indices(problem: Problem, s: Array) -> Ints:
    """Return the index `[B]` of each state; raise BadParameter for an invalid state."""
    indices, count = problem.state_indices(s), problem.state_count
    if isinstance(count, int) and len(s) and not 0 <= indices.min() <= indices.max() < count:
        index_range = f"{indices.min()} to {indices.max()}"
        raise BadParameter(
            f"got states {index_range}, expected 0 to {count - 1}, as many as there are"
        )
    return indices


def initial_state_distribution(problem: Problem) -> tuple[Reals, Array]:
    """Return the probabilities `[K]` and the initial states `[K, ...]`; a state may occur twice."""
    probabilities, events = _enumerate_joint_events(
        _require_finite_chances(problem, problem.initial_chance(1)), 1
    )
    return probabilities[0], problem.initial_states(probabilities.shape[1], events)


def _require_finite_chances(
    problem: Problem, chances: tuple[Chance, ...]
) -> tuple[FiniteChance, ...]:
    """Return the chances; raise BadParameter if one of them samples real numbers."""
    finite = tuple(chance for chance in chances if isinstance(chance, FiniteChance))
    if len(finite) < len(chances):
        name = type(problem).__name__
        raise BadParameter(f"{name} draws real numbers: its outcomes cannot be listed")
    return finite


def _enumerate_joint_events(
    chances: tuple[FiniteChance, ...], rows: int
) -> tuple[Reals, tuple[Array, ...]]:
    """Return the probabilities `[B, K]` of all joint events, and the events, each `[B * K]`."""
    distributions = [
        np.broadcast_to(p, (rows, p.shape[1])) for p in (c.probabilities() for c in chances)
    ]
    joint_count = math.prod(p.shape[1] for p in distributions)
    task = f"listing {rows * joint_count} outcomes one by one"
    budget = Budget(task, "try a smaller problem", memory_limit=MAX_LISTING_BYTES)
    budget.check_memory(8.0 * rows * joint_count * (4 + 3 * len(distributions)))
    event_grid = np.indices([p.shape[1] for p in distributions]).reshape(
        len(distributions), joint_count
    )
    probabilities = np.ones((rows, joint_count))
    events = []
    for indices, p in zip(event_grid, distributions, strict=True):
        probabilities = probabilities * p[:, indices]
        # An impossible event is replaced by the first one; its weight is 0 in any case.
        events.append(np.where(p[:, indices] > 0, indices, 0).reshape(-1))
    return probabilities, tuple(events)
