"""Multi-agent A*: a best-first search over partial joint plans.

The action of each node of each agent is chosen one by one, those of the last agent after all
others. The upper bound of a partial plan is what it has earned plus what one planner that pools
all observations could still earn (GMAA*-ICE; Oliehoek, Spaan, Amato and Whiteson, JAIR 46, 2013;
in small steps: Koops, Jansen, Junges and Simão, IJCAI 2023). The first complete plan is optimal.
"""

import heapq
from dataclasses import dataclass
from itertools import count
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.solvers.decpomdp.centralized_pomdp import CentralizedPomdp
from dmplay.solvers.decpomdp.dec_pomdp_model import (
    AgentPlan,
    PlanLayer,
    compute_joint_indices,
    list_joint_nodes,
)
from dmplay.solvers.decpomdp.occupancy_state import OccupancyState, merge_equivalent_histories

OPERATIONS_PER_EXPANSION = 10 * ARRAY_CALL_WORK  # to examine the actions of one node
BYTES_PER_OPEN_PLAN = 400
VALUE_TOLERANCE = 1e-12  # Values of plans this close count as equal.


@dataclass(frozen=True, eq=False)
class PartialJointPlan:
    """A joint plan for the first turns."""

    turn: int
    occupancy: OccupancyState
    earned_value: float
    previous: "PartialJointPlan | None" = None
    layers: tuple[PlanLayer, ...] = ()  # of each agent, for the previous turn


class PlanSearchResult(NamedTuple):
    """The best joint plan, or None if that takes too long, and an upper bound on every plan."""

    plans: tuple[AgentPlan, ...] | None
    upper_bound: float


class _OpenPlan(NamedTuple):
    """An entry of the search queue: a partial plan with the actions of some nodes assigned.

    The entry with the greatest upper bound comes first.
    """

    negative_bound: float  # negated, so that the queue returns the greatest first
    depth: int
    tie_breaker: int  # Of equal entries the first one opened comes first.
    partial_plan: PartialJointPlan
    # of `_BayesianGame.assignment_order`, then of the last agent's nodes
    assigned_actions: tuple[int, ...]


class _BayesianGame:
    """The choice of one turn: a game with one reward, in which each node is a type of its agent."""

    def __init__(self, partial_plan: PartialJointPlan, centralized_pomdp: CentralizedPomdp) -> None:
        action_counts, occupancy = centralized_pomdp.team.action_counts, partial_plan.occupancy
        self.node_counts, self.joint_nodes = occupancy.node_counts, occupancy.joint_nodes
        self.action_counts = action_counts
        self.other_joint_actions = list_joint_nodes(action_counts[:-1])  # [B, n - 1]
        turn, weights = partial_plan.turn, occupancy.probabilities
        weights = centralized_pomdp.team.discount**turn * weights
        bounds = centralized_pomdp.get_action_upper_bounds(turn, occupancy.belief_indices)
        shape = len(weights), len(self.other_joint_actions), action_counts[-1]
        self.payoffs = (bounds * weights[:, None]).reshape(shape)
        last_nodes = np.arange(self.node_counts[-1])[:, None]
        self.last_agent_nodes = (self.joint_nodes[:, -1] == last_nodes).astype(float)
        # (seat, node) of all agents but the last, most likely nodes first
        self.assignment_order: list[tuple[int, int]] = []
        for seat, node_count in enumerate(self.node_counts[:-1]):
            mass = np.bincount(self.joint_nodes[:, seat], occupancy.probabilities, node_count)
            nodes = np.argsort(-mass, kind="stable").tolist()
            self.assignment_order += [(seat, node) for node in nodes]

    def bound_last_agent(self, assigned_actions: tuple[int, ...] = ()) -> Reals:
        """Return the upper bound `[K, A]` of each action at the last agent's nodes."""
        best_payoffs = self._restrict_payoffs(assigned_actions).max(axis=1)
        return np.asarray(self.last_agent_nodes @ best_payoffs)

    def _restrict_payoffs(self, assigned_actions: tuple[int, ...]) -> Reals:
        """Return the payoffs, minus infinity if they contradict the assigned actions.

        The axes `[J, B, A]` are joint nodes, joint actions of the other agents, and actions of
        the last agent.
        """
        is_allowed = np.ones(self.payoffs.shape[:2], bool)
        for (seat, node), action in zip(self.assignment_order, assigned_actions, strict=False):
            is_assigned = self.other_joint_actions[:, seat] == action
            is_allowed[self.joint_nodes[:, seat] == node] &= is_assigned
        return np.where(is_allowed[:, :, None], self.payoffs, -np.inf)

    def bound_next_assignment(self, assigned_actions: tuple[int, ...]) -> Reals:
        """Return the plan's upper bound with each action `[A]` at the next node to assign."""
        payoffs = self._restrict_payoffs(assigned_actions)
        seat, node = self.assignment_order[len(assigned_actions)]
        node_rows = np.flatnonzero(self.joint_nodes[:, seat] == node)
        best_payoffs = payoffs.max(axis=1)
        bounds = self.last_agent_nodes @ best_payoffs
        result = np.empty(self.action_counts[seat])
        for action in range(len(result)):
            is_assigned = self.other_joint_actions[:, seat] == action
            restricted = payoffs[node_rows][:, is_assigned].max(axis=1)
            change = self.last_agent_nodes[:, node_rows] @ (restricted - best_payoffs[node_rows])
            result[action] = (bounds + change).max(axis=1).sum()
        return result

    def build_decision_rules(
        self, assigned_actions: tuple[int, ...], last_agent_rule: Ints
    ) -> tuple[Ints, ...]:
        """Return the action of each node `[K]` of each agent."""
        rules = [np.zeros(size, np.int64) for size in self.node_counts[:-1]]
        for (seat, node), action in zip(self.assignment_order, assigned_actions, strict=False):
            rules[seat][node] = action
        return *rules, last_agent_rule


class MultiagentAStar:
    """A search for the best joint plan of a number of turns."""

    def __init__(self, centralized_pomdp: CentralizedPomdp, budget: Budget) -> None:
        self.centralized_pomdp, self.team = centralized_pomdp, centralized_pomdp.team
        self.budget = budget
        self._open_plans: list[_OpenPlan] = []
        self._best_earned_values: dict[tuple[int, bytes], float] = {}
        self._tie_breakers, self._held_bytes = count(), 0.0

    def find_best_plan(self) -> PlanSearchResult:
        """Return the best plan and its value, or only an upper bound if the budget ends before."""
        seat_count, bound = len(self.team.action_counts), self.centralized_pomdp.upper_bound
        first_nodes = np.zeros((1, seat_count), np.int64)
        start = OccupancyState(first_nodes, np.zeros(1, np.int64), np.ones(1))
        finished = None
        with self.budget.stop_when_exceeded():
            self._open_partial_plan(PartialJointPlan(0, start, 0.0), bound)
            while not finished:
                open_plan = heapq.heappop(self._open_plans)
                bound = min(bound, -open_plan.negative_bound)
                finished = self._expand_plan(open_plan)
        if finished:
            return PlanSearchResult(_collect_plans(finished), finished.earned_value)
        return PlanSearchResult(None, bound)

    def _open_partial_plan(self, partial_plan: PartialJointPlan, upper_bound: float) -> None:
        """Open a partial plan with no action of its current turn assigned."""
        game = _BayesianGame(partial_plan, self.centralized_pomdp)
        bound = partial_plan.earned_value + game.bound_last_agent().max(axis=1).sum()
        self._push_open_plan(partial_plan, min(upper_bound, bound))

    def _push_open_plan(
        self,
        partial_plan: PartialJointPlan,
        upper_bound: float,
        assigned_actions: tuple[int, ...] = (),
    ) -> None:
        """Add a partial plan with its assigned actions to the search queue."""
        depth = -(len(assigned_actions) + 10_000 * partial_plan.turn)
        self._held_bytes += BYTES_PER_OPEN_PLAN
        open_plan = _OpenPlan(
            -float(upper_bound), depth, next(self._tie_breakers), partial_plan, assigned_actions
        )
        heapq.heappush(self._open_plans, open_plan)

    def _expand_plan(self, open_plan: _OpenPlan) -> PartialJointPlan | None:
        """Expand an open plan by one step; return the complete plan if that finishes it."""
        partial_plan, assigned = open_plan.partial_plan, open_plan.assigned_actions
        game = _BayesianGame(partial_plan, self.centralized_pomdp)
        self.budget.spend_work(OPERATIONS_PER_EXPANSION + 8.0 * game.payoffs.size)
        self.budget.check_memory(self._held_bytes)
        if len(assigned) < len(game.assignment_order):
            bounds = partial_plan.earned_value + game.bound_next_assignment(assigned)
            for action, bound in enumerate(np.minimum(bounds, -open_plan.negative_bound).tolist()):
                self._push_open_plan(partial_plan, bound, (*assigned, action))
            return None
        action_bounds, order_length = game.bound_last_agent(assigned), len(game.assignment_order)
        first_free_node = len(assigned) - order_length
        best_actions = action_bounds[first_free_node:].argmax(axis=1)
        rule = np.append(assigned[order_length:], best_actions).astype(np.int64)
        self._push_alternatives(open_plan, action_bounds, rule, first_free_node)
        rules = game.build_decision_rules(assigned, rule)
        next_plan = self._extend_partial_plan(partial_plan, rules)
        if next_plan.turn < self.centralized_pomdp.turns:
            self._open_unless_dominated(next_plan, -open_plan.negative_bound)
            return None
        return next_plan

    def _push_alternatives(
        self, open_plan: _OpenPlan, action_bounds: Reals, rule: Ints, first_free_node: int
    ) -> None:
        """Open the alternatives of the last agent: every other action at each free node."""
        chosen_bounds = action_bounds[np.arange(len(rule)), rule]
        assigned = open_plan.assigned_actions[: len(open_plan.assigned_actions) - first_free_node]
        chosen_value = open_plan.partial_plan.earned_value + chosen_bounds.sum()
        bounds = chosen_value - chosen_bounds[:, None] + action_bounds
        bounds = np.minimum(bounds, -open_plan.negative_bound)
        for node in range(first_free_node, len(rule)):
            for action in np.flatnonzero(np.arange(action_bounds.shape[1]) != rule[node]).tolist():
                alternative = (*assigned, *rule[:node].tolist(), action)
                self._push_open_plan(open_plan.partial_plan, bounds[node, action], alternative)

    def _extend_partial_plan(
        self, partial_plan: PartialJointPlan, decision_rules: tuple[Ints, ...]
    ) -> PartialJointPlan:
        """Return the partial plan one turn longer, with these decision rules in its last turn."""
        turn, (joint_nodes, belief_indices, p) = partial_plan.turn, partial_plan.occupancy
        observation_counts, centralized = self.team.observation_counts, self.centralized_pomdp
        agent_actions = [
            rule[column] for rule, column in zip(decision_rules, joint_nodes.T, strict=True)
        ]
        actions = compute_joint_indices(agent_actions, self.team.action_counts)
        reward = float(p @ centralized.compute_expected_rewards(turn, belief_indices, actions))
        earned_value = partial_plan.earned_value + self.team.discount**turn * reward
        if turn + 1 == centralized.turns:
            final_layers = [
                PlanLayer(rule, np.zeros((len(rule), k), np.int64))
                for rule, k in zip(decision_rules, observation_counts, strict=True)
            ]
            layers, occupancy = tuple(final_layers), partial_plan.occupancy
            return PartialJointPlan(turn + 1, occupancy, earned_value, partial_plan, layers)
        next_beliefs, probabilities = centralized.compute_next_beliefs(
            turn, belief_indices, actions
        )
        rows, observations = np.nonzero(probabilities)
        first_nodes = joint_nodes[rows] * np.array(observation_counts)
        next_nodes = first_nodes + self.team.joint_observations[observations]
        node_counts = tuple(
            len(rule) * k for rule, k in zip(decision_rules, observation_counts, strict=True)
        )
        p, beliefs = p[rows] * probabilities[rows, observations], next_beliefs[rows, observations]
        occupancy = OccupancyState(next_nodes, beliefs, p)
        occupancy, merged_nodes = merge_equivalent_histories(occupancy, node_counts)
        layers = tuple(
            PlanLayer(rule, np.maximum(node_map, 0).reshape(len(rule), -1))
            for rule, node_map in zip(decision_rules, merged_nodes, strict=True)
        )
        return PartialJointPlan(turn + 1, occupancy, earned_value, partial_plan, layers)

    def _open_unless_dominated(self, partial_plan: PartialJointPlan, upper_bound: float) -> None:
        """Open a partial plan, unless another with the same occupancy has earned as much."""
        key = partial_plan.turn, partial_plan.occupancy.key
        if self._best_earned_values.get(key, -np.inf) < partial_plan.earned_value - VALUE_TOLERANCE:
            self._best_earned_values[key] = partial_plan.earned_value
            self._held_bytes += 4.0 * len(key[1])
            self._open_partial_plan(partial_plan, upper_bound)


def _collect_plans(partial_plan: PartialJointPlan) -> tuple[AgentPlan, ...]:
    """Return the plan of each agent that leads to this partial plan."""
    layers = []
    while partial_plan.previous:
        layers.append(partial_plan.layers)
        partial_plan = partial_plan.previous
    return tuple(zip(*reversed(layers), strict=True))
