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

from dmplay.chance import Array, Bools, Chance, Span
from dmplay.core import Labels, Numbers, Outcome, Problem, Texts
from dmplay.errors import BadParameter, IllegalAction

LARGEST_SEED = 10**9  # of the generators that a draw of nine decimals can tell apart
TURN, PART = "|", " "  # what stands between turns, and between the parts of one


Actions = tuple[float, ...]
_ALONE = RLock()  # an agent may think while the screen is drawn


class History:
    """A start of a game, then the joint action and the draw of each turn: never changed.

    Each holds the one before it, so that a turn costs the same in a game of any length; and there
    is one for all that happened alike, so that two are equal where they are the same.
    """

    __slots__ = ("__weakref__", "actions", "before", "draw", "game")
    _every: ClassVar["WeakValueDictionary[tuple[object, ...], History]"] = WeakValueDictionary()

    game: str
    draw: float
    actions: Actions
    before: "History | None"

    def __new__(
        cls, game: str, draw: float, actions: Actions = (), before: "History | None" = None
    ) -> "History":
        """The one of which this is told."""
        with _ALONE:
            one = cls._every.get((game, draw, actions, id(before)))
            if one is None:
                one = super().__new__(cls)
                one.game, one.draw, one.actions, one.before = game, draw, actions, before
                cls._every[game, draw, actions, id(before)] = one
            return one

    def __reduce__(self) -> tuple[object, ...]:
        return read, (self.game, str(self))

    def __str__(self) -> str:
        return TURN.join(PART.join(map(repr, (one.draw, *one.actions))) for one in self.path())

    def path(self) -> "list[History]":
        """The histories that led here, the start first and this last."""
        led, one = [self], self.before
        while one:
            led.append(one)
            one = one.before
        return led[::-1]


def read(game: str, text: str) -> History:
    """The history that a text tells of."""
    found: History | None = None
    for turn in text.split(TURN):
        draw, *actions = turn.split(PART)
        done = tuple(float(word) if "." in word or "e" in word else int(word) for word in actions)
        found = History(game, float(draw), done, found)
    assert found
    return found


class Known(NamedTuple):
    """What a world says where it stands."""

    rewards: tuple[float, ...]  # of the turn that led there
    over: bool
    legal: tuple[Sequence[int], ...] | None  # for each agent; None for all
    seen: tuple[object, ...]  # what each agent observes
    told: str = ""  # the state in its own words
    called: tuple[Mapping[int, str], ...] = ()  # actions of each agent by their names here alone


class World(Protocol):
    """A game of another library as it stands; it changes as it is played."""

    def begin(self, draw: float) -> Known:
        """Begins it anew, with what this number draws."""

    def act(self, actions: tuple[float, ...], draw: float) -> Known:
        """Plays a turn, with what this number draws."""

    def copy(self) -> "World | None":
        """Another that stands where this one does; None where there cannot be one."""


class _Stage:
    """What is known at the end of a history; and the world that stands there, if one does."""

    def __init__(self, known: Known, world: World | None) -> None:
        self.known, self.world = known, world


# Nothing leads from a problem, which agents hold, to these; each goes with its history.
_STAGES: "WeakKeyDictionary[History, _Stage]" = WeakKeyDictionary()


@dataclass(frozen=True)
class Guest(Problem, ABC):
    """A problem of another library."""

    name: str = field(default="", repr=False)  # it is this problem's, not a parameter

    states = math.inf

    @abstractmethod
    def world(self) -> World:
        """A world of this problem that was not begun."""

    @property
    @abstractmethod
    def drawn(self) -> bool:
        """Whether nature draws anything."""

    def known(self, history: History) -> Known:
        """What its world says after this happened."""
        with _ALONE:
            stage = _STAGES.get(history)
            return (stage or self._led(history)).known

    def _led(self, history: History) -> _Stage:
        """Leads a world to the end of a history, from the last place where one stands."""
        path = history.path()
        at, world = self._nearest(path)
        for one in path[at:]:
            known = world.act(one.actions, one.draw) if one.before else world.begin(one.draw)
        stage = _STAGES[history] = _Stage(known, world)
        return stage

    def _nearest(self, path: list[History]) -> tuple[int, World]:
        """A world, and how much of a path lies behind it."""
        for behind in range(len(path) - 1, 0, -1):
            stage = _STAGES.get(path[behind - 1])
            if stage and stage.world:
                copy = stage.world.copy()
                world = copy or stage.world
                stage.world = stage.world if copy else None
                return behind, world
        return 0, self.world()

    def _every(self, s: Array) -> list[Known]:
        return [self.known(history) for history in s[:, 0]]

    def _chance(self, rows: int) -> tuple[Chance, ...]:
        return (Span(np.zeros(rows), np.ones(rows)),) if self.drawn else ()

    def opening(self, rows: int) -> tuple[Chance, ...]:
        """A number from which all that the world draws first follows."""
        return self._chance(rows)

    def place(self, rows: int, events: tuple[Array, ...]) -> Array:
        """A history of nothing yet."""
        draws = events[0].tolist() if events else [0.0] * rows
        return _column([History(self.name, draw) for draw in draws])

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """A number from which all that the world draws in this turn follows."""
        return self._chance(len(s))

    def move(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """A world is led on, for each row."""
        draws = events[0].tolist() if events else [0.0] * len(s)
        moved = _column(list(map(self._moved, s[:, 0], a.tolist(), draws)))
        paid = np.zeros((len(s), len(self.agents)))
        for row, (before, after) in enumerate(zip(s[:, 0], moved[:, 0], strict=True)):
            paid[row] = 0.0 if after is before else self.known(after).rewards
        return Outcome(moved, paid, self.first(moved) if self.hidden else moved)

    def _moved(self, before: History, actions: list[float], draw: float) -> History:
        known = self.known(before)
        for able, action in zip(known.legal or (), actions, strict=bool(known.legal)):
            if action not in able and not known.over:
                raise IllegalAction(f"{self.name}: got action {action:g}, which is not legal here")
        return before if known.over else History(self.name, draw, tuple(actions), before)

    def called(self, s: Array) -> tuple[Labels, ...] | None:
        """The names that the world gives to what can be done here; the rest keeps its own."""
        every = self.known(s[0]).called
        pairs = zip(self.actions, every, strict=bool(every))
        return tuple(_renamed(one.labels, called) for one, called in pairs) if every else None

    def terminal(self, s: Array) -> Bools:
        """Where the world says so."""
        return np.array([known.over for known in self._every(s)], bool)

    def legal(self, s: Array) -> Bools | None:
        """What the world says, where it says anything."""
        every = self._every(s)
        if all(known.legal is None for known in every):
            return None
        able = np.zeros((len(s), len(self.agents), max(self.action_counts)), bool)
        for row, known in enumerate(every):
            for seat, many in enumerate(self.action_counts):
                able[row, seat, list(known.legal[seat] if known.legal else range(many))] = True
        return able

    def first(self, s: Array) -> Array:
        """What each agent observes where the world stands."""
        return np.array([known.seen for known in self._every(s)])

    def line(self, s: Array) -> str:
        """The state in the world's own words; how it came about stands in the turns."""
        return one_line(self.known(s[0]).told)

    def picture(self, s: Array) -> str:
        """The state in the world's own words, where these are several lines."""
        return _drawn(self.known(s[0]).told)

    def glimpse(self, seen: Array) -> str:
        """What is observed, where it is several lines of text."""
        return _drawn(str(seen)) if isinstance(self.observations[0], Texts) else ""

    def notation(self, s: Array) -> str:
        """All that happened."""
        return str(s[0])

    def parse(self, text: str) -> Array:
        """The history that the text tells of."""
        state: Array = _column([read(self.name, text)])[0]
        return state


@dataclass(frozen=True)
class Environment(Guest):
    """A world that draws, and tells agents what they observe and are paid in every turn."""

    drawn = True

    @property
    def rewards_observed(self) -> bool:
        """They are told."""
        return True


def _renamed(labels: Labels, called: Mapping[int, str]) -> Labels:
    """The labels, some under other names; a name that is another's has its number added."""
    names = [called.get(n, label) for n, label in enumerate(labels)]
    count = Counter(map(str.lower, names))
    for n, name in called.items():
        names[n] = f"{name}-{n}" if count[name.lower()] > 1 else name
    return Labels(names)


def _column(histories: list[History]) -> Array:
    column = np.empty((len(histories), 1), object)
    column[:, 0] = histories
    return column


def _drawn(text: str) -> str:
    return text if "\n" in text else ""


def one_line(text: str) -> str:
    """Several lines as one."""
    return " / ".join(filter(None, (row.strip() for row in text.split("\n"))))


def seed(draw: float) -> int:
    """The seed that a draw of nine decimals is."""
    return round(draw * LARGEST_SEED)


def digits(first: int, many: int) -> Labels:
    """Actions that have no names but numbers."""
    return Labels(map(str, range(first, first + many)))


def sight(many: int, name: str) -> Numbers:
    """An observation of so many numbers; raises BadParameter where nobody would read them."""
    if not 0 < many <= LARGEST_SIGHT:
        what = f"what is observed are {many} numbers, perhaps a picture"
        raise BadParameter(f"{name}: {what}; dmplay plays what has 1 to {LARGEST_SIGHT}")
    return Numbers(many)


LARGEST_SIGHT = 1000
