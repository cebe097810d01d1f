"""What a seat knows of a game: what it was told turn by turn, and what it believes by that."""

from collections.abc import Sequence
from threading import Lock
from typing import Generic, NamedTuple, TypeVar, overload

from dmplay import belief as beliefs
from dmplay.chance import Array, Reals
from dmplay.core import Problem, readonly_copy

CHUNK_TURNS = 256  # turns of a part of what a seat was told
BELIEF_LOCK = Lock()  # had by who works out beliefs: a view may be drawn beside a thought

T = TypeVar("T")


class ChunkedList(Generic[T]):
    """What a seat was told, in parts: what is taken back leaves the parts before it as they are."""

    def __init__(self, chunks: Sequence[list[T]] = ()) -> None:
        self.chunks = [*chunks]
        self.length = sum(map(len, self.chunks))

    def __getitem__(self, index: int) -> T:
        return self.chunks[index // CHUNK_TURNS][index % CHUNK_TURNS]

    def append(self, item: T) -> None:
        """Adds what came last."""
        self.extend([item])

    def extend(self, items: Sequence[T]) -> None:
        """Adds all that came last, in order."""
        room = -self.length % CHUNK_TURNS  # of the last part
        if room:
            self.chunks[-1].extend(items[:room])
        self.chunks += [
            [*items[at : at + CHUNK_TURNS]] for at in range(room, len(items), CHUNK_TURNS)
        ]
        self.length += len(items)

    def copy_prefix(self, end: int) -> "ChunkedList[T]":
        """The first so many, or all: other lists where more is to come."""
        end = min(end, self.length)
        whole = self.chunks[: end // CHUNK_TURNS]
        return ChunkedList(
            [*whole, self.chunks[end // CHUNK_TURNS][: end % CHUNK_TURNS]]
            if end % CHUNK_TURNS
            else whole
        )


class HistorySnapshot(Sequence[T]):
    """What a seat was told so far, of what may grow: as long as it is now."""

    def __init__(self, items: ChunkedList[T]) -> None:
        self._chunks, self._length = items.chunks, items.length

    def __len__(self) -> int:
        return self._length

    @overload
    def __getitem__(self, index: int) -> T: ...
    @overload
    def __getitem__(self, place: slice) -> tuple[T, ...]: ...
    def __getitem__(self, place: int | slice) -> T | tuple[T, ...]:
        if isinstance(place, slice):
            return tuple(self[at] for at in range(self._length)[place])
        at = place + self._length if place < 0 else place
        if not 0 <= at < self._length:
            raise IndexError(f"got {place}, expected one of {self._length}")
        return self._chunks[at // CHUNK_TURNS][at % CHUNK_TURNS]


class SeatHistory(NamedTuple):
    """All that one seat was told, in lists of its own: nothing leads from them to the game."""

    observations: ChunkedList[Array]  # one more than turns
    actions: ChunkedList[float]
    joint_actions: ChunkedList[Array]
    rewards: ChunkedList[float]
    beliefs: ChunkedList[Reals]  # as many as were looked at so far, one more than turns at most
    action_labels: ChunkedList[str]  # what its actions were called, where that depends on the state

    def copy_until_turn(self, turns: int) -> "SeatHistory":
        """What it was told up to a turn."""
        return SeatHistory(
            self.observations.copy_prefix(turns + 1),
            self.actions.copy_prefix(turns),
            self.joint_actions.copy_prefix(turns),
            self.rewards.copy_prefix(turns),
            self.beliefs.copy_prefix(turns + 1),
            self.action_labels.copy_prefix(turns),
        )


class BeliefHistory(HistorySnapshot[Reals]):
    """What a seat believed before the first turn and after each: worked out when it is looked at,
    from nothing but what the seat was told.
    """

    def __init__(self, problem: Problem, seat: int, history: SeatHistory) -> None:
        super().__init__(history.beliefs)
        self._length = history.observations.length
        self._problem, self._seat, self._history = problem, seat, history

    @overload
    def __getitem__(self, index: int) -> Reals: ...
    @overload
    def __getitem__(self, place: slice) -> tuple[Reals, ...]: ...
    def __getitem__(self, place: int | slice) -> Reals | tuple[Reals, ...]:
        places = range(self._length)[place]
        last = max(places, default=-1) if isinstance(places, range) else places
        known = self._history.beliefs
        with BELIEF_LOCK:
            for turn in range(known.length, last + 1):
                known.append(readonly_copy(self._belief_after(turn)))
        return super().__getitem__(place)

    def _belief_after(self, turn: int) -> Reals:
        """What it believed after a turn, by what it believed before."""
        if not turn:
            return beliefs.initial_seat_belief(
                self._problem, self._seat, self._history.observations[0]
            )
        did: list[int | None] = [None] * len(self._problem.agents)
        saw = list(did)
        did[self._seat] = int(self._history.actions[turn - 1])
        saw[self._seat] = int(self._history.observations[turn])
        return beliefs.update_belief(
            self._problem, self._history.beliefs[turn - 1], did, saw
        ).belief
