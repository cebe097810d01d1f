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

PROBABILITY_DECIMALS = 9  # decimals to which probabilities are told apart


class PlanLayer(NamedTuple):
    """One agent's nodes of one turn."""

    actions: Ints  # [K]
    next_nodes: Ints  # [K, O], a node of the next turn


AgentPlan = tuple[PlanLayer, ...]  # of one agent, a layer a turn; it begins in node 0


@dataclass(frozen=True, eq=False)
class DecPomdp:
    """A cooperative problem of several agents whose state is hidden."""

    transition: Reals  # [S, A, S']
    rewards: Reals  # [S, A]
    observation_model: Reals  # [A, S', O]
    initial_belief: Reals  # [S]
    discount: float
    action_counts: tuple[int, ...]  # how many each agent has
    observation_counts: tuple[int, ...]  # how many each agent makes

    @classmethod
    def from_problem(cls, problem: Problem) -> "DecPomdp":
        """The arrays of a problem whose agents have one reward."""
        tables = tabulate(problem)
        counts = problem.action_counts, problem.observation_counts
        start, rewards = belief.initial_belief(problem), tables.rewards[:, :, 0]
        return cls(
            tables.transition, rewards, tables.observation_model, start, problem.discount, *counts
        )

    @cached_property
    def joint_actions(self) -> Ints:
        """Every joint action `[A, n]`."""
        return np.array(list(product(*map(range, self.action_counts))))

    @cached_property
    def joint_observations(self) -> Ints:
        """Every joint observation `[O, n]`."""
        return np.array(list(product(*map(range, self.observation_counts))))

    def propagate_states(self, weights: Reals, action: int) -> Reals:
        """How likely next states are `[N, S']` where states are so likely `[N, S]`."""
        return np.asarray(weights @ self.transition[:, action])

    def list_seat_variants(self, action: int, seat: int) -> list[int]:
        """The joint actions that differ in what one agent does."""
        each = np.tile(self.joint_actions[action], (self.action_counts[seat], 1))
        each[:, seat] = np.arange(len(each))
        varied: list[int] = compute_joint_indices(tuple(each.T), self.action_counts).tolist()
        return varied

    def propagate_seat_actions(self, weights: Reals, action: int, seat: int) -> Reals:
        """As `onward`, for each action of one agent beside the others' `[A, N, S']`."""
        return np.stack(
            [
                self.propagate_states(weights, other)
                for other in self.list_seat_variants(action, seat)
            ]
        )

    def backup_values(self, values: Reals, action: int) -> Reals:
        """What states are worth `[N, S]` whose next ones are worth so much `[N, S']`."""
        return np.asarray(values @ self.transition[:, action].T)

    @property
    def propagation_work(self) -> float:
        """How many operations it takes to lead a distribution of states on, and to look."""
        return float(
            len(self.initial_belief) * (len(self.initial_belief) + self.observation_model.shape[2])
        )


def compute_joint_indices(indices: Sequence[Ints], counts: tuple[int, ...]) -> Ints:
    """The row-major index of what each agent's index is."""
    return np.asarray(np.ravel_multi_index(tuple(indices), counts))


def list_joint_nodes(node_counts: Sequence[int]) -> Ints:
    """Every joint node `[Q, n]` of so many for each agent."""
    return np.indices(tuple(node_counts)).reshape(len(node_counts), prod(node_counts)).T
