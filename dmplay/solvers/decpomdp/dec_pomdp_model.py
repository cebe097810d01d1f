"""Dec-POMDPs as arrays: agents with separate observations and one reward, and joint plans.

A plan has nodes for each turn: the action to take there, and the node of the next turn for each of
the agent's own observations.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import prod
from typing import NamedTuple

import numpy as np

from dmplay.core import belief
from dmplay.core.arrays import Ints, Reals
from dmplay.core.problem import Problem
from dmplay.core.tabular import tabulate

PROBABILITY_DECIMALS = 9  # to which probabilities are distinguished


class PlanLayer(NamedTuple):
    """The nodes of one agent's plan in one turn."""

    actions: Ints  # [K]
    next_nodes: Ints  # [K, O], nodes of the next turn


AgentPlan = tuple[PlanLayer, ...]  # of one agent, one layer per turn; it begins in node 0


@dataclass(frozen=True, eq=False)
class DecPomdp:
    """A cooperative problem of several agents whose state is hidden, as arrays."""

    transition: Reals  # [S, A, S']
    rewards: Reals  # [S, A]
    observation_model: Reals  # [A, S', O]
    initial_belief: Reals  # [S]
    discount: float
    action_counts: tuple[int, ...]  # of each agent
    observation_counts: tuple[int, ...]  # of each agent

    @classmethod
    def from_problem(cls, problem: Problem) -> "DecPomdp":
        """Return the arrays of a problem whose agents share one reward."""
        tables = tabulate(problem)
        counts = problem.action_counts, problem.observation_counts
        start, rewards = belief.initial_belief(problem), tables.rewards[:, :, 0]
        return cls(
            tables.transition, rewards, tables.observation_model, start, problem.discount, *counts
        )

    @cached_property
    def joint_actions(self) -> Ints:
        """All joint actions `[A, n]`."""
        return np.array(list(product(*map(range, self.action_counts))))

    @cached_property
    def joint_observations(self) -> Ints:
        """All joint observations `[O, n]`."""
        return np.array(list(product(*map(range, self.observation_counts))))

    def propagate_states(self, weights: Reals, action: int) -> Reals:
        """Return next-state weights `[N, S']` after a joint action, from weights `[N, S]`."""
        return np.asarray(weights @ self.transition[:, action])

    def vary_seat_action(self, action: int, seat: int) -> list[int]:
        """Return the joint actions that equal `action` except for the action of one seat."""
        actions = np.tile(self.joint_actions[action], (self.action_counts[seat], 1))
        actions[:, seat] = np.arange(len(actions))
        indices: list[int] = compute_joint_indices(tuple(actions.T), self.action_counts).tolist()
        return indices

    def propagate_seat_actions(self, weights: Reals, action: int, seat: int) -> Reals:
        """Return `propagate_states` for each action of one seat, the others fixed, `[A, N, S']`."""
        variants = self.vary_seat_action(action, seat)
        return np.stack([self.propagate_states(weights, variant) for variant in variants])

    def backup_values(self, values: Reals, action: int) -> Reals:
        """Return the expected values `[N, S]` of next states whose values are `[N, S']`."""
        return np.asarray(values @ self.transition[:, action].T)

    @property
    def propagation_work(self) -> float:
        """The number of operations to propagate a state distribution and its observations."""
        state_count = len(self.initial_belief)
        return float(state_count * (state_count + self.observation_model.shape[2]))


def compute_joint_indices(indices: Sequence[Ints], counts: tuple[int, ...]) -> Ints:
    """Return the row-major joint index of the agents' indices."""
    return np.asarray(np.ravel_multi_index(tuple(indices), counts))


def list_joint_nodes(node_counts: Sequence[int]) -> Ints:
    """Return all joint nodes `[Q, n]`, given the number of nodes of each agent."""
    return np.indices(tuple(node_counts)).reshape(len(node_counts), prod(node_counts)).T
