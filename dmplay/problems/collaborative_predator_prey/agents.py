"""Policies for collaborative predator-prey."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, lru_cache, partial

import numpy as np

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import AdviceQuestion, PolicyMaker, ReactivePolicy, SeatPolicy
from dmplay.agents.belief_policy import BeliefPolicy, GreedyBeliefPolicy
from dmplay.agents.best_response_in_team import PartnerBeliefPolicy
from dmplay.agents.dec_pomdp import JointPlan
from dmplay.agents.horizon import MAX_HORIZON, HorizonPolicy
from dmplay.core import belief
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.best_actions import select_greedy_actions
from dmplay.core.chance import Categorical, weighted_sum
from dmplay.core.hexgrid import DIRECTIONS, format_hex
from dmplay.core.memoization import memoize
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory, Percept
from dmplay.core.problem import Problem
from dmplay.core.work_budget import Budget
from dmplay.errors import BadParameter, BadPolicy, DmplayError
from dmplay.solvers.decpomdp import joint_plan_improvement
from dmplay.solvers.decpomdp.dec_pomdp_model import AgentPlan, DecPomdp
from dmplay.solvers.mdp import sparse_mdp
from dmplay.solvers.mdp.sparse_mdp import SparseMdp

from . import reactive_team as reactive_predator_team
from .model import PredatorPreyDecPomdp
from .partner_plans import VALUE_DECIMALS, PairedHunt, can_find_plans, find_plans, find_upper_bounds
from .rules import SENSE_LABELS, CollaborativePredatorPrey

PLAN_WORK_PER_JOINT_NODE = 4e8  # for each joint node of a plan
MAX_PLANNED_STATES = 200_000  # states times turns up to which qmdp plans a game to its end
PLAN_SEED = 3  # gives the best plans of four seeds on the standard map
MIN_DIFFERENCE = 0.005  # probabilities that differ by less are called equal
LOOKAHEAD_TURNS = 2  # turns before the values of plans are used
# Differences of their values that may be errors: in 420 positions, the best action by plans found
# with about 30 times the work was worse by at most 0.295.
PLAN_RESOLUTION = 0.3


@dataclass(frozen=True)
class Sweep(SeatPolicy):
    """Walks to and fro, and also turns back on sensing a prey and one turn later.

    Each seat begins in another direction. Of the rules that turn by a fixed angle at each of these
    three moments, this one catches most on the standard map.
    """

    stroke: int = parameter(3, "turns in one direction while no prey is near", 1)

    def initial_memory(self, observation: Array) -> Memory:
        """Return the first direction, zero turns spent in it, and False for a near prey."""
        rows = len(observation)
        first = len(DIRECTIONS) * self.seat // len(self.problem.agents)
        return (np.full(rows, first), np.zeros(rows, np.int64), np.zeros(rows, bool))

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the next direction, the turns spent in it, and whether a prey is near.

        The direction is that of the action really taken. It is reversed if a prey is or just was
        near, and after `stroke` turns.
        """
        # the first of the senses is that of a prey which is near
        labels_per_sense = self.problem.observation_counts[self.seat] // len(SENSE_LABELS)
        turn_count, is_near = memory[1] + 1, percept.observation < labels_per_sense
        reverses = is_near | memory[2] | (turn_count >= self.stroke)
        return ((percept.action + 3 * reverses) % 6, np.where(reverses, 0, turn_count), is_near)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the direction."""
        return memory[0]


@dataclass(frozen=True)
class _FactoredBeliefPolicy(BeliefPolicy):
    """A belief policy that uses the problem's own belief update, walker by walker."""

    problem: CollaborativePredatorPrey

    def _joint_belief_update(self, beliefs: Reals, action: int, observation: int) -> Reals:
        """Return the probabilities of this observation and each next state.

        The actions and observations of the others are unknown.
        """
        seats = range(len(self.problem.agents))
        actions = [action if seat == self.seat else None for seat in seats]
        observations = [observation if seat == self.seat else None for seat in seats]
        return self.problem.joint_belief_update(beliefs, actions, observations)


@dataclass(frozen=True)
class ChaseBelief(_FactoredBeliefPolicy):
    """Goes to the hex in which the prey most likely is, according to its belief."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the move with the least expected distance to the most likely prey hex."""
        hunt_problem = self.problem
        size, walkers = len(hunt_problem.hexes), hunt_problem.walker_count
        joint = memory[0].reshape(len(memory[0]), *(size,) * walkers)
        partners = tuple(1 + i for i in range(walkers - 1) if i != self.seat)
        own_and_prey = joint.sum(axis=partners)  # [B, H, H]
        prey = select_greedy_actions(own_and_prey.sum(axis=1))
        own_belief = own_and_prey[np.arange(len(prey)), :, prey]
        distances = hunt_problem.move_distances[:, :, prey].transpose(2, 0, 1)
        return select_greedy_actions(-(own_belief[:, :, None] * distances).sum(axis=1))


@dataclass(frozen=True)
class Qmdp(HorizonPolicy, _FactoredBeliefPolicy, GreedyBeliefPolicy):
    """Takes the action that would be best if it saw all positions from the next turn on (QMDP).

    Partners are assumed to see all positions now. It plans for an infinite horizon, or for
    `horizon` turns.
    """

    problem: CollaborativePredatorPrey
    policy_maker: PolicyMaker | None = field(default=None, compare=False, repr=False)
    to: str = parameter("", "the only partner, an agent; if empty, partners see all positions")

    def __post_init__(self) -> None:
        """Raise BadPolicy for hunts that it cannot plan."""
        super().__post_init__()
        if not can_solve_mdp(self.problem):
            raise BadPolicy("qmdp: the hunt is too large, or its discount is 1; use chase-belief")

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return upper bounds, at a belief as if partners moved at random."""
        are_random = {*question.actual_opponents} == {"random"}
        basis = super().values_basis(question)
        return basis._replace(
            accuracy=Accuracy.UPPER_BOUND,
            assumed_players="" if are_random else "belief as if partners moved at random",
            method="qmdp, as if partners see all positions now, and you see them next turn",
        )

    def can_plan_turns(self, turns: int) -> bool:
        """Return whether the values of that many turns can be computed and stored in time."""
        return self.problem.state_count * turns <= MAX_PLANNED_STATES

    def with_policy_maker(self, policy_maker: PolicyMaker) -> "Qmdp":
        """Return this policy, or that for the partner named by `to`, which `policy_maker` makes."""
        policy = replace(self, policy_maker=policy_maker)
        return policy._with_partner(self.to) if self.to else policy

    def adapt_to_game(self, question: AdviceQuestion) -> "Qmdp":
        """Return a policy for the turns left, and for the rule of a single partner if known."""
        policy = super().adapt_to_game(question)
        if len(question.opponents) != 1 or self.policy_maker is None:
            return policy
        try:
            partnered = policy._with_partner(*question.opponents)
        except DmplayError:
            return policy
        if not question.turn_limit or partnered.horizon != question.turn_limit:
            return partnered
        facts = {item.name: getattr(partnered, item.name) for item in fields(partnered)}
        try:
            return PlansWithPartner(**facts).with_policy_maker(self.policy_maker)
        except DmplayError:
            return partnered

    def _with_partner(self, name: str) -> "QmdpWithPartner":
        """Return the policy beside an agent; raise an error if its rule is not known."""
        policy = QmdpWithPartner(
            self.problem, self.seat, horizon=self.horizon, policy_maker=self.policy_maker, to=name
        )
        _ = policy.partner_machine
        return policy

    @cached_property
    def _q_by_turns(self) -> Reals:
        """Q `[T, S, A]` of each move with the partner's best one, if all is observed."""
        others = tuple(2 + i for i in range(len(self.problem.agents)) if i != self.seat)
        return np.asarray(self._joint_q_by_turns.max(axis=others))

    @cached_property
    def _joint_q_by_turns(self) -> Reals:
        """Q `[T, S, A, ...]` of each joint move, if all is observed.

        The first axis has 1 to `horizon` turns left, or one entry without an end.
        """
        hunt = self.problem
        if self.horizon:
            model = build_fully_observed_mdp(hunt)
            q = sparse_mdp.compute_finite_horizon_q(model, hunt.discount, self.horizon)
        else:
            q = solve_fully_observed(hunt)[None]
        return np.asarray(q.reshape(*q.shape[:2], *hunt.action_counts))

    def values_with_turns_left(self, info_state: Reals, turns_left: int | None) -> Reals:
        """Return the mean of Q over beliefs `[B, S]`, an upper bound for teams that do not see all.

        Without an end there is one table of Q.
        """
        return weighted_sum(info_state, self._q_by_turns[(turns_left or 1) - 1])


@dataclass(frozen=True)
class QmdpWithPartner(Qmdp, PartnerBeliefPolicy):
    """QMDP beside a partner whose rule is known, for advice.

    The partner takes its action of this turn; from the next turn on, one planner who sees all
    positions moves the whole team.
    """

    max_belief_size = 1_000_000

    current_belief = PartnerBeliefPolicy.current_belief
    with_policy_maker = PartnerBeliefPolicy.with_policy_maker

    @cached_property
    def paired_hunt(self) -> PairedHunt:
        """The hunt as a problem of one planner."""
        return PairedHunt.from_machine(self.problem, self.seat, self.partner_machine)

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return upper bounds beside the partner."""
        method = "qmdp, as if you see all positions and move both from the next turn on"
        basis = super().values_basis(question)._replace(method=method)
        return basis._replace(assumed_players=self.describe_partner(question.actual_opponents))

    def weigh_partner_actions(self, memory: Memory) -> Reals:
        """Return the probability `[B, A, S]` of each action of the partner with each state."""
        chances, nodes = self.partner_machine.probabilities, self.split_nodes(memory[0])
        return np.asarray(np.einsum("na,bns->bas", chances, nodes))

    def predict_nodes(self, nodes: Reals, action: int) -> Reals:
        """Return the probabilities `[N, S]` after an action, before anything is observed."""
        after = np.zeros_like(nodes)
        partner_observations = self.problem.observation_table[:, 1 - self.seat]
        is_possible = nodes.any(axis=1)
        for partner_action, chances in enumerate(self.partner_machine.probabilities.T):
            rows = np.flatnonzero((chances > 0.0) & is_possible)
            if not len(rows):
                continue
            actions = (action, partner_action)[:: 1 - 2 * self.seat]
            before = nodes[rows] * chances[rows, None]
            moved = self.problem.joint_belief_update(before, actions, (None, None))
            for observation in range(self.problem.observation_counts[1 - self.seat]):
                next_nodes = self.partner_machine.next_nodes[rows, partner_action, observation]
                np.add.at(after, next_nodes, moved * (partner_observations == observation))
        return after

    def _joint_belief_update(self, beliefs: Reals, action: int, observation: int) -> Reals:
        """Return the probabilities of this observation and each next node and state."""
        is_seen = self.problem.observation_table[:, self.seat] == observation
        after = [self.predict_nodes(nodes, action) for nodes in self.split_nodes(beliefs)]
        return np.asarray((np.array(after) * is_seen).reshape(beliefs.shape))

    def describe_model(self, memory: Memory) -> str:
        """Return the likeliest hexes of the prey and the seat; '' if all are as likely."""
        hunt = self.problem
        joint = self.state_belief(memory)[0].reshape((len(hunt.hexes),) * hunt.walker_count)
        texts = []
        for walker, name in ((hunt.predators, "prey likeliest"), (self.seat, "you")):
            chances = joint.sum(axis=tuple(i for i in range(joint.ndim) if i != walker))
            texts.append(f"{name} at {format_hex(hunt.hexes[chances.argmax()])}")
            if np.ptp(chances) < MIN_DIFFERENCE:
                return ""
        return ", ".join(texts)

    def forecast_observations(self, memory: Memory, action: int) -> tuple[Reals, Reals]:
        """Return the probability `[O]` of each observation, and the belief `[O, S]` after it."""
        after = self.predict_nodes(self.split_nodes(memory[0])[0], action).sum(axis=0)
        observations = np.arange(self.problem.observation_counts[self.seat])[:, None]
        is_seen = self.problem.observation_table[:, self.seat] == observations
        posterior = belief.apply_bayes_rule(after * is_seen)
        return posterior.likelihood, posterior.belief

    def expected_reward(self, memory: Memory, action: int) -> float:
        """Return the expected reward of a turn, which no action changes."""
        return float(memory[0][0] @ self.paired_hunt.rewards)

    def action_values(self, memory: Memory) -> Reals:
        """Return the mean of Q over states and the partner's actions: an upper bound."""
        weights = self.weigh_partner_actions(memory)
        turns = self.turns_left(memory) if self.horizon else np.ones(len(weights), int)
        q = self._joint_q_by_turns if self.seat == 0 else self._joint_q_by_turns.swapaxes(2, 3)
        pairs = zip(weights, q[turns - 1], strict=True)
        return np.array([np.einsum("ps,sap->a", *pair) for pair in pairs])


@dataclass(frozen=True)
class PlansWithPartner(QmdpWithPartner):
    """Takes the first action of the best plan found beside a partner whose rule is known."""

    to: str = parameter("random", "the only partner: an agent or an action")
    horizon: int = parameter(50, "turns of a game; then it plans again", 1, MAX_HORIZON)

    repeats_plan = True

    def __post_init__(self) -> None:
        """Raise BadPolicy for hunts of another number of predators, or that see their hexes."""
        super().__post_init__()
        if len(self.problem.agents) != 2 or self.problem.sighted:
            raise BadPolicy("point-based: needs two predators that do not see their hexes")

    def with_policy_maker(self, policy_maker: PolicyMaker) -> "PlansWithPartner":
        """Return this policy with a function that makes the partner named by `to`."""
        policy = super().with_policy_maker(policy_maker)
        assert isinstance(policy, PlansWithPartner)
        if not can_find_plans(policy.paired_hunt, policy.horizon):
            raise BadPolicy("point-based: too many hexes, turns or nodes of the partner; use qmdp")
        return policy

    def adapt_to_game(self, question: AdviceQuestion) -> "PlansWithPartner":
        """Return a policy for the turns left, and for the rule of a single partner if known."""
        policy = super().adapt_to_game(question)
        return policy if isinstance(policy, PlansWithPartner) else self

    def choice_probabilities(self, memory: Memory) -> None:
        """Return None, as its rule has too many nodes for the plans of a partner."""
        return

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return the values of plans, which judge only actions that are clearly worse."""
        basis = super().values_basis(question)
        return basis._replace(
            accuracy=Accuracy.ESTIMATED, method="point-based plans", resolution=PLAN_RESOLUTION
        )

    def action_values(self, memory: Memory) -> Reals:
        """Return the values `[B, A]` of the best plans found that begin with each action."""
        return HorizonPolicy.action_values(self, memory)

    def values_with_turns_left(self, info_state: Reals, turns_left: int | None) -> Reals:
        """Return the values `[B, A]` of plans that are looked up after two turns."""
        plans = find_plans(self.paired_hunt, self.horizon)
        return self._look_ahead(info_state, turns_left, plans, LOOKAHEAD_TURNS)

    def _look_ahead(
        self, beliefs: Reals, turns_left: int | None, vectors: Sequence[Reals], depth: int
    ) -> Reals:
        """Return the values `[B, A]` by vectors after `depth` turns, each row computed alone."""
        assert turns_left is not None
        find = partial(self.paired_hunt.look_ahead, vectors=vectors, depth=depth)
        q = np.concatenate([find(belief[None], turns_left) for belief in beliefs])
        return np.round(q, VALUE_DECIMALS)

    def value_bounds(self, memory: Memory, actions: Array) -> tuple[Reals, Reals]:
        """Return the value of a plan, and the fast informed bound, of an action of each row."""
        key = b"".join(part.tobytes() for part in memory)
        if key not in self._last_bounds:
            self._last_bounds.clear()  # The actions of a turn are asked for one after another.
            bounds = [
                find(self.paired_hunt, self.horizon) for find in (find_plans, find_upper_bounds)
            ]
            self._last_bounds[key] = [
                self.apply_by_turns_left(partial(self._look_ahead, vectors=item, depth=1), memory)
                for item in bounds
            ]
        low, high = (q[np.arange(len(actions)), actions] for q in self._last_bounds[key])
        return low, np.maximum(low, high)

    @cached_property
    def _last_bounds(self) -> dict[bytes, list[Reals]]:
        """The bounds `[B, A]` of the last memory."""
        return {}


@dataclass(frozen=True)
class SenseRulePolicy(ReactivePolicy):
    """Samples a direction for its current observation, by the best memoryless rules found."""

    problem: CollaborativePredatorPrey

    uniform_count = 1  # for the direction

    def __post_init__(self) -> None:
        """Raise BadPolicy for teams without such rules."""
        super().__post_init__()
        _check_team(self.problem, "reactive")

    @cached_property
    def _cumulative_probabilities(self) -> Reals:
        """The cumulative rule by observation; the last row, of no prey, is for the first turn."""
        unsighted = replace(self.problem, sighted=False)  # The rule depends only on what is sensed.
        labels_per_sense = self.problem.observation_counts[self.seat] // len(SENSE_LABELS)
        senses = np.repeat(np.arange(len(SENSE_LABELS)), labels_per_sense)
        senses = np.append(senses, SENSE_LABELS.index("nothing"))
        rules = _find_reactive_rules(unsighted)[self.seat]
        return Categorical.from_probabilities(rules[senses]).cumulative

    def choice_probabilities(self, memory: Memory) -> Reals:
        """Return the rule's probabilities `[B, A]`."""
        rows = self._cumulative_probabilities.take(memory[0], axis=0)
        return np.asarray(Categorical(rows).probabilities())

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return directions sampled from the rule."""
        return Categorical(self._cumulative_probabilities.take(memory[0], axis=0)).sample_events(u)


@dataclass(frozen=True)
class HuntJointPlan(JointPlan):
    """Follows a joint plan of two predators, each by its own observations.

    The nodes of the two plans start at random and are improved in turn, as far as the work allows.
    """

    problem: CollaborativePredatorPrey

    nodes: int = parameter(8, "nodes per turn in each predator's plan", 1, 12)

    def __post_init__(self) -> None:
        """Raise BadPolicy for teams without such a plan."""
        super().__post_init__()
        _check_team(self.problem, "joint-plan")
        if self.problem.sighted:
            raise BadPolicy(
                "joint-plan: not for predators that see their hex; use qmdp, which is better"
            )

    @property
    def _team(self) -> DecPomdp:
        """The hunt as a Dec-POMDP."""
        return PredatorPreyDecPomdp.from_predator_prey(self.problem)

    @cached_property
    def plans(self) -> tuple[AgentPlan, ...]:
        """The plans of both agents, the same for each seat."""
        return _improve_plans(self.problem, self.planned_turns, self.nodes)


def _check_team(problem: CollaborativePredatorPrey, agent: str) -> None:
    """Raise BadPolicy for teams without rules or plans, with the name of the agent."""
    try:
        reactive_predator_team.check_supported(problem)
    except BadParameter as error:
        raise BadPolicy(f"{agent}: {error}") from None


@memoize
def _improve_plans(
    problem: CollaborativePredatorPrey, turns: int, nodes: int
) -> tuple[AgentPlan, ...]:
    """Return the improved joint plan of a hunt, the same for both seats."""
    team = PredatorPreyDecPomdp.from_predator_prey(problem)
    work = PLAN_WORK_PER_JOINT_NODE * nodes**2
    budget = Budget("joint plan of the hunt", "try fewer nodes or turns", work)
    plans = joint_plan_improvement.sample_random_plans(team, turns, nodes, PLAN_SEED)
    return joint_plan_improvement.improve_plans(team, plans, budget)


@lru_cache(maxsize=1)  # 30 MB on the standard map
def build_fully_observed_mdp(problem: CollaborativePredatorPrey) -> SparseMdp:
    """Return the outcomes for one planner that sees all, cached for every seat."""
    return sparse_mdp.build_sparse_mdp(problem)


@lru_cache(maxsize=1)
def solve_fully_observed(problem: CollaborativePredatorPrey) -> Reals:
    """Return Q* `[S, A]` of one planner that sees all, cached for every seat."""
    return sparse_mdp.compute_optimal_q(build_fully_observed_mdp(problem), problem.discount)


@memoize
def _find_reactive_rules(problem: CollaborativePredatorPrey) -> Reals:
    """Return the best rules found for a team without memory."""
    return reactive_predator_team.optimize_reactive_team(problem).policies


def can_solve_mdp(problem: Problem) -> bool:
    """Return whether a planner that sees all is computed for a problem."""
    return problem.discount < 1.0 and sparse_mdp.count_outcomes(problem) <= sparse_mdp.MAX_OUTCOMES


def _choose_hint_provider(hunt: CollaborativePredatorPrey) -> str:
    """Return the name of the agent that gives hints.

    It is qmdp, or sweep for a team whose senses never vary, or chase-belief if qmdp is not
    computed.
    """
    if not can_solve_mdp(hunt):
        return "chase-belief"
    never_varies = hunt.predators > 1 and np.ptp(hunt.observation_table) == 0
    return "sweep" if never_varies else "qmdp"


def list_hunt_agents(problem: CollaborativePredatorPrey, seat: int) -> Roster:
    """Return the agents for a hunt in a team."""
    agents: dict[str, type[SeatPolicy]] = {
        "sweep": Sweep, "chase-belief": ChaseBelief, "qmdp": Qmdp, "reactive": SenseRulePolicy,
    }  # fmt: skip
    if not problem.sighted:
        agents["joint-plan"] = HuntJointPlan
    if problem.predators == 2 and not problem.sighted and can_solve_mdp(problem):
        agents["point-based"] = PlansWithPartner
    return Roster(
        agents,
        hint_provider=_choose_hint_provider(problem),
        default_partner="sweep",
        batch_agent="qmdp" if can_solve_mdp(problem) else None,
        rule_of_thumb="sweep",
        simulation_agent="joint-plan" if problem.predators == 2 and not problem.sighted else None,
        # The general agent `optimal` refuses small hunts whose joint plan is not proven optimal.
        adds_general_agents=problem.predators == 1,
    )


AGENTS = list_hunt_agents
