"""Agents that see the state and plan the turns of a game, and who fits a game that is seen."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import prod
from typing import Self

import numpy as np

from dmplay.budget import within
from dmplay.chance import Array, Bools, Categorical, Ints, Reals
from dmplay.core import Memory, Percept, Problem, exact_start, heeds, parameter
from dmplay.errors import BadParameter, BadPolicy, TooMuch
from dmplay.laws import samples
from dmplay.policies._kept import kept
from dmplay.policies._solved import Seeing
from dmplay.policies.kinds import Reactive, Seated
from dmplay.policies.valued import LONGEST
from dmplay.solvers import backward_induction, best_replies, graph, shapley
from dmplay.solvers.backward_induction import Induced
from dmplay.solvers.best_replies import Replied
from dmplay.solvers.shapley import Shapley
from dmplay.solvers.value_iteration import greedy
from dmplay.solvers.zero_sum import Every

SHORT, WIDE = 5e6, 4096  # work, for some thousand histories, and joint actions in each
TRIED = 120  # turns of random play that tell whether two are opposed


@dataclass(frozen=True)
class _Counting(Seated):
    """One who counts the turns; the memory is the state and the number of turns done."""

    horizon: int = parameter(0, "turns of a game; 0: those of the problem, if any", 0, LONGEST)

    whole_game = True

    @property
    def _turns(self) -> int | None:
        """How many turns a game has; None for no end."""
        return self.horizon or self.problem.horizon

    def begin(self, observation: Array) -> Memory:
        """The first state, and no turn done."""
        return (observation, np.zeros(len(observation), np.int64))

    @heeds("observation")
    def update(self, memory: Memory, percept: Percept) -> Memory:
        """The new state, one more turn done."""
        return (percept.observation, memory[1] + 1)

    def in_game(self, turns: int | None, rivals: Sequence[str]) -> Self:
        """One that plans the whole game."""
        if turns is None or turns == self.problem.horizon or turns > LONGEST:
            return self
        return replace(self, horizon=turns)

    def _rows(self, memory: Memory) -> Iterator[tuple[Ints, Array, int | None]]:
        """Rows in which as many turns follow this one, None for no end, and their states."""
        s, done = memory
        if self._turns is None:
            yield np.arange(len(s)), s, None
            return
        left = self._turns - 1 - done % self._turns
        for turns in np.unique(left).tolist():
            rows = np.flatnonzero(left == turns)
            yield rows, s[rows], turns

    def _unknown(self, rows: int) -> Reals:
        """Q `[B, A]` of which nothing is known."""
        return np.full((rows, self.problem.action_counts[self.seat]), -np.inf)


@dataclass(frozen=True)
class Foreseeing(_Counting):
    """The best action with the turns that are left, by backward induction.

    Others who decide in turn are taken to do what is best for them.
    """

    @cached_property
    def _found(self) -> Induced:
        return solved(self.problem, self._turns)

    @cached_property
    def _soonest(self) -> Ints:
        return backward_induction.soonest(self._found, self.problem.discount)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The first of the best actions; in a game without end one that ends it soonest."""
        if self._turns is not None:
            return greedy(self.values(memory))
        found = self._found.graph
        row = self._soonest[found.at(self.problem, memory[0])]
        return np.asarray(found.actions[row, self.seat], np.int64)

    def values(self, memory: Memory) -> Reals:
        """Q of each action with the turns that are left; -inf of what is not legal."""
        found, seat = self._found.graph, self.seat
        q = self._unknown(len(memory[0]))
        for here, s, left in self._rows(memory):
            rows, which = found.able(found.at(self.problem, s))
            worth = found.worth(rows, self.problem.discount, self._found.values_of(left))[:, seat]
            np.maximum.at(q, (here[which], found.actions[rows, seat]), worth)
        return q


@dataclass(frozen=True)
class Secure(_Counting):
    """Mixes its actions so that they earn the most against the worst the other can do.

    By Shapley's iteration; the values are against the other's part.
    """

    draws = 1  # for the action

    @cached_property
    def _found(self) -> Shapley:
        return opposed(self.problem, self._turns)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """An action drawn from the mix."""
        mix = np.zeros((len(u), self.problem.action_counts[self.seat]))
        for rows, _, both in self._played(memory):
            mix[rows] = both[1 + self.seat]
        return Categorical.of(mix).sample(u)

    def values(self, memory: Memory) -> Reals:
        """Q of each action against the other's mix."""
        q = self._unknown(len(memory[0]))
        for rows, games, both in self._played(memory):
            if self.seat == 0:
                q[rows] = (games * both.columns[:, None]).sum(axis=2)
            else:
                q[rows] = -self._found.share * (games * both.rows[:, :, None]).sum(axis=1)
        return q

    def _played(self, memory: Memory) -> Iterator[tuple[Ints, Reals, Every]]:
        """Rows with as many turns left, what the game is in each, and what both play."""
        for rows, s, left in self._rows(memory):
            places, which = np.unique(self._found.graph.at(self.problem, s), return_inverse=True)
            games, both = self._found.played(places, self.problem.discount, left)
            yield rows, games[which], Every(*(part[which] for part in both))


@dataclass(frozen=True)
class Settled(Reactive):
    """Its part of what all come to who reply to one another; dmplay solve tells how good that is.

    The values are against the others' part.
    """

    draws = 1  # for the action

    @cached_property
    def _found(self) -> Replied:
        return best_replies.equilibrium(self.problem, graph.explored(self.problem))

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """An action drawn from the mix of this state."""
        place = self._found.graph.at(self.problem, memory[0])
        return Categorical.of(self._found.play[self.seat][place]).sample(u)

    def values(self, memory: Memory) -> Reals:
        """Q of each action; -inf of what is not legal."""
        return self._found.q[self.seat][self._found.graph.at(self.problem, memory[0])]


@kept
def solved(problem: Problem, turns: int | None) -> Induced:
    """What games of so many turns are worth, over all states of one agent's or those come to."""
    alone = len(problem.agents) == 1 and isinstance(problem.states, int)
    found = graph.whole(problem) if alone else graph.explored(problem)
    return backward_induction.solved(problem, found, turns)


def opposed(problem: Problem, turns: int | None) -> Shapley:
    """What a game of two who oppose each other is worth, over the states that are come to."""
    return shapley.solved(problem, graph.explored(problem), turns)


def visible(problem: Problem) -> dict[str, type[Seated]]:
    """The agents that fit a problem in which everybody sees the state."""
    if not all(problem.action_counts):
        return {}
    if len(problem.agents) == 1:
        return _alone(problem)
    if in_turn(problem):
        return {"optimal": Foreseeing}
    able = {"optimal": at_odds(problem), "equilibrium": at_once(problem)}
    kinds: dict[str, type[Seated]] = {"optimal": Secure, "equilibrium": Settled}
    return {name: kinds[name] for name, fits in able.items() if fits}


def _alone(problem: Problem) -> dict[str, type[Seated]]:
    """Those of one who sees: endless where that has a value, and for the turns there are."""
    if not isinstance(problem.states, int):
        return {}
    if problem.discount < 1.0:
        return {"optimal": Seeing} | ({} if problem.horizon is None else {"plan": Foreseeing})
    if problem.horizon is not None:
        return {"optimal": Foreseeing}
    try:
        ends = problem.terminal(problem.enumerated()).any()
    except TooMuch:
        return {}
    return ({"optimal": Seeing} if ends else {}) | {"plan": Foreseeing}


def in_turn(problem: Problem) -> bool:
    """Whether several see the state and all but one wait in the first turn.

    Where a state is all that happened, also whether that is little enough.
    """
    start = _start(problem)
    if start is None or (problem.waiting(start).sum(axis=1) < len(problem.agents) - 1).any():
        return False
    return start.dtype.kind != "O" or (prod(problem.action_counts) <= WIDE and _short(problem))


@kept
def _short(problem: Problem) -> bool:
    """Whether all that may happen in a game is soon listed, and always one agent decides."""
    try:
        with within(SHORT):
            solved(problem, problem.horizon)
    except (BadParameter, BadPolicy, TooMuch):
        return False
    return True


def at_once(problem: Problem) -> bool:
    """Whether several see the state, act at once and discount what comes."""
    return problem.discount < 1.0 and _tabled(problem) and not in_turn(problem)


def at_odds(problem: Problem) -> bool:
    """Whether two see the state, act at once and are opposed, as far as random play tells."""
    two = len(problem.agents) == 2 and (problem.discount < 1.0 or problem.horizon is not None)
    if not two or not _tabled(problem) or in_turn(problem):
        return False
    found = samples.turns(problem, TRIED)
    return shapley.share(problem.step(found.s, found.a, found.u).rewards) is not None


def _start(problem: Problem) -> Array | None:
    """The states in which a game of several who see them may begin, if they can be listed."""
    if len(problem.agents) == 1 or problem.hidden or not all(problem.action_counts):
        return None
    try:
        return exact_start(problem)[1]
    except (BadParameter, TooMuch):
        return None


def _tabled(problem: Problem) -> bool:
    """Whether the states in which it may begin can be listed, and are numbers."""
    start = _start(problem)
    return start is not None and start.dtype.kind != "O"
