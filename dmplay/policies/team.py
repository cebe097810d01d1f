"""Agents of a team that sees apart and is paid alike: each follows its part of one joint plan."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import prod
from typing import Self

import numpy as np

from dmplay.budget import Budget
from dmplay.chance import Array, Bools, Reals
from dmplay.core import Labels, Memory, Percept, Problem, parameter
from dmplay.describe import format_count
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded
from dmplay.policies._kept import memoize
from dmplay.policies.kinds import SeatPolicy
from dmplay.policies.roster import Roster
from dmplay.solvers import team_plan
from dmplay.solvers.plan_graphs import PlanGraph
from dmplay.solvers.team import AgentPlan, DecPomdp, PlanLayer
from dmplay.solvers.team_plan import JointPlanSolution
from dmplay.tabular import Tabular, tabulate

DEFAULT_PLAN_TURNS = 4  # turns of a plan where the game has no end of its own
MAX_PLAN_TURNS = 100  # turns that are planned
MAX_ARRAY_ELEMENTS = 2**25  # numbers of the arrays that a joint plan is made with
VALUES_WORK_LIMIT = 1e10  # work for the values of a plan


@dataclass(frozen=True)
class JointPlan(SeatPolicy):
    """Follows the best joint plan found for the team, as if all of the team do.

    A plan is for a number of turns; when they are over it begins again.
    """

    plans_whole_game = True

    horizon: int = parameter(0, "turns planned; 0 for the game's own, or 4", 0, MAX_PLAN_TURNS)

    @property
    def planned_turns(self) -> int:
        """How many turns the plan is for."""
        return self.horizon or min(self.problem.horizon or DEFAULT_PLAN_TURNS, MAX_PLAN_TURNS)

    @property
    def _team(self) -> DecPomdp:
        return DecPomdp.from_problem(self.problem)

    @cached_property
    def plans(self) -> tuple[AgentPlan, ...]:
        """Those of all seats, the same for each."""
        return solve_joint_plan(self.problem, self.planned_turns).plans

    @cached_property
    def _own_plan(self) -> PlanLayer:
        """The own plan as one layer: actions `[T, K]`, and nodes of the next turn `[T, K, O]`."""
        return PlanLayer(
            *(_stack_layers(parts) for parts in zip(*self.plans[self.seat], strict=True))
        )

    @cached_property
    def _node_values(self) -> Reals:
        """What each action is worth at each node of each turn `[T, K, A]`."""
        budget = Budget("values of a joint plan", "try fewer turns", VALUES_WORK_LIMIT)
        return _stack_layers(
            PlanGraph(self._team, self.plans, budget).compute_action_values(self.seat)
        )

    def initial_memory(self, observation: Array) -> Memory:
        """The first node, and no turn is done."""
        rows = len(observation)
        return (np.zeros(rows, np.int64), np.zeros(rows, np.int64))

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """The node to which the observation leads, whatever was done."""
        node, done = memory
        then = self._own_plan.next_nodes[done, node, percept.observation]
        return (then, (done + 1) % self.planned_turns)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """What the plan has at the node."""
        node, done = memory
        return self._own_plan.actions[done, node]

    def action_values(self, memory: Memory) -> Reals:
        """What each action and the best next ones are worth while the others follow the plan."""
        node, done = memory
        return self._node_values[done, node]

    def adapt_to_game(self, turns: int | None, rivals: Sequence[str]) -> Self:
        """One that plans the whole game, if that is not too long."""
        return self if turns is None or turns > MAX_PLAN_TURNS else replace(self, horizon=turns)


@dataclass(frozen=True)
class OptimalJointPlan(JointPlan):
    """Follows the best of all joint plans; refuses where it is not known to be that."""

    @cached_property
    def plans(self) -> tuple[AgentPlan, ...]:
        """Those of all seats, which no others exceed."""
        found = solve_joint_plan(self.problem, self.planned_turns)
        if not found.is_optimal:
            told = f"the best plan found for {format_count(self.planned_turns, 'turn')} is worth {found.value:.6g}"
            raise BadPolicy(
                f"optimal: {told}, at most {found.upper_bound:.6g}; joint-plan plays it"
            )
        return found.plans


def _stack_layers(parts: Sequence[Array]) -> Array:
    """One array of those of each turn, of which some have more nodes than others."""
    most = max(map(len, parts))
    stacked = np.zeros((len(parts), most, *parts[0].shape[1:]), parts[0].dtype)
    for turn, part in enumerate(parts):
        stacked[turn, : len(part)] = part
    return stacked


@memoize
def solve_joint_plan(problem: Problem, turns: int) -> JointPlanSolution:
    """The best joint plan found for so many turns, the same for every seat."""
    return team_plan.find_joint_plan(DecPomdp.from_problem(problem), turns)


def can_plan_jointly(problem: Problem) -> bool:
    """Whether joint plans can be made: agents that see apart, paid alike, in some states."""
    alike = len(problem.agents) > 1 and problem.partially_observable and problem.shared_reward
    if not alike or not isinstance(problem.state_count, int) or not all(problem.action_counts):
        return False
    if not all(isinstance(known, Labels) for known in problem.observations):
        return False
    many, kinds = prod(problem.action_counts), prod(problem.observation_counts)
    if problem.state_count * many * (problem.state_count + 2 * kinds) > MAX_ARRAY_ELEMENTS:
        return False
    states = problem.enumerate_states()
    blind = bool((problem.initial_observations(states) == -1).all())  # before the first turn
    return blind and problem.legal_actions_mask(states) is None and _has_tables(problem)


def _has_tables(problem: Problem) -> bool:
    """Whether arrays hold the problem."""
    try:
        _ = isinstance(problem, Tabular) or tabulate(problem)
    except (BadParameter, BudgetExceeded):
        return False
    return True


def build_roster(problem: Problem, seat: int) -> Roster:
    """Who plays in such a team: all seats the same plan."""
    agents = {"joint-plan": JointPlan, "optimal": OptimalJointPlan}
    return Roster(agents, hint_provider="joint-plan", default_partner="joint-plan")
