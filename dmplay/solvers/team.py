"""A team as arrays: agents that see apart and are paid alike, and the joint plans that they follow.

A plan holds nodes for each turn: what to do there, and to which node of the next turn each of the
agent's own observations leads.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import prod
from typing import NamedTuple

import numpy as np

from dmplay import belief
from dmplay.chance import Ints, Reals
from dmplay.core import Problem
from dmplay.tabular import tabulate

CERTAIN = 9  # decimals to which probabilities are told apart


class Layer(NamedTuple):
    """One agent's nodes of one turn."""

    actions: Ints  # [K]
    then: Ints  # [K, O], a node of the next turn


Plan = tuple[Layer, ...]  # of one agent, a layer a turn; it begins in node 0


@dataclass(frozen=True, eq=False)
class Team:
    """A cooperative problem of several agents whose state is hidden."""

    transition: Reals  # [S, A, S']
    rewards: Reals  # [S, A]
    seen: Reals  # [A, S', O]
    start: Reals  # [S]
    discount: float
    actions: tuple[int, ...]  # how many each agent has
    observations: tuple[int, ...]  # how many each agent makes

    @classmethod
    def of(cls, problem: Problem) -> "Team":
        """The arrays of a problem whose agents have one reward."""
        tables = tabulate(problem)
        counts = problem.action_counts, problem.observation_counts
        start, rewards = belief.prior(problem), tables.rewards[:, :, 0]
        return cls(tables.transition, rewards, tables.seen, start, problem.discount, *counts)

    @cached_property
    def joint_actions(self) -> Ints:
        """Every joint action `[A, n]`."""
        return np.array(list(product(*map(range, self.actions))))

    @cached_property
    def joint_observations(self) -> Ints:
        """Every joint observation `[O, n]`."""
        return np.array(list(product(*map(range, self.observations))))

    def onward(self, joint: Reals, action: int) -> Reals:
        """How likely next states are `[N, S']` where states are so likely `[N, S]`."""
        return np.asarray(joint @ self.transition[:, action])

    def varied(self, action: int, seat: int) -> list[int]:
        """The joint actions that differ in what one agent does."""
        each = np.tile(self.joint_actions[action], (self.actions[seat], 1))
        each[:, seat] = np.arange(len(each))
        varied: list[int] = joined(tuple(each.T), self.actions).tolist()
        return varied

    def onward_each(self, joint: Reals, action: int, seat: int) -> Reals:
        """As `onward`, for each action of one agent beside the others' `[A, N, S']`."""
        return np.stack([self.onward(joint, other) for other in self.varied(action, seat)])

    def back(self, values: Reals, action: int) -> Reals:
        """What states are worth `[N, S]` whose next ones are worth so much `[N, S']`."""
        return np.asarray(values @ self.transition[:, action].T)

    @property
    def work(self) -> float:
        """How many operations it takes to lead a distribution of states on, and to look."""
        return float(len(self.start) * (len(self.start) + self.seen.shape[2]))


def joined(each: Sequence[Ints], counts: tuple[int, ...]) -> Ints:
    """The row-major index of what each agent's index is."""
    return np.asarray(np.ravel_multi_index(tuple(each), counts))


def nodes(counts: Sequence[int]) -> Ints:
    """Every joint node `[Q, n]` of so many for each agent."""
    return np.indices(tuple(counts)).reshape(len(counts), prod(counts)).T
