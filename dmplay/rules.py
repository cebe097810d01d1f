"""The rules of a problem as one game asks them, a row at a time."""

import math
from typing import NamedTuple, TypeVar

import numpy as np

from dmplay.chance import COUNTED, Array, Bools, Reals, batched, drawn
from dmplay.core import Outcome, Percept, Problem, lasting, locked, own, raw

MOST = 4096  # answers that are remembered; and pairs of a state and a joint action where any are

T = TypeVar("T")


class Place(NamedTuple):
    """What holds in a state, however a game came to it."""

    legal: Bools | None  # [n, A]; None for all
    waiting: Bools  # [n], who only waits
    terminal: bool


class Came(NamedTuple):
    """What came of a turn, without the batch axis."""

    actions: Array  # [n]
    state: Array  # [...]
    observations: Array  # [n], or the state
    rewards: Reals  # [n]


class Rules:
    """A problem that is asked each time."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self._nobody = locked(np.zeros(len(problem.agents), bool))

    def place(self, state: Array) -> Place:
        """What holds in a state."""
        problem, s = self.problem, state[None]
        legal, terminal = problem.legal(s), bool(problem.terminal(s)[0])
        if legal is None:
            return Place(None, self._nobody, terminal)
        return Place(legal[0], problem.waiting(s)[0], terminal)

    def turn(self, state: Array, joint: Array, draws: Reals) -> Came:
        """What comes of a joint action under these draws."""
        return self._came(joint, self.problem.step(state[None], joint[None], draws[None]))

    def _came(self, joint: Array, outcome: Outcome) -> Came:
        state = own(outcome.state[0])
        seen = own(outcome.observations[0]) if self.problem.hidden else state
        return Came(locked(joint), state, seen, locked(outcome.rewards[0] + 0.0))

    def percept(self, seat: int, actions: Array, outcome: Outcome) -> Percept:
        """What a turn taught a seat, as a batch of one row."""
        return self.problem.percept(seat, actions, outcome)


class Remembered(Rules):
    """A problem in which little can happen: what it was asked before is not asked again."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        self._places: dict[bytes, Place] = {}
        self._turns: dict[tuple[object, ...], Came] = {}
        self._percepts: dict[tuple[object, ...], Percept] = {}

    def place(self, state: Array) -> Place:
        """What holds in a state."""
        known, key = self._places, raw(state)
        if key not in known:
            known[key] = super().place(state)
        return known[key]

    def turn(self, state: Array, joint: Array, draws: Reals) -> Came:
        """What comes of a joint action under these draws."""
        s, a, u = state[None], joint[None], draws[None]
        chances = self.problem.chance(s, a)
        if not all([isinstance(chance, COUNTED) for chance in chances]):
            return super().turn(state, joint, draws)
        events = drawn(chances, u)
        known, key = self._turns, (raw(state), raw(joint), *events)
        if key not in known:
            _make_room(known)
            known[key] = self._came(joint, self.problem.move(s, a, batched(events)))
        return known[key]

    def percept(self, seat: int, actions: Array, outcome: Outcome) -> Percept:
        """What a turn taught a seat, in arrays into which nobody ever can write."""
        _, rewards, seen = outcome
        known, key = self._percepts, (seat, raw(actions), raw(seen), raw(rewards))
        if key not in known:
            _make_room(known)
            taught = super().percept(seat, actions, outcome)
            parts = {k: lasting(part) for k, part in taught._asdict().items() if part is not None}
            known[key] = taught._replace(**parts)
        return known[key]


def _make_room(known: dict[tuple[object, ...], T]) -> None:
    """Forgets everything where there is no more room."""
    if len(known) >= MOST:
        known.clear()


def rules(problem: Problem, first: Array) -> Rules:
    """The rules for a game that begins in this state."""
    many, exact = problem.states, first.dtype.kind in "iub"
    little = isinstance(many, int) and 0 < many * math.prod(problem.action_counts) <= MOST
    return Remembered(problem) if little and exact else Rules(problem)
