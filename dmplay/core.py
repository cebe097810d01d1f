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
from dmplay.chance import Array, Bools, Chance, Finite, Ints, Reals, anyone, sample
from dmplay.errors import BadParameter, BadPolicy, IllegalAction, UnknownName

DECIMALS = 9  # of a real-valued action, so that its text is the number
GRID = 21  # actions that stand for an interval
LISTED = 384 * 2**20  # bytes of all states of a problem, or of what may come of them
PARAMETERS = "parameters are fields with a default, as `price: float = 5.0`, not of __init__"
NOTHING_YET = "nothing yet"
WAIT = "wait"  # the action of an agent whose turn it is not, where it is the only one
MOST_SHARED = 4096  # arrays of which one is told again where another is the same
LARGEST = 1e6  # a parameter that says no bounds of its own, either way
LOCKED = ("read-only", "WRITEABLE")  # what is said of a write, and of the wish to write

T = TypeVar("T")
Memory = tuple[Array, ...]
Update = TypeVar("Update", bound=Callable[..., Memory])


class Labels(tuple[str, ...]):
    """A finite set of names; the index is the value."""

    __slots__ = ()
    written: tuple[type, ...] = (str,)  # the types of an action in JSON

    @property
    def labels(self) -> "Labels":
        """The names to choose from: all of them."""
        return self

    @property
    def shape(self) -> tuple[int, ...]:
        """That of one observation: an index."""
        return ()

    def unseen(self, rows: int) -> Ints:
        """What stands for nothing observed before the first turn `[B]`."""
        return np.full(rows, -1)

    def told(self, observation: Array) -> str:
        """An observation in words."""
        return NOTHING_YET if observation < 0 else self[int(observation)]

    def read(self, text: str) -> int:
        """The action that a text names."""
        word = plain(text)
        known: Sequence[str] = self if word in self else [plain(label) for label in self]
        if word not in known:
            raise UnknownName("action", text.strip(), self)
        return known.index(word)

    def name(self, action: float) -> str:
        """The label of an action."""
        return str(self[int(action)])

    fact = name  # as a transcript has it

    def check(self, action: float, where: str, legal: Bools | None = None) -> int:
        """The action as it will act; raises IllegalAction for what is no index, or not legal."""
        if action not in range(len(self)):
            raise IllegalAction(f"{where}: got action {action}, expected 0 to {len(self) - 1}")
        if legal is not None and not legal[int(action)]:
            told = f"{self[int(action)]} is not legal now; expected one of {self.words(legal)}"
            raise IllegalAction(f"{where}: {told}")
        return int(action)

    def draw(self, u: Reals, legal: Bools | None) -> Ints:
        """Actions `[B]` by uniforms `[B]`, each that is legal `[B, A]` as likely."""
        return anyone(len(self), u, legal)

    def grid(self) -> Ints:
        """The actions `[A]` that a search tries."""
        return np.arange(len(self))

    def words(self, legal: Bools | None = None) -> str:
        """The legal ones in words; '' for none."""
        return ", ".join(self if legal is None else (self[a] for a in np.flatnonzero(legal)))


@dataclass(frozen=True)
class Interval:
    """A continuous action set, bounds included."""

    low: float
    high: float
    written: ClassVar[tuple[type, ...]] = (int, float)  # the types of an action in JSON

    @property
    def labels(self) -> Labels:
        """The names to choose from: none, an action is a number."""
        return Labels()

    def read(self, text: str) -> float:
        """The action that a text writes."""
        try:
            value = round(float(text), DECIMALS) if text.isascii() and "_" not in text else math.nan
        except ValueError:
            value = math.nan
        if not self.low <= value <= self.high:
            raise BadParameter(f"action: got {text.strip()!r}, expected {self.words()}")
        return value + 0.0

    def name(self, action: float) -> str:
        """The number, in as many digits as it has."""
        return f"{action:.9g}"

    def fact(self, action: float) -> float:
        """The number, as a transcript has it."""
        return float(action)

    def check(self, action: float, where: str, legal: Bools | None = None) -> float:
        """The action as it will act; raises IllegalAction for what is out of bounds."""
        if not self.low <= action <= self.high:
            raise IllegalAction(f"{where}: got {action:g}, expected {self.words()}")
        return round(float(action), DECIMALS) + 0.0

    def draw(self, u: Reals, legal: Bools | None) -> Reals:
        """Actions `[B]` by uniforms `[B]`, each as likely."""
        return np.round(self.low + (self.high - self.low) * u, DECIMALS)

    def grid(self) -> Reals:
        """The actions `[A]` that a search tries."""
        return np.asarray(np.round(np.linspace(self.low, self.high, GRID), DECIMALS) + 0.0)

    def nearest(self, numbers: Reals) -> Reals:
        """The actions `[B]` that are closest to these numbers."""
        within = np.minimum(np.maximum(numbers, self.low), self.high)
        return np.asarray(within.round(DECIMALS) + 0.0)

    def words(self, legal: Bools | None = None) -> str:
        """The span in words."""
        return f"a number from {self.low:g} to {self.high:g}"


def plain(text: str) -> str:
    """A typed name as labels are written."""
    return text.strip().lower().replace("_", "-")


@dataclass(frozen=True)
class Numbers:
    """What an agent observes as real numbers: one, or a vector of so many."""

    many: int = 1

    @property
    def shape(self) -> tuple[int, ...]:
        """That of one observation."""
        return (self.many,) if self.many > 1 else ()

    def unseen(self, rows: int) -> Reals:
        """What stands for nothing before the first turn `[B, ...]`."""
        return np.full((rows, *self.shape), np.nan)

    def told(self, observation: Array) -> str:
        """An observation in words."""
        if np.isnan(observation).any():
            return NOTHING_YET
        return ", ".join(f"{number:.6g}" for number in np.atleast_1d(observation))

    def fact(self, observation: Array) -> float | list[float]:
        """An observation as a transcript has it."""
        found: float | list[float] = observation.tolist()
        return found


@dataclass(frozen=True)
class Texts:
    """What an agent observes as a line of text."""

    shape: ClassVar[tuple[int, ...]] = ()

    def unseen(self, rows: int) -> Array:
        """What stands for nothing before the first turn `[B]`."""
        return np.full(rows, "")

    def told(self, observation: Array) -> str:
        """An observation in words."""
        return str(observation) or NOTHING_YET

    def fact(self, observation: Array) -> str:
        """An observation as a transcript has it."""
        return str(observation)


Sight = Labels | Numbers | Texts  # what an agent can observe


class Continuous(NamedTuple):
    """A state space that is part of R^dimensions."""

    dimensions: int


class Draws(NamedTuple):
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


UNHEEDED = np.zeros(0)  # stands for what nobody looks at


class Policy(Protocol):
    """How one seat of a problem acts; batch-first, so that it plays one game or many at once."""

    @property
    def draws(self) -> int:
        """How many uniforms one row of one choice consumes."""

    def begin(self, observation: Array) -> Memory:
        """The memory before the first turn: arrays, first axis the row.

        The observation is the start state where agents see everything, else nothing: -1 of labels,
        NaN of numbers, '' of texts.
        """

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """The memory after a turn."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """An action for each row `[B]`; `legal` `[B, A]`, `u` `[B, draws]`."""

    def values(self, memory: Memory) -> Reals | None:
        """The value of each action `[B, A]`, where the policy knows it."""


def heeds(*parts: str) -> Callable[[Update], Update]:
    """Marks an `update` that looks at these parts of a percept alone: in many games at once the
    others are not copied for it.
    """

    def marked(update: Update) -> Update:
        vars(update)["heeds"] = parts
        return update

    return marked


def heeded(policy: Policy) -> Collection[str]:
    """The parts of a percept that a policy looks at: all, unless it says so."""
    found: Collection[str] = getattr(policy.update, "heeds", Percept._fields)
    return found


def own(array: Array) -> Array:
    """A copy that shares nothing with the game, and that nobody writes into."""
    copied = array.copy()
    copied.setflags(write=False)
    return copied


def raw(array: Array) -> bytes:
    """The bytes of an array, or of one number: what is the same has the same."""
    if array.ndim:  # an array keeps what its `data` needs as long as it lives
        return array.tobytes()
    return array.data.tobytes()


def lasting(array: Array) -> Array:
    """A copy into which nobody ever can write; where its like was told before, that one."""
    return own(array) if array.dtype.hasobject else _bytes(raw(array), array.dtype, array.shape)


@lru_cache(MOST_SHARED)
def _bytes(known: bytes, dtype: "np.dtype[Any]", shape: tuple[int, ...]) -> Array:
    return np.ndarray(shape, dtype, known)


def locked(array: Array) -> Array:
    """An array that was just made, into which nobody writes from now on."""
    array.setflags(write=False)
    return array


def check_problem(problem: object, turns: int | None) -> None:
    """Refuses what is no problem, as its name is not, and what is no number of turns."""
    if not isinstance(problem, Problem):
        raise BadParameter(f"got {problem!r}, expected a problem, as of dmplay.load")
    if turns is not None and (not isinstance(turns, WHOLE) or turns < 0):
        raise BadParameter(f"turns: got {turns!r}, expected a whole number, 0 or more")


def check_policy(policy: object, seat: int) -> None:
    """Refuses what is no policy, as an agent's name is not."""
    if not hasattr(policy, "choose"):
        told = f"expected a policy, as of dmplay.agent(problem, {seat}, ...)"
        raise BadPolicy(f"seat {seat}: got {policy!r}, {told}")


def asked(where: object, answer: Callable[..., T], *given: object) -> T:
    """What a policy's method answers; raises BadPolicy where it writes into what it is given."""
    try:
        return answer(*given)
    except ValueError as error:
        if not any(word in str(error) for word in LOCKED):
            raise
        name = answer.__qualname__
        raise BadPolicy(f"{where}: {name} writes into what it was given; copy it first") from None


def parameter(  # noqa: PLR0913 - each is the problem's to choose
    default: T,
    meaning: str,
    low: float | None = None,
    high: float | None = None,
    *,
    above: bool = False,
    among: Sequence[str] = (),
) -> T:
    """A dataclass field with its meaning and, for numbers, its bounds.

    Without bounds of its own a number is at most a million, or ten times its default; one that must
    be `above` its low is so by a millionth at least. A word is one of those that it is said to be
    `among`, or any.
    """
    far = max(LARGEST, 10 * abs(default)) if isinstance(default, int | float) else LARGEST
    low, high = -far if low is None else low, far if high is None else high
    low += 1 / LARGEST if above else 0
    facts = {"meaning": meaning, "low": low, "high": high, "among": among}
    return field(default=default, metadata=facts)


WHOLE, NUMBER = (int, np.integer), (int, float, np.number)
KINDS: Mapping[type, tuple[str, tuple[type, ...]]] = {  # what may stand for a default
    int: ("a whole number", WHOLE),
    float: ("a number", NUMBER),
    bool: ("true or false", (bool, np.bool_)),
    str: ("text", (str,)),
}
FARTHEST = 1e300  # a number that can be told


def check_bounds(made: Any) -> None:
    """Refuses what the `parameter` of a dataclass cannot be: another kind, or out of bounds."""
    for one in fields(made):
        if "low" in one.metadata and type(one.default) in KINDS:
            _check(getattr(made, one.name), one)


def _check(value: object, one: Field[Any]) -> None:
    """Refuses one value of a parameter that is a number, a flag or a word."""
    words, kinds = KINDS[type(one.default)]
    flag = isinstance(value, bool | np.bool_)
    if not isinstance(value, kinds) or flag != isinstance(one.default, bool):
        raise BadParameter(f"{one.name}: got {value!r}, expected {words}")
    if isinstance(value, str) and value not in (one.metadata["among"] or (value,)):
        among = ", ".join(one.metadata["among"])
        raise BadParameter(f"{one.name}: got {value!r}, expected one of {among}")
    if flag or isinstance(value, str):
        return
    number: Any = value
    low, high = (one.metadata[key] for key in ("low", "high"))
    if not low <= number <= high:
        got = f"{number:g}" if abs(number) <= FARTHEST else "a number beyond all bounds"
        most = f" and at most {high:g}" if high < LARGEST or number > high else ""
        raise BadParameter(f"{one.name}: got {got}, expected a number at least {low:g}{most}")


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
            where = places.place(cls, "__init__")
            raise BadParameter(f"{where} __init__: {PARAMETERS}")
        bases = [_settled(base) for base in cls.__bases__ if issubclass(base, Problem)]
        known = {one.name: one.type for base in bases for one in fields(base)}
        own = inspect.get_annotations(cls)
        plain = {name: known[name] for name in known if name in vars(cls) and name not in own}
        if plain:
            cls.__annotations__ = plain | own

    def __new__(cls, *given: object, **named: object) -> Self:
        """An instance, of a subclass without a decorator too."""
        _settled(cls)
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
    def observations(self) -> tuple[Sight, ...]:
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
    def hidden(self) -> bool:
        """Whether agents see less than the state."""
        return bool(self.observations)

    @property
    def states(self) -> int | float | Continuous:
        """How many states: a count, `math.inf`, or a part of R^dimensions; 1 for simple games."""
        return 1

    @property
    def horizon(self) -> int | None:
        """The default number of turns: one of play, the dynamics have none."""
        return None

    @property
    def endless(self) -> bool:
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
    def rewards_observed(self) -> bool:
        """Whether a seat may see its reward each turn; a hidden state it would betray."""
        return not self.hidden

    @property
    def aliases(self) -> Mapping[str, str]:
        """Other names of actions."""
        return {}

    def __post_init__(self) -> None:
        """Refuses parameters out of bounds."""
        check_bounds(self)

    @abstractmethod
    def opening(self, rows: int) -> tuple[Chance, ...]:
        """What nature draws before the game."""

    @abstractmethod
    def place(self, rows: int, events: tuple[Array, ...]) -> Array:
        """The start states `[rows, ...]` that these draws mean."""

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """What nature draws in this turn: independent chances; nothing unless overridden."""
        return ()

    @abstractmethod
    def move(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """What happens when the draws come out so."""

    @abstractmethod
    def notation(self, s: Array) -> str:
        """One state, without the batch axis, as one line of text that loses nothing."""

    @abstractmethod
    def parse(self, text: str) -> Array:
        """The state that `notation` wrote."""

    def terminal(self, s: Array) -> Bools:
        """Which rows are over; a terminal state absorbs and pays nothing."""
        return np.zeros(len(s), bool)

    def legal(self, s: Array) -> Bools | None:
        """Which actions `[B, n, A]` the state allows; None for all."""
        return None

    def called(self, s: Array) -> tuple[Labels, ...] | None:
        """What the actions of each agent are called in one state, where that depends on it.

        As many names as there are labels in `actions`, which mean the same in every state, and
        which transcripts hold; None stands for these. A seat reads its names: they tell it no more
        than it may know.
        """
        return None

    def waiting(self, s: Array) -> Bools:
        """Which agents `[B, n]` are not asked, as it is another's turn: all they may is wait."""
        waits = np.zeros((len(s), len(self.agents)), bool)
        legal = self.legal(s) if len(self.agents) > 1 else None
        if legal is None:
            return waits
        for seat, known in enumerate(self.actions):
            if WAIT in known.labels:
                able = legal[:, seat]
                waits[:, seat] = able[:, known.labels.index(WAIT)] & (able.sum(axis=1) == 1)
        return waits

    def waits(self, seat: int) -> int:
        """The action of a seat that only waits."""
        return self.actions[seat].labels.index(WAIT)

    def line(self, s: Array) -> str:
        """What a transcript writes of a state: its notation, unless that grows with the game."""
        return self.notation(s)

    def story(self) -> str:
        """What it is, in the words of whoever wrote it."""
        return inspect.getdoc(type(self)) or ""

    def enumerated(self) -> Array:
        """Every state of a finite problem `[S, ...]`, in the order of their indices."""
        if not isinstance(self.states, int):
            raise BadParameter(f"{type(self).__name__} has no finite list of states")
        listing(self, self.states)
        return np.arange(self.states)

    def index(self, s: Array) -> Ints:
        """The place `[B]` of each state in `enumerated`."""
        return s

    def carry(
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
        states = self.enumerated()[support]
        p, outcome = exact(
            self, np.repeat(states, len(choices), axis=0), np.tile(choices, (len(states), 1))
        )
        weight = p * np.repeat(belief[support] / len(choices), len(choices))[:, None]
        for seat, observation in enumerate(observations):
            if observation is not None:
                weight = weight * (outcome.observations[:, :, seat] == observation)
        after = reached(self, outcome).reshape(-1)
        return np.bincount(after, weight.reshape(-1), minlength=len(belief)).astype(float)

    @cached_property
    def draws(self) -> Draws:
        """How many uniforms one row of the opening and of a turn consumes."""
        opening = self.opening(1)
        start = sum(chance.draws for chance in opening)
        s = self.place(1, sample(opening, np.zeros((1, start))))
        a = np.array([[known.grid()[0] for known in self.actions]])
        return Draws(start, sum(chance.draws for chance in self.chance(s, a)))

    def start(self, u: Reals) -> Array:
        """Start states `[B, ...]` from uniforms `[B, draws.start]`."""
        return self.place(len(u), sample(self.opening(len(u)), u))

    def step(self, s: Array, a: Array, u: Reals) -> Outcome:
        """One turn of B rows: states, joint actions `[B, n]`, uniforms `[B, draws.step]`."""
        return self.move(s, a, sample(self.chance(s, a), u))

    def first(self, s: Array) -> Array:
        """What each agent observes of a hidden start `[B, n, ...]`: nothing unless overridden."""
        return np.stack([known.unseen(len(s)) for known in self.observations], axis=1)

    def first_sight(self, s: Array, seat: int) -> Array:
        """What a seat sees before the first turn: the state `[B, ...]`, or what it may of it."""
        return own(self.first(s)[:, seat] if self.hidden else s)

    def percept(
        self,
        seat: int,
        actions: Array,
        outcome: Outcome,
        parts: Collection[str] = Percept._fields,
    ) -> Percept:
        """What a turn by the joint actions `[B, n]` teaches a seat, in arrays of its own.

        Only the parts that are named are copied; the others are empty.
        """

        def part(name: str, array: Array) -> Array:
            return own(array) if name in parts else UNHEEDED

        seen = outcome.observations[:, seat] if self.hidden else outcome.observations
        return Percept(
            part("action", actions[:, seat]),
            part("observation", seen),
            None if self.hidden else part("actions", actions),
            part("reward", outcome.rewards[:, seat]) if self.rewards_observed else None,
        )

    @property
    def kind(self) -> str:
        """The field's name for this class of problem, derived from its facts."""
        if self.states == 1:
            return "simple game"
        if len(self.agents) == 1:
            return "POMDP" if self.hidden else "MDP"
        if not self.hidden:
            return "Markov game"
        return "Dec-POMDP" if self.shared_reward else "POMG"

    def seat(self, name: str) -> int:
        """The index of the agent of this name."""
        if name not in self.agents:
            raise UnknownName("seat", name, self.agents)
        return int(self.agents.index(name))

    def action(self, seat: int, text: str) -> float:
        """The action that a person's text names: an index, or a number of the interval."""
        return self.actions[seat].read(self.aliases.get(plain(text), text))

    def action_name(self, seat: int, action: float) -> str:
        """The label of an action, or its number."""
        return self.actions[seat].name(action)


def _settled(kind: type[Problem]) -> type[Problem]:
    """A subclass, made the frozen dataclass that it stands for where no decorator did."""
    return kind if "__dataclass_fields__" in vars(kind) else dataclass(frozen=True)(kind)


class Exact(NamedTuple):
    """Every outcome of a turn with its probability, for B rows and K joint events."""

    probabilities: Reals  # [B, K]
    outcome: Outcome  # arrays [B, K, ...]


def exact(problem: Problem, s: Array, a: Array) -> Exact:
    """Every outcome of the joint actions `a` `[B, n]` in the states `s` `[B, ...]`, as indices.

    The probabilities are `[B, K]`, the arrays of the outcome `[B, K, ...]`. Raises IllegalAction
    for the index of no action, BadParameter where chance draws real numbers, TooMuch where there
    are too many to list. States are not looked at, nor whether actions are legal there.
    """
    for agent, known, chosen in zip(problem.agents, problem.actions, a.T, strict=True):
        for one in (chosen.min(), chosen.max()) if known.labels and len(a) else ():
            known.check(one.item(), agent)
    chances = _finite(problem, problem.chance(s, a))
    rows = len(s)
    probabilities, events = _joint(chances, rows)
    many = probabilities.shape[1]
    outcome = problem.move(np.repeat(s, many, axis=0), np.repeat(a, many, axis=0), events)
    shaped = [part.reshape(rows, many, *part.shape[1:]) for part in outcome]
    return Exact(probabilities, Outcome(*shaped))


def possible(problem: Problem, s: Array, a: Array) -> tuple[Ints, Reals, Outcome]:
    """The outcomes `[N]` of `exact` that can happen: of which row each is, and how likely."""
    probabilities, events = _joint(_finite(problem, problem.chance(s, a)), len(s))
    row, _ = likely = np.nonzero(probabilities)
    drawn = tuple(event.reshape(probabilities.shape)[likely] for event in events)
    return row, probabilities[likely], problem.move(s[row], a[row], drawn)


def listing(problem: Problem, numbers: float) -> None:
    """Refuses a list of so many numbers of a problem's states, before it is made."""
    what = f"{type(problem).__name__}: a list of its states"
    Budget(what, "try a smaller problem", memory=LISTED).hold(24.0 * numbers)


def reached(problem: Problem, outcome: Outcome) -> Ints:
    """The indices `[B, K]` of the next states that `exact` lists."""
    rows, many, *state = outcome.state.shape
    return placed(problem, outcome.state.reshape(rows * many, *state)).reshape(rows, many)


def placed(problem: Problem, s: Array) -> Ints:
    """The place `[B]` of each state in `enumerated`; refuses what is no state of the problem."""
    places, count = problem.index(s), problem.states
    if isinstance(count, int) and len(s) and not 0 <= places.min() <= places.max() < count:
        got = f"{places.min()} to {places.max()}"
        raise BadParameter(f"got states {got}, expected 0 to {count - 1}, as many as there are")
    return places


def exact_start(problem: Problem) -> tuple[Reals, Array]:
    """Every start state `[K, ...]` with its probability `[K]`; a state may come up twice."""
    probabilities, events = _joint(_finite(problem, problem.opening(1)), 1)
    return probabilities[0], problem.place(probabilities.shape[1], events)


def _finite(problem: Problem, chances: tuple[Chance, ...]) -> tuple[Finite, ...]:
    finite = tuple(chance for chance in chances if isinstance(chance, Finite))
    if len(finite) < len(chances):
        name = type(problem).__name__
        raise BadParameter(f"{name} draws real numbers: its outcomes cannot be listed")
    return finite


def _joint(chances: tuple[Finite, ...], rows: int) -> tuple[Reals, tuple[Array, ...]]:
    """Probabilities `[B, K]` of all joint events, and these events, each `[B * K]`."""
    each = [np.broadcast_to(p, (rows, p.shape[1])) for p in (c.probabilities() for c in chances)]
    many = math.prod(p.shape[1] for p in each)
    what = f"listing {rows * many} outcomes one by one"
    budget = Budget(what, "try a smaller problem", memory=LISTED)
    budget.hold(8.0 * rows * many * (4 + 3 * len(each)))
    combined = np.indices([p.shape[1] for p in each]).reshape(len(each), many)
    probabilities = np.ones((rows, many))
    events = []
    for chosen, p in zip(combined, each, strict=True):
        probabilities = probabilities * p[:, chosen]
        # An event that cannot happen here is replaced by the first: its weight is 0 anyhow.
        events.append(np.where(p[:, chosen] > 0, chosen, 0).reshape(-1))
    return probabilities, tuple(events)
