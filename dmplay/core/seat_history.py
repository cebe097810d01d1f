"""The history of what one seat has observed, and the beliefs computed from it."""

from collections.abc import Iterator, Sequence
from threading import Lock
from typing import NamedTuple, TypeVar, overload

from dmplay.core import belief as beliefs
from dmplay.core.arrays import Array, Reals, readonly_copy
from dmplay.core.problem import Problem

# Held while beliefs are computed, because a view may be drawn during a background task.
BELIEF_LOCK = Lock()

T = TypeVar("T")


class HistorySnapshot(Sequence[T]):
    """The items of a list at one moment; items that are appended later are not included.

    There are `length` of them, by default all.
    """

    def __init__(self, items: list[T], length: int | None = None) -> None:
        self._items, self._length = items, len(items) if length is None else length

    def __len__(self) -> int:
        return self._length

    @overload
    def __getitem__(self, index: int) -> T: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[T, ...]: ...
    def __getitem__(self, index: int | slice) -> T | tuple[T, ...]:
        if isinstance(index, slice):
            return tuple(self._items[: self._length][index])
        position = index + self._length if index < 0 else index
        if not 0 <= position < self._length:
            raise IndexError(f"got index {index}, expected one of {self._length} items")
        return self._items[position]

    def __iter__(self) -> Iterator[T]:
        return iter(self[:])  # checks the length, and computes what is missing, once


class SeatHistory(NamedTuple):
    """The full history of one seat, in lists of its own that give no access to the game."""

    observations: list[Array]  # one more than turns
    actions: list[float]
    joint_actions: list[Array]
    rewards: list[float]
    beliefs: list[Reals]  # those computed so far, at most one more than turns
    action_labels: list[str]  # labels of the seat's actions, if labels depend on the state

    def copy_until_turn(self, turns: int) -> "SeatHistory":
        """Return the history up to a turn."""
        observations, actions, joint_actions, rewards, beliefs, labels = self
        return SeatHistory(
            observations[: turns + 1], actions[:turns], joint_actions[:turns], rewards[:turns],
            beliefs[: turns + 1], labels[:turns],
        )  # fmt: skip


class BeliefHistory(HistorySnapshot[Reals]):
    """The beliefs of a seat before the first turn and after each, computed when they are read.

    They are computed from the seat's history alone.
    """

    def __init__(
        self, problem: Problem, seat: int, history: SeatHistory, length: int | None = None
    ) -> None:
        super().__init__(history.beliefs, len(history.observations) if length is None else length)
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
            for turn in range(len(cached), last + 1):
                cached.append(readonly_copy(self._belief_after(turn)))
        return super().__getitem__(index)

    def _belief_after(self, turn: int) -> Reals:
        """Return the belief `[S]` after a turn, computed from the belief before it."""
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
