"""Policies for two caregivers: the single caregiver's rule, best responses and joint plans."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from typing import Self

import numpy as np

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import (
    EXACT_VALUES,
    AdviceQuestion,
    ConstantPolicy,
    GreedyPolicy,
    PolicyLookup,
    SeatPolicy,
)
from dmplay.agents.belief_policy import apply_by_group
from dmplay.agents.partner_machine import PartnerMachine, build_partner_machine
from dmplay.agents.random_agent import Random
from dmplay.agents.single_agent_planning import MAX_ALPHA_VECTOR_TURNS
from dmplay.agents.turns_left import TurnsLeftPolicy
from dmplay.core import belief
from dmplay.core.arrays import Array, Reals
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory, Percept
from dmplay.core.problem import Problem, enumerate_outcomes
from dmplay.core.tabular import Tables
from dmplay.errors import BadPolicy, DmplayError
from dmplay.problems.crying_baby.agents import FeedWhenCrying
from dmplay.problems.multicaregiver_crying_baby.rules import MulticaregiverCryingBaby
from dmplay.problems.multicaregiver_crying_baby.same_observation_planning import (
    PartnerBeliefFilter,
    SharedObservationPlan,
)
from dmplay.solvers.pomdp import exact_pomdp
from dmplay.solvers.pomdp.exact_pomdp import AlphaVectorStage

ACTIONS = MulticaregiverCryingBaby.actions[0]
N_OBSERVATIONS = 2  # crying and quiet
DEFAULT_PARTNER = "feed-when-crying"
MAX_PARTNER_NODES = 60  # maximum number of memories of a partner that is planned with


@dataclass(frozen=True)
class _PartnerModelPolicy(SeatPolicy):
    """A policy whose memory is its belief if the partner always plays `to`.

    Both caregivers observe the same, so a partner's rule is known from its own actions and from
    what this seat observes. The problem becomes a POMDP whose state is the baby's state and the
    node of the partner.
    """

    to: str = parameter(DEFAULT_PARTNER, "assumed partner: an agent or an action")
    policy_lookup: PolicyLookup | None = field(default=None, compare=False, repr=False)

    def with_policy_lookup(self, policy_lookup: PolicyLookup) -> Self:
        """Return this policy with a function that makes the partner named by `to`."""
        policy = replace(self, policy_lookup=policy_lookup)
        if self.to not in (DEFAULT_PARTNER, "random", *ACTIONS):
            _ = policy._partner  # raises an error for an unknown name
        return policy

    @cached_property
    def pomdp_tables(self) -> Tables:
        """The arrays of that POMDP; its state is N times the baby's state plus the node."""
        return self._build_tables(self._partner.probabilities)

    @property
    def _partner_policy(self) -> SeatPolicy:
        """The partner's policy; raises BadPolicy if there is none of this name."""
        seat = 1 - self.seat
        if self.to == DEFAULT_PARTNER:
            return FeedWhenCrying(self.problem, seat)
        if self.to == "random":
            return Random(self.problem, seat)
        if self.to in ACTIONS:
            return _Constant(self.problem, seat, ACTIONS.index(self.to))
        policy = self.policy_lookup(seat, self.to) if self.policy_lookup else None
        if policy is None:
            raise BadPolicy(f"best-response: no rule {self.to!r} of the partner")
        return policy

    @cached_property
    def _partner(self) -> PartnerMachine:
        """The partner's machine; raises BadPolicy if it is not known or has too many nodes."""
        return build_partner_machine(
            self.to, self._partner_policy, MAX_PARTNER_NODES, splits_observations=True
        )

    def _build_tables(self, action_probabilities: Reals) -> Tables:
        """Return the POMDP's arrays if the partner's actions have probabilities `[N, A]`."""
        partner, action_count, state_count = self._partner, len(ACTIONS), 2
        node_count = len(partner.observations)
        transition = np.zeros((state_count, node_count, action_count, state_count, node_count))
        rewards = np.zeros((state_count, node_count, action_count))
        for action, partner_action in product(range(action_count), repeat=2):
            joint_action = (action, partner_action) if self.seat == 0 else (partner_action, action)
            p, outcome = enumerate_outcomes(
                self.problem, np.arange(state_count), np.tile(joint_action, (state_count, 1))
            )
            weights = action_probabilities[:, partner_action]
            rewards[:, :, action] += np.outer(
                (p * outcome.rewards[:, :, self.seat]).sum(axis=1), weights
            )
            for s, k in np.ndindex(p.shape):
                heard = outcome.observations[s, k, self.seat]
                after = partner.next_nodes[:, partner_action, heard]
                transition[s, np.arange(node_count), action, outcome.state[s, k], after] += (
                    p[s, k] * weights
                )
        size = state_count * node_count
        observation_model = np.eye(N_OBSERVATIONS)[
            np.maximum(np.tile(partner.observations, state_count), 0)
        ]
        return Tables(
            transition.reshape(size, action_count, size),
            rewards.reshape(size, action_count, 1),
            np.repeat(observation_model[None], action_count, axis=0),
        )

    @cached_property
    def _belief_filter(self) -> PartnerBeliefFilter:
        """The belief filter by own action and observation, with a random partner as its
        fallback.
        """
        action_count = len(ACTIONS)
        random_tables = self._build_tables(
            np.full((len(self._partner.observations), action_count), 1 / action_count)
        )
        return PartnerBeliefFilter.from_arrays(
            *(
                tables.joint_probabilities.transpose(1, 2, 0, 3)
                for tables in (self.pomdp_tables, random_tables)
            )
        )

    def initial_memory(self, observation: Array) -> Memory:
        """Return the belief before the first turn, with nothing observed yet."""
        node_count = len(self._partner.observations)
        b = np.zeros((len(observation), 2 * node_count))
        b[:, ::node_count] = belief.initial_belief(self.problem)
        return (b,)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the belief after a turn, by Bayes' rule.

        If the modelled partner rules out the observation, a random partner is assumed instead.
        """
        return (
            self._belief_filter.update_beliefs(memory[0], (percept.action, percept.observation)),
        )


@dataclass(frozen=True)
class BestResponse(TurnsLeftPolicy, GreedyPolicy, _PartnerModelPolicy):
    """Plays a best response to the partner, if it plays as assumed.

    The partner is assumed to play `to` (an agent or an action) always. It plans for an infinite
    horizon or for `horizon` turns, in a POMDP that includes the partner. The values are against
    that partner.
    """

    values_name = EXACT_VALUES
    has_opponent_model = True
    plays_with = "with"

    def __post_init__(self) -> None:
        """Raise BadPolicy for an infinite horizon without a discount."""
        super().__post_init__()
        if self.problem.discount >= 1.0 and not self.horizon:
            raise BadPolicy("an infinite horizon needs a discount below 1; set horizon=TURNS")

    def describe_assumed_players(self, opponents: Sequence[str]) -> str:
        """Return the model of the partner, if it is not how this partner plays."""
        if (self.to,) == tuple(opponents):
            return ""
        is_random = self.to == "random"
        return "assuming a random partner" if is_random else f"if the partner plays {self.to}"

    def describe_model(self, memory: Memory) -> str:
        """Return the belief with a partner that is not random, which differs from the board's."""
        if self.to == "random":
            return ""
        (b,) = memory[0].reshape(1, 2, -1).sum(axis=2)
        names = map(self.problem.format_state, self.problem.enumerate_states())
        return f"belief {', '.join(f'{name} {p:.3f}' for name, p in zip(names, b, strict=True))}"

    def forecast_observations(self, memory: Memory, action: int) -> tuple[Reals, Reals]:
        """Return the probability `[O]` of each observation, and the belief `[O, S]` after it."""
        tables = self.pomdp_tables
        joint = (memory[0][0] @ tables.transition[:, action]).reshape(2, -1)
        heard = self._partner.observations == np.arange(N_OBSERVATIONS)[:, None]
        by_state = heard @ joint.T  # [O, S]
        posterior = belief.apply_bayes_rule(by_state)
        return posterior.likelihood, posterior.belief

    def expected_reward(self, memory: Memory, action: int) -> float:
        """Return the expected reward of an action against that partner."""
        return float(memory[0][0] @ self.pomdp_tables.rewards[:, action, 0])

    @cached_property
    def _alpha_vectors(self) -> AlphaVectorStage:
        """The alpha vectors of the POMDP for an infinite horizon."""
        return exact_pomdp.solve_infinite_horizon(self.pomdp_tables, self.problem.discount)

    @cached_property
    def _stages(self) -> list[AlphaVectorStage]:
        """The alpha vectors of the POMDP with 1 to `horizon` turns left."""
        return exact_pomdp.solve_finite_horizon(
            self.pomdp_tables, self.problem.discount, self.horizon
        )

    def action_values(self, memory: Memory) -> Reals:
        """Return Q of each action against that partner, with the turns left if there is a
        horizon.
        """
        if not self.horizon:
            return exact_pomdp.compute_action_values(self._alpha_vectors, memory[0])
        return apply_by_group(memory[0], self.turns_left(memory), self._finite_horizon_values)

    def _finite_horizon_values(self, b: Reals, turns_left: int) -> Reals:
        """Return Q `[B, A]` of beliefs `[B, S]` with `turns_left` rewards to come."""
        return exact_pomdp.compute_action_values(self._stages[turns_left - 1], b)

    def can_plan_turns(self, turns: int) -> bool:
        """Return whether the alpha vectors of that many turns can be computed in time."""
        return turns <= MAX_ALPHA_VECTOR_TURNS or self.problem.discount >= 1.0

    def adapt_to_game(self, question: AdviceQuestion) -> Self:
        """Return the best response for the turns left, to the partner of the game.

        A partner that cannot be planned with counts as random.
        """
        policy = super().adapt_to_game(question)
        if not question.opponents:
            return policy
        partner = replace(policy, to=question.opponents[0])
        try:
            _ = partner._partner
        except DmplayError:
            return replace(policy, to="random")
        return partner


@dataclass(frozen=True)
class _Constant(ConstantPolicy):
    """A partner that always takes the same action."""

    action: int = 0


def build_roster(problem: Problem, seat: int) -> Roster:
    """Return the agents that care for a baby.

    The best response gives the hints, or the joint plan in a game without discount and turn limit.
    """
    adviser = "best-response" if problem.discount < 1.0 else "joint-plan"
    return Roster(
        {"best-response": BestResponse, "feed-when-crying": FeedWhenCrying,
         "joint-plan": SharedObservationPlan},
        adviser, "best-response", default_partner=DEFAULT_PARTNER,
    )  # fmt: skip
