"""The history of what one seat has observed, and the beliefs computed from it."""

from collections.abc import Sequence
from threading import Lock
from typing import Generic, NamedTuple, TypeVar, overload

from dmplay import belief as beliefs
from dmplay.chance import Array, Reals
from dmplay.core import Problem, readonly_copy

CHUNK_TURNS = 256  # turns in one chunk of a history
# Held while beliefs are computed, because a view may be drawn during a background task.
BELIEF_LOCK = Lock()

T = TypeVar("T")


class ChunkedList(Generic[T]):
    """A list in chunks, so that a copied prefix shares its full chunks with the original."""

    def __init__(self, chunks: Sequence[list[T]] = ()) -> None:
        self.chunks = [*chunks]
        self.length = sum(map(len, self.chunks))

    def __getitem__(self, index: int) -> T:
        return self.chunks[index // CHUNK_TURNS][index % CHUNK_TURNS]

    def append(self, item: T) -> None:
        """Append one item."""
        self.extend([item])

    def extend(self, items: Sequence[T]) -> None:
        """Append several items, in order."""
        free_slots = -self.length % CHUNK_TURNS  # free slots in the last chunk
        if free_slots:
            self.chunks[-1].extend(items[:free_slots])
        self.chunks += [
            [*items[start : start + CHUNK_TURNS]]
            for start in range(free_slots, len(items), CHUNK_TURNS)
        ]
        self.length += len(items)

    def copy_prefix(self, end: int) -> "ChunkedList[T]":
        """Return a copy of the first `end` items, or of all, that can grow separately."""
        end = min(end, self.length)
        full_chunks = self.chunks[: end // CHUNK_TURNS]
        return ChunkedList(
            [*full_chunks, self.chunks[end // CHUNK_TURNS][: end % CHUNK_TURNS]]
            if end % CHUNK_TURNS
            else full_chunks
        )


class HistorySnapshot(Sequence[T]):
    """A snapshot of a chunked list that may grow later; its length stays."""

    def __init__(self, items: ChunkedList[T]) -> None:
        self._chunks, self._length = items.chunks, items.length

    def __len__(self) -> int:
        return self._length

    @overload
    def __getitem__(self, index: int) -> T: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[T, ...]: ...
    def __getitem__(self, index: int | slice) -> T | tuple[T, ...]:
        if isinstance(index, slice):
            return tuple(self[position] for position in range(self._length)[index])
        position = index + self._length if index < 0 else index
        if not 0 <= position < self._length:
            raise IndexError(f"got {index}, expected one of {self._length}")
        return self._chunks[position // CHUNK_TURNS][position % CHUNK_TURNS]


class SeatHistory(NamedTuple):
    """The full history of one seat, in lists of its own that give no access to the game."""

    observations: ChunkedList[Array]  # one more than turns
    actions: ChunkedList[float]
    joint_actions: ChunkedList[Array]
    rewards: ChunkedList[float]
    beliefs: ChunkedList[Reals]  # those computed so far, at most one more than turns
    action_labels: ChunkedList[str]  # labels of the seat's actions, if labels depend on the state

    def copy_until_turn(self, turns: int) -> "SeatHistory":
        """Return the history up to a turn."""
        return SeatHistory(
            self.observations.copy_prefix(turns + 1),
            self.actions.copy_prefix(turns),
            self.joint_actions.copy_prefix(turns),
            self.rewards.copy_prefix(turns),
            self.beliefs.copy_prefix(turns + 1),
            self.action_labels.copy_prefix(turns),
        )


class BeliefHistory(HistorySnapshot[Reals]):
    """The beliefs of a seat before the first turn and after each, computed when they are read.

    They are computed from the seat's history alone.
    """

    def __init__(self, problem: Problem, seat: int, history: SeatHistory) -> None:
        super().__init__(history.beliefs)
        self._length = history.observations.length
        self._problem, self._seat, self._history = problem, seat, history

    @overload
    def __getitem__(self, index: int) -> Reals: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Reals, ...]: ...
    def __getitem__(self, index: int | slice) -> Reals | tuple[Reals, ...]:
        indices = range(self._length)[index]
        last = max(indices, default=-1) if isinstance(indices, range) else indices
        cached = self._history.beliefs
        with BELIEF_LOCK:
            for turn in range(cached.length, last + 1):
                cached.append(readonly_copy(self._belief_after(turn)))
        return super().__getitem__(index)

    def _belief_after(self, turn: int) -> Reals:
        """Return the belief after a turn, computed from the belief before it."""
        if not turn:
            return beliefs.initial_seat_belief(
                self._problem, self._seat, self._history.observations[0]
            )
        joint_action: list[int | None] = [None] * len(self._problem.agents)
        joint_observation = list(joint_action)
        joint_action[self._seat] = int(self._history.actions[turn - 1])
        joint_observation[self._seat] = int(self._history.observations[turn])
        return beliefs.update_belief(
            self._problem, self._history.beliefs[turn - 1], joint_action, joint_observation
        ).belief
