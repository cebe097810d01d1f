"""Multi-agent A*: of all joint plans that are begun, the one that promises most is gone on with.

What each node of each agent does is chosen one by one, the last agent's nodes after all others, and
a plan promises what it has earned and what one planner who pools all observations would still earn
(GMAA*-ICE; Oliehoek, Spaan, Amato and Whiteson, JAIR 46, 2013; in small steps: Koops, Jansen,
Junges and Simão, IJCAI 2023). The first plan that is finished is the best.
"""

import heapq
from dataclasses import dataclass
from itertools import count
from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Ints, Reals
from dmplay.solvers.occupancy import OccupancyState, merge_equivalent_histories
from dmplay.solvers.pooled_beliefs import CentralizedPomdp
from dmplay.solvers.team import AgentPlan, PlanLayer, compute_joint_indices, list_joint_nodes

OPERATIONS_PER_EXPANSION = 10 * ARRAY_CALL_WORK  # work of looking at what one node may do
BYTES_PER_OPEN_PLAN = 400  # bytes of a plan to go on with
VALUE_TOLERANCE = 1e-12  # by which two plans earn the same


@dataclass(frozen=True, eq=False)
class PartialJointPlan:
    """A joint plan of the turns so far."""

    turn: int
    occupancy: OccupancyState
    earned_value: float
    previous: "PartialJointPlan | None" = None
    layers: tuple[PlanLayer, ...] = ()  # of each agent, for the turn before


class PlanSearchResult(NamedTuple):
    """The best joint plan, None where that takes too long; none is worth more than `bound`."""

    plans: tuple[AgentPlan, ...] | None
    upper_bound: float


class _OpenPlan(NamedTuple):
    """A plan to go on with, the least first: what some nodes do is given, others are free."""

    negative_bound: float  # what it promises, below 0
    depth: int
    tie_breaker: int  # of those alike the one that was opened first
    partial_plan: PartialJointPlan
    assigned_actions: tuple[int, ...]  # actions: of `_Game.slots`, then of the last agent's nodes


class _BayesianGame:
    """The choice of a turn: a game of one reward in which each node is a type of its agent."""

    def __init__(self, partial_plan: PartialJointPlan, centralized_pomdp: CentralizedPomdp) -> None:
        many, occupancy = centralized_pomdp.team.action_counts, partial_plan.occupancy
        self.node_counts, self.joint_nodes = occupancy.node_counts, occupancy.joint_nodes
        self.action_counts, self.other_joint_actions = (
            many,
            list_joint_nodes(many[:-1]),
        )  # [B, n - 1]
        weight = centralized_pomdp.team.discount**partial_plan.turn * occupancy.probabilities
        worth = (
            centralized_pomdp.get_action_upper_bounds(partial_plan.turn, occupancy.belief_indices)
            * weight[:, None]
        )
        self.payoffs = worth.reshape(
            len(weight), len(self.other_joint_actions), many[-1]
        )
        self.last_agent_nodes = (
            self.joint_nodes[:, -1] == np.arange(self.node_counts[-1])[:, None]
        ).astype(float)
        self.assignment_order: list[
            tuple[int, int]
        ] = []  # nodes of all agents but the last, likely first
        for seat, size in enumerate(self.node_counts[:-1]):
            mass = np.bincount(self.joint_nodes[:, seat], occupancy.probabilities, size)
            self.assignment_order += [
                (seat, int(node)) for node in np.argsort(-mass, kind="stable")
            ]

    def bound_last_agent(self, assigned_actions: tuple[int, ...] = ()) -> Reals:
        """The most that each action of the last agent's nodes promises `[K, A]`."""
        return np.asarray(
            self.last_agent_nodes @ self._restrict_payoffs(assigned_actions).max(axis=1)
        )

    def _restrict_payoffs(self, assigned_actions: tuple[int, ...]) -> Reals:
        """The worth `[J, B, A]` of joint actions, minus infinity of those not given."""
        able = np.ones(self.payoffs.shape[:2], bool)
        for (seat, node), action in zip(self.assignment_order, assigned_actions, strict=False):
            able[self.joint_nodes[:, seat] == node] &= self.other_joint_actions[:, seat] == action
        return np.where(able[:, :, None], self.payoffs, -np.inf)

    def bound_next_assignment(self, assigned_actions: tuple[int, ...]) -> Reals:
        """What the plan promises with each action `[A]` of the next slot."""
        able = self._restrict_payoffs(assigned_actions)
        seat, node = self.assignment_order[len(assigned_actions)]
        here = np.flatnonzero(self.joint_nodes[:, seat] == node)
        free = able.max(axis=1)
        promised = self.last_agent_nodes @ free
        found = np.empty(self.action_counts[seat])
        for action in range(len(found)):
            taken = able[here][:, self.other_joint_actions[:, seat] == action].max(axis=1)
            more = self.last_agent_nodes[:, here] @ (taken - free[here])
            found[action] = (promised + more).max(axis=1).sum()
        return found

    def build_decision_rules(
        self, assigned_actions: tuple[int, ...], last_agent_rule: Ints
    ) -> tuple[Ints, ...]:
        """What each node `[K]` of each agent does."""
        rules = [np.zeros(size, np.int64) for size in self.node_counts[:-1]]
        for (seat, node), action in zip(self.assignment_order, assigned_actions, strict=False):
            rules[seat][node] = action
        return (*rules, last_agent_rule)


class MultiagentAStar:
    """The search for the best joint plan of so many turns."""

    def __init__(self, centralized_pomdp: CentralizedPomdp, budget: Budget) -> None:
        self.centralized_pomdp, self.team, self.budget = (
            centralized_pomdp,
            centralized_pomdp.team,
            budget,
        )
        self._open_plans: list[_OpenPlan] = []
        self._best_earned_values: dict[tuple[int, bytes], float] = {}
        self._tie_breakers, self._held_bytes = count(), 0.0

    def find_best_plan(self) -> PlanSearchResult:
        """The best plan and its value; where the budget ends before, what none exceeds."""
        seats, bound = len(self.team.action_counts), self.centralized_pomdp.upper_bound
        start = OccupancyState(np.zeros((1, seats), np.int64), np.zeros(1, np.int64), np.ones(1))
        finished = None
        with self.budget.stop_when_exceeded():
            self._open_partial_plan(PartialJointPlan(0, start, 0.0), bound)
            while not finished:
                one = heapq.heappop(self._open_plans)
                bound = min(bound, -one.negative_bound)
                finished = self._expand_plan(one)
        return (
            PlanSearchResult(_collect_plans(finished), finished.earned_value)
            if finished
            else PlanSearchResult(None, bound)
        )

    def _open_partial_plan(self, partial_plan: PartialJointPlan, upper_bound: float) -> None:
        """Opens a stage of which nothing is given."""
        ahead = (
            _BayesianGame(partial_plan, self.centralized_pomdp).bound_last_agent().max(axis=1).sum()
        )
        self._push_open_plan(partial_plan, min(upper_bound, partial_plan.earned_value + ahead))

    def _push_open_plan(
        self,
        partial_plan: PartialJointPlan,
        upper_bound: float,
        assigned_actions: tuple[int, ...] = (),
    ) -> None:
        depth = -(len(assigned_actions) + 10_000 * partial_plan.turn)
        self._held_bytes += BYTES_PER_OPEN_PLAN
        one = _OpenPlan(
            -float(upper_bound), depth, next(self._tie_breakers), partial_plan, assigned_actions
        )
        heapq.heappush(self._open_plans, one)

    def _expand_plan(self, open_plan: _OpenPlan) -> PartialJointPlan | None:
        """One step; the stage behind the last turn if that finishes a plan."""
        stage, given = open_plan.partial_plan, open_plan.assigned_actions
        game = _BayesianGame(stage, self.centralized_pomdp)
        self.budget.spend_work(OPERATIONS_PER_EXPANSION + 8.0 * game.payoffs.size)
        self.budget.check_memory(self._held_bytes)
        if len(given) < len(game.assignment_order):
            for action, most in enumerate(game.bound_next_assignment(given).tolist()):
                self._push_open_plan(
                    stage,
                    min(-open_plan.negative_bound, stage.earned_value + most),
                    (*given, action),
                )
            return None
        worth, free = game.bound_last_agent(given), len(given) - len(game.assignment_order)
        rule = np.append(given[len(game.assignment_order) :], worth[free:].argmax(axis=1)).astype(
            np.int64
        )
        self._push_alternatives(open_plan, worth, rule, free)
        after = self._extend_partial_plan(stage, game.build_decision_rules(given, rule))
        if after.turn < self.centralized_pomdp.turns:
            self._open_unless_dominated(after, -open_plan.negative_bound)
            return None
        return after

    def _push_alternatives(
        self, open_plan: _OpenPlan, action_bounds: Reals, rule: Ints, first_free_node: int
    ) -> None:
        """Opens what else the last agent may do: another action at each node that is free."""
        chosen = action_bounds[np.arange(len(rule)), rule]
        given = open_plan.assigned_actions[: len(open_plan.assigned_actions) - first_free_node]
        promise = np.minimum(
            open_plan.partial_plan.earned_value + chosen.sum() - chosen[:, None] + action_bounds,
            -open_plan.negative_bound,
        )
        for node in range(first_free_node, len(rule)):
            for action in np.flatnonzero(np.arange(action_bounds.shape[1]) != rule[node]).tolist():
                others = (*given, *rule[:node].tolist(), action)
                self._push_open_plan(open_plan.partial_plan, promise[node, action], others)

    def _extend_partial_plan(
        self, partial_plan: PartialJointPlan, decision_rules: tuple[Ints, ...]
    ) -> PartialJointPlan:
        """The stage after these actions."""
        turn, (nodes, belief, p) = partial_plan.turn, partial_plan.occupancy
        seen, pooled = self.team.observation_counts, self.centralized_pomdp
        each = [rule[own] for rule, own in zip(decision_rules, nodes.T, strict=True)]
        actions = compute_joint_indices(each, self.team.action_counts)
        paid = float(p @ pooled.compute_expected_rewards(turn, belief, actions))
        earned = partial_plan.earned_value + self.team.discount**turn * paid
        if turn + 1 == pooled.turns:
            ends = [
                PlanLayer(rule, np.zeros((len(rule), k), np.int64))
                for rule, k in zip(decision_rules, seen, strict=True)
            ]
            return PartialJointPlan(
                turn + 1, partial_plan.occupancy, earned, partial_plan, tuple(ends)
            )
        after, likely = pooled.expand_actions(turn, belief, actions)
        row, kind = np.nonzero(likely)
        grown = nodes[row] * np.array(seen) + self.team.joint_observations[kind]
        many = tuple(len(rule) * k for rule, k in zip(decision_rules, seen, strict=True))
        reached = OccupancyState(grown, after[row, kind], p[row] * likely[row, kind])
        found, places = merge_equivalent_histories(reached, many)
        layers = [
            PlanLayer(rule, np.maximum(place, 0).reshape(len(rule), -1))
            for rule, place in zip(decision_rules, places, strict=True)
        ]
        return PartialJointPlan(turn + 1, found, earned, partial_plan, tuple(layers))

    def _open_unless_dominated(self, partial_plan: PartialJointPlan, upper_bound: float) -> None:
        """Opens a stage, unless another way there has earned as much."""
        key = partial_plan.turn, partial_plan.occupancy.key
        if self._best_earned_values.get(key, -np.inf) < partial_plan.earned_value - VALUE_TOLERANCE:
            self._best_earned_values[key] = partial_plan.earned_value
            self._held_bytes += 4.0 * len(key[1])
            self._open_partial_plan(partial_plan, upper_bound)


def _collect_plans(partial_plan: PartialJointPlan) -> tuple[AgentPlan, ...]:
    """The plan of each agent that leads here."""
    layers = []
    while partial_plan.previous:
        layers.append(partial_plan.layers)
        partial_plan = partial_plan.previous
    return tuple(zip(*reversed(layers), strict=True))
