"""What a seat knows of a game: what it was told turn by turn, and what it believes by that."""

from collections.abc import Sequence
from threading import Lock
from typing import Generic, NamedTuple, TypeVar, overload

from dmplay import belief as beliefs
from dmplay.chance import Array, Reals
from dmplay.core import Problem, own

PART = 256  # turns of a part of what a seat was told
WORKING = Lock()  # had by who works out beliefs: a view may be drawn beside a thought

T = TypeVar("T")


class Telling(Generic[T]):
    """What a seat was told, in parts: what is taken back leaves the parts before it as they are."""

    def __init__(self, parts: Sequence[list[T]] = ()) -> None:
        self.parts = [*parts]
        self.many = sum(map(len, self.parts))

    def __getitem__(self, place: int) -> T:
        return self.parts[place // PART][place % PART]

    def append(self, one: T) -> None:
        """Adds what came last."""
        self.extend([one])

    def extend(self, some: Sequence[T]) -> None:
        """Adds all that came last, in order."""
        room = -self.many % PART  # of the last part
        if room:
            self.parts[-1].extend(some[:room])
        self.parts += [[*some[at : at + PART]] for at in range(room, len(some), PART)]
        self.many += len(some)

    def until(self, end: int) -> "Telling[T]":
        """The first so many, or all: other lists where more is to come."""
        end = min(end, self.many)
        whole = self.parts[: end // PART]
        return Telling([*whole, self.parts[end // PART][: end % PART]] if end % PART else whole)


class SoFar(Sequence[T]):
    """What a seat was told so far, of what may grow: as long as it is now."""

    def __init__(self, told: Telling[T]) -> None:
        self._parts, self._many = told.parts, told.many

    def __len__(self) -> int:
        return self._many

    @overload
    def __getitem__(self, place: int) -> T: ...
    @overload
    def __getitem__(self, place: slice) -> tuple[T, ...]: ...
    def __getitem__(self, place: int | slice) -> T | tuple[T, ...]:
        if isinstance(place, slice):
            return tuple(self[at] for at in range(self._many)[place])
        at = place + self._many if place < 0 else place
        if not 0 <= at < self._many:
            raise IndexError(f"got {place}, expected one of {self._many}")
        return self._parts[at // PART][at % PART]


class Told(NamedTuple):
    """All that one seat was told, in lists of its own: nothing leads from them to the game."""

    observations: Telling[Array]  # one more than turns
    actions: Telling[float]
    joint: Telling[Array]
    rewards: Telling[float]
    beliefs: Telling[Reals]  # as many as were looked at so far, one more than turns at most
    said: Telling[str]  # what its actions were called, where that depends on the state

    def until(self, turns: int) -> "Told":
        """What it was told up to a turn."""
        return Told(
            self.observations.until(turns + 1),
            self.actions.until(turns),
            self.joint.until(turns),
            self.rewards.until(turns),
            self.beliefs.until(turns + 1),
            self.said.until(turns),
        )


class Beliefs(SoFar[Reals]):
    """What a seat believed before the first turn and after each: worked out when it is looked at,
    from nothing but what the seat was told.
    """

    def __init__(self, problem: Problem, seat: int, told: Told) -> None:
        super().__init__(told.beliefs)
        self._many = told.observations.many
        self._problem, self._seat, self._from = problem, seat, told

    @overload
    def __getitem__(self, place: int) -> Reals: ...
    @overload
    def __getitem__(self, place: slice) -> tuple[Reals, ...]: ...
    def __getitem__(self, place: int | slice) -> Reals | tuple[Reals, ...]:
        places = range(self._many)[place]
        last = max(places, default=-1) if isinstance(places, range) else places
        known = self._from.beliefs
        with WORKING:
            for turn in range(known.many, last + 1):
                known.append(own(self._after(turn)))
        return super().__getitem__(place)

    def _after(self, turn: int) -> Reals:
        """What it believed after a turn, by what it believed before."""
        if not turn:
            return beliefs.first(self._problem, self._seat, self._from.observations[0])
        did: list[int | None] = [None] * len(self._problem.agents)
        saw = list(did)
        did[self._seat] = int(self._from.actions[turn - 1])
        saw[self._seat] = int(self._from.observations[turn])
        return beliefs.update(self._problem, self._from.beliefs[turn - 1], did, saw).belief
