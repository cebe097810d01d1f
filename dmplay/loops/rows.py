"""Many games at once for one learner, who has the same seat in each; agents have the others."""

from collections.abc import Sequence

import numpy as np

from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import DECIMALS, Memory, Outcome, Policy, heeded
from dmplay.dice import NATURE
from dmplay.loops.luck import Luck
from dmplay.loops.seat import Seat


class Rows:
    """The games; one that is over begins anew with the next turn."""

    def __init__(
        self,
        seat: Seat,
        policies: Sequence[Policy | None],
        luck: Luck,
        many: int,
        limit: int | None,
    ) -> None:
        self.problem, self.seat, self.luck = seat.problem, seat, luck
        self._policies = policies
        self._limit = limit
        self._every, self._never = np.arange(many), np.zeros(many, bool)
        self.begin()

    def begin(self) -> None:
        """Begins a new game in every row."""
        self._turn = np.zeros(len(self._every), np.int64)
        self.ended = self._never
        self._state, self._memories, self.seen = self._begun(self._every)
        self.legal = self.problem.legal(self._state)

    def _begun(self, rows: Ints) -> tuple[Array, list[Memory], Array]:
        """New games in these rows: states, what the others remember, what the learner sees."""
        problem = self.problem
        self.luck.anew(rows)
        self._turn[rows] = 0
        state = problem.start(self.luck.draw(NATURE, self._turn, problem.draws.start, rows))
        memories: list[Memory] = [
            () if policy is None else policy.begin(problem.first_sight(state, place))
            for place, policy in enumerate(self._policies)
        ]
        first = problem.first_sight(state, self.seat.seat)
        return state, memories, self.seat.seen(first, None)

    def play(self, own: Array) -> tuple[Reals, Bools, Bools]:
        """Plays a turn by the learner's actions; rewards, and which games are over or cut short."""
        problem, seat = self.problem, self.seat.seat
        self._turn += 1
        joint = self._joint(own)
        u = self.luck.draw(NATURE, self._turn, problem.draws.step, self._every)
        outcome = problem.step(self._state, joint, u)
        rewards = outcome.rewards[:, seat] + 0.0
        self._move(joint, outcome, rewards)
        if self.ended.any():
            self._begin_anew(np.flatnonzero(self.ended), rewards)
        terminated, truncated = problem.terminal(self._state), self._never
        if self._limit is not None:
            truncated = (self._turn >= self._limit) & ~terminated
        self.ended = terminated | truncated
        self.legal = problem.legal(self._state)
        return rewards, terminated, truncated

    def _joint(self, own: Array) -> Array:
        """The joint actions `[B, n]`: the learner's, and those of the other seats."""
        chosen = [
            own if policy is None else self._chosen(place, policy)
            for place, policy in enumerate(self._policies)
        ]
        joint = np.stack(chosen, axis=1) if len(chosen) > 1 else own[:, None]
        return np.round(joint, DECIMALS) + 0.0 if joint.dtype.kind == "f" else joint

    def _chosen(self, place: int, policy: Policy) -> Array:
        u = self.luck.draw(1 + place, self._turn, policy.draws, self._every)
        legal = None if self.legal is None else self.legal[:, place]
        return policy.choose(self._memories[place], legal, u)

    def _move(self, joint: Array, outcome: Outcome, rewards: Reals) -> None:
        """Goes on to what came of the turn; where a move was not legal there was none."""
        state, seen = outcome.state, self._sight(joint, outcome)
        each = enumerate(zip(self._policies, self._memories, strict=True))
        memories = [self._learnt(place, *who, joint, outcome) for place, who in each]
        if self.legal is not None:
            able = self.legal[self._every[:, None], np.arange(joint.shape[1]), joint.astype(int)]
            stuck = np.flatnonzero(~able.all(axis=1))
            self._turn[stuck], rewards[stuck] = self._turn[stuck] - 1, 0.0
            state, seen = (
                _put(state, stuck, self._state[stuck]),
                _put(seen, stuck, self.seen[stuck]),
            )
            memories = _memories(memories, stuck, [_rows(one, stuck) for one in self._memories])
        self._state, self.seen, self._memories = state, seen, memories

    def _learnt(
        self, place: int, policy: Policy | None, memory: Memory, joint: Array, outcome: Outcome
    ) -> Memory:
        """What somebody in another seat remembers after a turn."""
        if policy is None:
            return ()
        percept = self.problem.percept(place, joint, outcome, heeded(policy))
        return policy.update(memory, percept)

    def _sight(self, joint: Array, outcome: Outcome) -> Array:
        hidden, seen = self.problem.hidden, outcome.observations
        return self.seat.seen(seen[:, self.seat.seat] if hidden else seen, joint)

    def _begin_anew(self, rows: Ints, rewards: Reals) -> None:
        """New games where they were over, which pay nothing yet."""
        state, memories, seen = self._begun(rows)
        self._state, self.seen = _put(self._state, rows, state), _put(self.seen, rows, seen)
        self._memories = _memories(self._memories, rows, memories)
        rewards[rows] = 0.0


def _put(array: Array, rows: Ints, new: Array) -> Array:
    """The array with these rows instead."""
    array = array.copy()
    array[rows] = new
    return array


def _rows(memory: Memory, rows: Ints) -> Memory:
    return tuple(part[rows] for part in memory)


def _memories(memories: list[Memory], rows: Ints, new: list[Memory]) -> list[Memory]:
    """What the others remember, with these rows instead."""
    pairs = zip(memories, new, strict=True)
    return [tuple(_put(a, rows, b) for a, b in zip(*pair, strict=True)) for pair in pairs]
