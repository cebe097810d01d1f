"""Agents of a team with separate observations and a shared reward, following one joint plan."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import AdviceQuestion, SeatPolicy
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory, Percept
from dmplay.core.problem import Problem
from dmplay.core.text import format_count, format_number
from dmplay.core.work_budget import Budget
from dmplay.errors import BadPolicy
from dmplay.solvers.decpomdp.dec_pomdp_model import AgentPlan, DecPomdp, PlanLayer
from dmplay.solvers.decpomdp.joint_plan_improvement import PlanGraph
from dmplay.solvers.decpomdp.joint_plan_search import solve_joint_plan

DEFAULT_PLAN_TURNS = 4  # turns of a plan if the game has no end of its own
MAX_PLAN_TURNS = 100  # maximum number of turns that are planned
VALUES_WORK_LIMIT = 1e10  # maximum work for the action values of a plan


@dataclass(frozen=True)
class JointPlan(SeatPolicy):
    """Follows the best joint plan found, assuming that the whole team follows it.

    A plan covers a number of turns; after these it begins again. Values are known only until then
    and while the seat follows it, as they are computed for the beliefs of these nodes.
    """

    plans_whole_game = True

    horizon: int = parameter(
        0, "turns planned; 0: the problem's horizon, or 4 if none", 0, MAX_PLAN_TURNS
    )

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return exact values of the plan if the whole team follows it."""
        opponents = {*question.actual_opponents}
        names = {f"joint-plan:horizon={self.planned_turns}"}
        if self.planned_turns == replace(self, horizon=0).planned_turns:
            names.add("joint-plan")
        follows_plan = bool(opponents) and opponents <= names
        assumption = "" if follows_plan else "if the whole team follows the plan"
        basis = super().values_basis(question).with_plan(self.planned_turns, question.turn_limit)
        return basis._replace(accuracy=Accuracy.EXACT, assumed_players=assumption)

    @property
    def planned_turns(self) -> int:
        """The number of turns that the plan covers."""
        return self.horizon or min(self.problem.horizon or DEFAULT_PLAN_TURNS, MAX_PLAN_TURNS)

    @cached_property
    def plans(self) -> tuple[AgentPlan, ...]:
        """The plans of all seats, the same for each seat's agent."""
        return solve_joint_plan(self.problem, self.planned_turns).plans

    @cached_property
    def _own_plan(self) -> PlanLayer:
        """The own plan as one layer: actions `[T, K]`, and nodes of the next turn `[T, K, O]`."""
        return PlanLayer(*map(_stack_plan_layers, zip(*self.plans[self.seat], strict=True)))

    @cached_property
    def _node_values(self) -> Reals:
        """The value of each action at each node of each turn `[T, K, A]`."""
        budget = Budget("values of a joint plan", "try fewer turns", VALUES_WORK_LIMIT)
        graph = PlanGraph(DecPomdp.from_problem(self.problem), self.plans, budget)
        return _stack_plan_layers(graph.compute_action_values(self.seat))

    def initial_memory(self, observation: Array) -> Memory:
        """Return the first node of the plan, zero turns done, and True while values are known."""
        rows = len(observation)
        return (np.zeros(rows, np.int64), np.zeros(rows, np.int64), np.ones(rows, bool))

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the node to which the observation leads, whatever action was taken."""
        node, turns_done, has_values = memory
        follows_plan = percept.action == self._own_plan.actions[turns_done, node]
        next_node = self._own_plan.next_nodes[turns_done, node, percept.observation]
        next_turn = (turns_done + 1) % self.planned_turns
        return (next_node, next_turn, has_values & follows_plan & (next_turn > 0))

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the plan's action at the current node."""
        node, turns_done, _ = memory
        return self._own_plan.actions[turns_done, node]

    def action_values(self, memory: Memory) -> Reals:
        """Return the value `[B, A]` of actions before the plan's later ones, if others follow it.

        It is nan after the seat left the plan, or after the plan began again.
        """
        node, turns_done, has_values = memory
        return np.where(has_values[:, None], self._node_values[turns_done, node], np.nan)

    def describe_model(self, memory: Memory) -> str:
        """Return the reason why there are no values, '' if there are some."""
        return "" if memory[2][0] else "no values since the plan was left or began again"

    def adapt_to_game(self, question: AdviceQuestion) -> Self:
        """Return a policy that plans the whole game, if it is not too long."""
        turns = question.turn_limit
        return self if turns is None or turns > MAX_PLAN_TURNS else replace(self, horizon=turns)


@dataclass(frozen=True)
class OptimalJointPlan(JointPlan):
    """Follows an optimal joint plan; refuses to play unless the plan is proven to be optimal."""

    @cached_property
    def plans(self) -> tuple[AgentPlan, ...]:
        """The plans of all seats; raises BadPolicy if they are not proven to be optimal."""
        solution = solve_joint_plan(self.problem, self.planned_turns)
        if not solution.is_optimal:
            turns = format_count(self.planned_turns, "turn")
            value, upper_bound = map(format_number, (solution.value, solution.upper_bound))
            raise BadPolicy(
                f"optimal: the best plan found for {turns} has value {value}, "
                f"an optimal one at most {upper_bound}; use joint-plan"
            )
        return solution.plans


def _stack_plan_layers(parts: Sequence[Array]) -> Array:
    """Return the arrays of all turns as one, padded with zeros to the largest number of nodes."""
    max_nodes = max(map(len, parts))
    stacked = np.zeros((len(parts), max_nodes, *parts[0].shape[1:]), parts[0].dtype)
    for turn, part in enumerate(parts):
        stacked[turn, : len(part)] = part
    return stacked


def build_roster(problem: Problem, seat: int) -> Roster:
    """Return the agents of such a team; in all seats they follow the same plan."""
    agents = {"joint-plan": JointPlan, "optimal": OptimalJointPlan}
    return Roster(agents, hint_provider="joint-plan", default_partner="joint-plan")
