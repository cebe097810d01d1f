"""Policies for collaborative predator-prey."""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from dmplay.budget import Budget
from dmplay.chance import Array, Bools, Categorical, Reals, mean
from dmplay.core import Memory, Percept, Problem, parameter
from dmplay.errors import BadParameter, BadPolicy
from dmplay.hexes import DIRECTIONS
from dmplay.policies._believing import Believing
from dmplay.policies._kept import kept
from dmplay.policies.kinds import Reactive, Seated
from dmplay.policies.roster import Roster
from dmplay.policies.team import JointPlan
from dmplay.policies.valued import Valued
from dmplay.problems.collaborative_predator_prey import SENSES, CollaborativePredatorPrey
from dmplay.solvers import plan_graphs, reactive_team, sparse
from dmplay.solvers.hunting_team import HuntingTeam
from dmplay.solvers.sparse import Overseen
from dmplay.solvers.team import Plan, Team
from dmplay.solvers.value_iteration import greedy

PLANNED = 4e8  # work for each joint node of a plan
LUCKY = 3  # the plans to begin with that come out best of four on the standard map


@dataclass(frozen=True)
class Sweep(Seated):
    """Goes to and fro: back after some turns of nothing, and back where a prey is or just was.

    Each seat begins in another direction. Of the rules that turn by a fixed angle at each of these
    three moments this one catches most on the standard map.
    """

    stroke: int = parameter(3, "turns in one direction while there is nothing", 1)

    def begin(self, observation: Array) -> Memory:
        """The direction, for how many turns it has been held, and whether a prey was near."""
        rows = len(observation)
        first = len(DIRECTIONS) * self.seat // len(self.problem.agents)
        return (np.full(rows, first), np.zeros(rows, np.int64), np.zeros(rows, bool))

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """Turns back, or goes on from what was really done."""
        held, near = memory[1] + 1, self._near(percept.observation)
        back = near | memory[2] | (held >= self.stroke)
        return ((percept.action + 3 * back) % 6, np.where(back, 0, held), near)

    def _near(self, observation: Array) -> Bools:
        """Whether a prey was sensed: the first half of the labels say so."""
        kinds = self.problem.observation_counts[self.seat]
        return np.asarray(observation < kinds // len(SENSES))

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The direction."""
        return memory[0]


@dataclass(frozen=True)
class _Tracking(Believing):
    """Believes what the problem itself makes of a turn, walker by walker."""

    problem: CollaborativePredatorPrey

    def _carried(self, before: Reals, action: int, observation: int) -> Reals:
        """How likely each row's next states are, whatever the others did and observed."""
        seats = range(len(self.problem.agents))
        actions = [action if seat == self.seat else None for seat in seats]
        observed = [observation if seat == self.seat else None for seat in seats]
        return self.problem.carry(before, actions, observed)


@dataclass(frozen=True)
class ChaseBelief(_Tracking):
    """Goes to the hex where it believes the prey most likely is."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The move that leaves the fewest steps to it, on average over where the seat may be."""
        hunt = self.problem
        size, walkers = len(hunt.hexes), hunt.walkers
        joint = memory[0].reshape(len(memory[0]), *(size,) * walkers)
        partners = tuple(1 + i for i in range(walkers - 1) if i != self.seat)
        own_and_prey = joint.sum(axis=partners)  # [B, H, H]
        prey = greedy(own_and_prey.sum(axis=1))
        own = own_and_prey[np.arange(len(prey)), :, prey]
        far = (own[:, :, None] * hunt.far[:, :, prey].transpose(2, 0, 1)).sum(axis=1)
        return greedy(-far)


@dataclass(frozen=True)
class Qmdp(_Tracking, Valued):
    """Acts as if the team were to see everything from the next turn on (section 21.1)."""

    def __post_init__(self) -> None:
        """Refuses hunts that it cannot plan."""
        super().__post_init__()
        if not _planned(self.problem):
            raise BadPolicy("qmdp: a hunt of more than two, or without discount, is not planned")

    @cached_property
    def _q(self) -> Reals:
        """Q* `[S, A]` of each move beside the partner's best one, everything seen."""
        shape = self.problem.action_counts
        others = tuple(1 + i for i in range(len(shape)) if i != self.seat)
        return np.asarray(overseen(self.problem).q.reshape(-1, *shape).max(axis=others))

    def values(self, memory: Memory) -> Reals:
        """The mean of Q* over the belief: no team that does not see can earn so much."""
        return mean(memory[0], self._q)


@dataclass(frozen=True)
class ByTheSense(Reactive):
    """Draws a direction from what it senses now, by the best rules found for two that forget."""

    problem: CollaborativePredatorPrey

    draws = 1  # for the direction

    def __post_init__(self) -> None:
        """Refuses teams for which it has no rules."""
        super().__post_init__()
        _check(self.problem, "reactive")

    @cached_property
    def _edges(self) -> Reals:
        """The rule, cumulative, by what is observed; the last before the first sense: nothing."""
        blind = replace(self.problem, sighted=False)  # it goes by what it senses alone
        each = self.problem.observation_counts[self.seat] // len(SENSES)
        senses = np.append(np.repeat(np.arange(len(SENSES)), each), SENSES.index("nothing"))
        return Categorical.of(np.asarray(_rules(blind)[self.seat])[senses]).cumulative

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """A direction drawn by the rule."""
        return Categorical(self._edges.take(memory[0], axis=0)).sample(u)


@dataclass(frozen=True)
class HuntPlan(JointPlan):
    """Follows a plan that two made together for all turns, each by what it alone senses.

    Their nodes are made better by turns from random ones, as far as the work goes.
    """

    problem: CollaborativePredatorPrey

    nodes: int = parameter(8, "of each predator's plan, a turn", 1, 12)

    def __post_init__(self) -> None:
        """Refuses teams for which it has no plan."""
        super().__post_init__()
        _check(self.problem, "joint-plan")
        if self.problem.sighted:
            raise BadPolicy("joint-plan: a predator that sees its hex does better with qmdp")

    @property
    def _team(self) -> Team:
        return HuntingTeam.hunting(self.problem)

    @cached_property
    def plans(self) -> tuple[Plan, ...]:
        """Those of both, the same for each."""
        return _mended(self.problem, self.turns, self.nodes)


def _check(problem: CollaborativePredatorPrey, agent: str) -> None:
    """Refuses teams for which nothing is found; raises BadPolicy."""
    try:
        reactive_team.check(problem)
    except BadParameter as error:
        raise BadPolicy(f"{agent}: {error}") from None


@kept
def _mended(problem: CollaborativePredatorPrey, turns: int, nodes: int) -> tuple[Plan, ...]:
    """The joint plan of a hunt, the same for both seats."""
    team = HuntingTeam.hunting(problem)
    budget = Budget("the plan of a hunt", "try fewer nodes or turns", PLANNED * nodes**2)
    return plan_graphs.improved(team, plan_graphs.drawn(team, turns, nodes, LUCKY), budget)


@lru_cache(maxsize=1)  # of 30 MB on the standard map
def overseen(problem: CollaborativePredatorPrey) -> Overseen:
    """What one planner who sees all knows, the same for every seat."""
    return sparse.overseen(problem)


@kept
def _rules(problem: CollaborativePredatorPrey) -> Reals:
    return reactive_team.team(problem).rules


def _planned(problem: Problem) -> bool:
    """Whether one planner who sees all is found."""
    return problem.discount < 1.0 and sparse.size(problem) <= sparse.MOST


def _adviser(hunt: CollaborativePredatorPrey) -> str:
    """The one that knows values, where it is found; a team that never senses anew does worse so."""
    if not _planned(hunt):
        return "chase-belief"
    blind = hunt.predators > 1 and np.ptp(hunt.observe(hunt.enumerated())) == 0
    return "sweep" if blind else "qmdp"


def roster(problem: CollaborativePredatorPrey, seat: int) -> Roster:
    """Who hunts together."""
    agents: dict[str, type[Seated]] = {
        "sweep": Sweep, "chase-belief": ChaseBelief, "qmdp": Qmdp, "reactive": ByTheSense,
    }  # fmt: skip
    if not problem.sighted:
        agents["joint-plan"] = HuntPlan
    planned = "joint-plan" if problem.predators == 2 and not problem.sighted else None
    return Roster(agents, adviser=_adviser(problem), partner="sweep", simulated=planned)
