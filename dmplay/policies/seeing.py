"""Agents that know the best policy of a problem in which everybody sees the state."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, Percept, Problem, exact_start, parameter
from dmplay.errors import BadParameter, TooMuch
from dmplay.policies._solved import Seeing
from dmplay.policies.kinds import Seated
from dmplay.policies.valued import LONGEST
from dmplay.solvers import backward_induction, graph
from dmplay.solvers.backward_induction import Induced
from dmplay.solvers.value_iteration import greedy


@dataclass(frozen=True)
class Foreseeing(Seated):
    """The best action with the turns that are left, by backward induction.

    Others who decide in turn are taken to do what is best for them. The memory is the state and
    the number of turns done.
    """

    horizon: int = parameter(0, "turns of a game; 0: those of the problem, if any", 0, LONGEST)

    whole_game = True

    @property
    def _turns(self) -> int | None:
        """How many turns a game has; None for no end."""
        return self.horizon or self.problem.horizon

    @cached_property
    def _found(self) -> Induced:
        return solved(self.problem, self._turns)

    @cached_property
    def _soonest(self) -> Ints:
        return backward_induction.soonest(self._found, self.problem.discount)

    def begin(self, observation: Array) -> Memory:
        """The first state, and no turn done."""
        return (observation, np.zeros(len(observation), np.int64))

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """The new state, one more turn done."""
        return (percept.observation, memory[1] + 1)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The first of the best actions; in a game without end one that ends it soonest."""
        if self._turns is not None:
            return greedy(self.values(memory))
        graph = self._found.graph
        row = self._soonest[graph.at(self.problem, memory[0])]
        return np.asarray(graph.actions[row, self.seat], np.int64)

    def values(self, memory: Memory) -> Reals:
        """Q of each action with the turns that are left; -inf of what is not legal."""
        s, done = memory
        q = np.full((len(s), self.problem.action_counts[self.seat]), -np.inf)
        left = np.full(len(s), -1) if self._turns is None else self._turns - 1 - done % self._turns
        for turns in np.unique(left).tolist():
            rows = np.flatnonzero(left == turns)
            q[rows] = self._ahead(s[rows], None if turns < 0 else turns)
        return q

    def _ahead(self, s: Array, left: int | None) -> Reals:
        """Q `[B, A]` of states where so many turns follow this one."""
        graph, seat = self._found.graph, self.seat
        rows, which = graph.able(graph.at(self.problem, s))
        worth = graph.worth(rows, self.problem.discount, self._found.values_of(left))[:, seat]
        q = np.full((len(s), self.problem.action_counts[seat]), -np.inf)
        np.maximum.at(q, (which, graph.actions[rows, seat]), worth)
        return q

    def in_game(self, turns: int | None, rivals: Sequence[str]) -> Self:
        """One that plans the whole game."""
        if turns is None or turns == self.problem.horizon or turns > LONGEST:
            return self
        return replace(self, horizon=turns)


def solved(problem: Problem, turns: int | None) -> Induced:
    """What games of so many turns are worth, over all states of one agent's or those come to."""
    alone = len(problem.agents) == 1 and isinstance(problem.states, int)
    found = graph.whole(problem) if alone else graph.explored(problem)
    return backward_induction.solved(problem, found, turns)


def visible(problem: Problem) -> dict[str, type[Seated]]:
    """The agents that fit a problem in which everybody sees the state."""
    if not all(problem.action_counts):
        return {}
    if len(problem.agents) == 1:
        return _alone(problem)
    return {"optimal": Foreseeing} if in_turn(problem) else {}


def _alone(problem: Problem) -> dict[str, type[Seated]]:
    """The agent of one who sees: endless where that has a value, else for the turns there are."""
    if not isinstance(problem.states, int):
        return {}
    if problem.discount < 1.0:
        return {"optimal": Seeing}
    if problem.horizon is not None:
        return {"optimal": Foreseeing}
    return {"optimal": Seeing} if problem.terminal(problem.enumerated()).any() else {}


def in_turn(problem: Problem) -> bool:
    """Whether several see the state and all but one wait in the first turn."""
    if len(problem.agents) == 1 or problem.hidden or not all(problem.action_counts):
        return False
    try:
        _, start = exact_start(problem)
    except (BadParameter, TooMuch):
        return False
    waiting = problem.waiting(start).sum(axis=1)
    return start.dtype.kind != "O" and bool((waiting == len(problem.agents) - 1).all())
