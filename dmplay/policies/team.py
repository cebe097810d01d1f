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
from dmplay.describe import counted
from dmplay.errors import BadParameter, BadPolicy, TooMuch
from dmplay.policies._kept import kept
from dmplay.policies.kinds import Seated
from dmplay.policies.roster import Roster
from dmplay.solvers import team_plan
from dmplay.solvers.plan_graphs import PlanGraph
from dmplay.solvers.team import Layer, Plan, Team
from dmplay.solvers.team_plan import TeamPlan
from dmplay.tabular import Tabular, tabulate

FEW = 4  # turns of a plan where the game has no end of its own
LONGEST = 100  # turns that are planned
LARGEST = 2**25  # numbers of the arrays that a joint plan is made with
VALUED = 1e10  # work for the values of a plan


@dataclass(frozen=True)
class JointPlan(Seated):
    """Follows the best joint plan found for the team, as if all of the team do.

    A plan is for a number of turns; when they are over it begins again.
    """

    whole_game = True

    horizon: int = parameter(0, "turns planned; 0 for the game's own, or 4", 0, LONGEST)

    @property
    def turns(self) -> int:
        """How many turns the plan is for."""
        return self.horizon or min(self.problem.horizon or FEW, LONGEST)

    @property
    def _team(self) -> Team:
        return Team.of(self.problem)

    @cached_property
    def plans(self) -> tuple[Plan, ...]:
        """Those of all seats, the same for each."""
        return planned(self.problem, self.turns).plans

    @cached_property
    def _own(self) -> Layer:
        """The own plan as one layer: actions `[T, K]`, and nodes of the next turn `[T, K, O]`."""
        return Layer(*(_stacked(parts) for parts in zip(*self.plans[self.seat], strict=True)))

    @cached_property
    def _worth(self) -> Reals:
        """What each action is worth at each node of each turn `[T, K, A]`."""
        budget = Budget("values of a joint plan", "try fewer turns", VALUED)
        return _stacked(PlanGraph(self._team, self.plans, budget).action_values(self.seat))

    def begin(self, observation: Array) -> Memory:
        """The first node, and no turn is done."""
        rows = len(observation)
        return (np.zeros(rows, np.int64), np.zeros(rows, np.int64))

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """The node to which the observation leads, whatever was done."""
        node, done = memory
        then = self._own.then[done, node, percept.observation]
        return (then, (done + 1) % self.turns)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """What the plan has at the node."""
        node, done = memory
        return self._own.actions[done, node]

    def values(self, memory: Memory) -> Reals:
        """What each action and the best next ones are worth while the others follow the plan."""
        node, done = memory
        return self._worth[done, node]

    def in_game(self, turns: int | None, rivals: Sequence[str]) -> Self:
        """One that plans the whole game, if that is not too long."""
        return self if turns is None or turns > LONGEST else replace(self, horizon=turns)


@dataclass(frozen=True)
class OptimalPlan(JointPlan):
    """Follows the best of all joint plans; refuses where it is not known to be that."""

    @cached_property
    def plans(self) -> tuple[Plan, ...]:
        """Those of all seats, which no others exceed."""
        found = planned(self.problem, self.turns)
        if not found.exact:
            told = (
                f"the best plan found for {counted(self.turns, 'turn')} is worth {found.value:.6g}"
            )
            raise BadPolicy(f"optimal: {told}, at most {found.bound:.6g}; joint-plan plays it")
        return found.plans


def _stacked(parts: Sequence[Array]) -> Array:
    """One array of those of each turn, of which some have more nodes than others."""
    most = max(map(len, parts))
    stacked = np.zeros((len(parts), most, *parts[0].shape[1:]), parts[0].dtype)
    for turn, part in enumerate(parts):
        stacked[turn, : len(part)] = part
    return stacked


@kept
def planned(problem: Problem, turns: int) -> TeamPlan:
    """The best joint plan found for so many turns, the same for every seat."""
    return team_plan.planned(Team.of(problem), turns)


def fits(problem: Problem) -> bool:
    """Whether joint plans can be made: agents that see apart, paid alike, in some states."""
    alike = len(problem.agents) > 1 and problem.hidden and problem.shared_reward
    if not alike or not isinstance(problem.states, int) or not all(problem.action_counts):
        return False
    if not all(isinstance(known, Labels) for known in problem.observations):
        return False
    many, kinds = prod(problem.action_counts), prod(problem.observation_counts)
    if problem.states * many * (problem.states + 2 * kinds) > LARGEST:
        return False
    states = problem.enumerated()
    blind = bool((problem.first(states) == -1).all())  # before the first turn
    return blind and problem.legal(states) is None and _listed(problem)


def _listed(problem: Problem) -> bool:
    """Whether arrays hold the problem."""
    try:
        _ = isinstance(problem, Tabular) or tabulate(problem)
    except (BadParameter, TooMuch):
        return False
    return True


def roster(problem: Problem, seat: int) -> Roster:
    """Who plays in such a team: all seats the same plan."""
    agents = {"joint-plan": JointPlan, "optimal": OptimalPlan}
    return Roster(agents, adviser="joint-plan", partner="joint-plan")
