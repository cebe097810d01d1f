"""Policies for collaborative predator-prey."""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from dmplay.budget import Budget
from dmplay.chance import Array, Bools, Categorical, Reals, weighted_sum
from dmplay.core import Memory, Percept, Problem, parameter
from dmplay.errors import BadParameter, BadPolicy
from dmplay.hexes import DIRECTIONS
from dmplay.policies._believing import BeliefPolicy
from dmplay.policies._kept import memoize
from dmplay.policies.kinds import ReactivePolicy, SeatPolicy
from dmplay.policies.roster import Roster
from dmplay.policies.team import JointPlan
from dmplay.policies.valued import GreedyBeliefPolicy
from dmplay.problems.collaborative_predator_prey import SENSE_LABELS, CollaborativePredatorPrey
from dmplay.solvers import plan_graphs, reactive_team, sparse
from dmplay.solvers.hunting_team import PredatorPreyDecPomdp
from dmplay.solvers.sparse import SparseMdpSolution
from dmplay.solvers.team import AgentPlan, DecPomdp
from dmplay.solvers.value_iteration import select_greedy_actions

PLAN_WORK_PER_JOINT_NODE = 4e8  # work for each joint node of a plan
PLAN_SEED = 3  # the plans to begin with that come out best of four on the standard map


@dataclass(frozen=True)
class Sweep(SeatPolicy):
    """Goes to and fro: back after some turns of nothing, and back where a prey is or just was.

    Each seat begins in another direction. Of the rules that turn by a fixed angle at each of these
    three moments this one catches most on the standard map.
    """

    stroke: int = parameter(3, "turns in one direction while there is nothing", 1)

    def initial_memory(self, observation: Array) -> Memory:
        """The direction, for how many turns it has been held, and whether a prey was near."""
        rows = len(observation)
        first = len(DIRECTIONS) * self.seat // len(self.problem.agents)
        return (np.full(rows, first), np.zeros(rows, np.int64), np.zeros(rows, bool))

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Turns back, or goes on from what was really done."""
        held, near = memory[1] + 1, self._is_prey_near(percept.observation)
        back = near | memory[2] | (held >= self.stroke)
        return ((percept.action + 3 * back) % 6, np.where(back, 0, held), near)

    def _is_prey_near(self, observation: Array) -> Bools:
        """Whether a prey was sensed: the first half of the labels say so."""
        kinds = self.problem.observation_counts[self.seat]
        return np.asarray(observation < kinds // len(SENSE_LABELS))

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The direction."""
        return memory[0]


@dataclass(frozen=True)
class _FactoredBeliefPolicy(BeliefPolicy):
    """Believes what the problem itself makes of a turn, walker by walker."""

    problem: CollaborativePredatorPrey

    def _joint_belief_update(self, before: Reals, action: int, observation: int) -> Reals:
        """How likely each row's next states are, whatever the others did and observed."""
        seats = range(len(self.problem.agents))
        actions = [action if seat == self.seat else None for seat in seats]
        observed = [observation if seat == self.seat else None for seat in seats]
        return self.problem.joint_belief_update(before, actions, observed)


@dataclass(frozen=True)
class ChaseBelief(_FactoredBeliefPolicy):
    """Goes to the hex where it believes the prey most likely is."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The move that leaves the fewest steps to it, on average over where the seat may be."""
        hunt = self.problem
        size, walkers = len(hunt.hexes), hunt.walker_count
        joint = memory[0].reshape(len(memory[0]), *(size,) * walkers)
        partners = tuple(1 + i for i in range(walkers - 1) if i != self.seat)
        own_and_prey = joint.sum(axis=partners)  # [B, H, H]
        prey = select_greedy_actions(own_and_prey.sum(axis=1))
        own = own_and_prey[np.arange(len(prey)), :, prey]
        far = (own[:, :, None] * hunt.move_distances[:, :, prey].transpose(2, 0, 1)).sum(axis=1)
        return select_greedy_actions(-far)


@dataclass(frozen=True)
class Qmdp(_FactoredBeliefPolicy, GreedyBeliefPolicy):
    """Acts as if the team were to see everything from the next turn on (section 21.1)."""

    def __post_init__(self) -> None:
        """Refuses hunts that it cannot plan."""
        super().__post_init__()
        if not _can_plan(self.problem):
            raise BadPolicy("qmdp: a hunt of more than two, or without discount, is not planned")

    @cached_property
    def _q(self) -> Reals:
        """Q* `[S, A]` of each move beside the partner's best one, everything seen."""
        shape = self.problem.action_counts
        others = tuple(1 + i for i in range(len(shape)) if i != self.seat)
        return np.asarray(solve_fully_observed(self.problem).q.reshape(-1, *shape).max(axis=others))

    def action_values(self, memory: Memory) -> Reals:
        """The mean of Q* over the belief: no team that does not see can earn so much."""
        return weighted_sum(memory[0], self._q)


@dataclass(frozen=True)
class SenseRulePolicy(ReactivePolicy):
    """Draws a direction from what it senses now, by the best rules found for two that forget."""

    problem: CollaborativePredatorPrey

    uniform_count = 1  # for the direction

    def __post_init__(self) -> None:
        """Refuses teams for which it has no rules."""
        super().__post_init__()
        _check_team(self.problem, "reactive")

    @cached_property
    def _cumulative_probabilities(self) -> Reals:
        """The rule, cumulative, by what is observed; the last before the first sense: nothing."""
        blind = replace(self.problem, sighted=False)  # it goes by what it senses alone
        each = self.problem.observation_counts[self.seat] // len(SENSE_LABELS)
        senses = np.append(
            np.repeat(np.arange(len(SENSE_LABELS)), each), SENSE_LABELS.index("nothing")
        )
        return Categorical.from_probabilities(
            np.asarray(_find_reactive_rules(blind)[self.seat])[senses]
        ).cumulative

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """A direction drawn by the rule."""
        return Categorical(self._cumulative_probabilities.take(memory[0], axis=0)).sample_events(u)


@dataclass(frozen=True)
class HuntJointPlan(JointPlan):
    """Follows a plan that two made together for all turns, each by what it alone senses.

    Their nodes are made better by turns from random ones, as far as the work goes.
    """

    problem: CollaborativePredatorPrey

    nodes: int = parameter(8, "of each predator's plan, a turn", 1, 12)

    def __post_init__(self) -> None:
        """Refuses teams for which it has no plan."""
        super().__post_init__()
        _check_team(self.problem, "joint-plan")
        if self.problem.sighted:
            raise BadPolicy("joint-plan: a predator that sees its hex does better with qmdp")

    @property
    def _team(self) -> DecPomdp:
        return PredatorPreyDecPomdp.from_predator_prey(self.problem)

    @cached_property
    def plans(self) -> tuple[AgentPlan, ...]:
        """Those of both, the same for each."""
        return _improve_plans(self.problem, self.planned_turns, self.nodes)


def _check_team(problem: CollaborativePredatorPrey, agent: str) -> None:
    """Refuses teams for which nothing is found; raises BadPolicy."""
    try:
        reactive_team.check_supported(problem)
    except BadParameter as error:
        raise BadPolicy(f"{agent}: {error}") from None


@memoize
def _improve_plans(
    problem: CollaborativePredatorPrey, turns: int, nodes: int
) -> tuple[AgentPlan, ...]:
    """The joint plan of a hunt, the same for both seats."""
    team = PredatorPreyDecPomdp.from_predator_prey(problem)
    budget = Budget(
        "the plan of a hunt", "try fewer nodes or turns", PLAN_WORK_PER_JOINT_NODE * nodes**2
    )
    return plan_graphs.improve_plans(
        team, plan_graphs.sample_random_plans(team, turns, nodes, PLAN_SEED), budget
    )


@lru_cache(maxsize=1)  # of 30 MB on the standard map
def solve_fully_observed(problem: CollaborativePredatorPrey) -> SparseMdpSolution:
    """What one planner who sees all knows, the same for every seat."""
    return sparse.solve_sparse_mdp(problem)


@memoize
def _find_reactive_rules(problem: CollaborativePredatorPrey) -> Reals:
    return reactive_team.optimize_reactive_team(problem).policies


def _can_plan(problem: Problem) -> bool:
    """Whether one planner who sees all is found."""
    return problem.discount < 1.0 and sparse.count_outcomes(problem) <= sparse.MAX_OUTCOMES


def _choose_hint_provider(hunt: CollaborativePredatorPrey) -> str:
    """The one that knows values, where it is found; a team that never senses anew does worse so."""
    if not _can_plan(hunt):
        return "chase-belief"
    blind = hunt.predators > 1 and np.ptp(hunt.observe(hunt.enumerate_states())) == 0
    return "sweep" if blind else "qmdp"


def build_roster(problem: CollaborativePredatorPrey, seat: int) -> Roster:
    """Who hunts together."""
    agents: dict[str, type[SeatPolicy]] = {
        "sweep": Sweep, "chase-belief": ChaseBelief, "qmdp": Qmdp, "reactive": SenseRulePolicy,
    }  # fmt: skip
    if not problem.sighted:
        agents["joint-plan"] = HuntJointPlan
    planned = "joint-plan" if problem.predators == 2 and not problem.sighted else None
    return Roster(
        agents,
        hint_provider=_choose_hint_provider(problem),
        default_partner="sweep",
        simulation_agent=planned,
    )
