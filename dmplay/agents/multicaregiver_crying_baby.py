"""Policies for two caregivers: the single caregiver's rule, best responses and joint plans."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Self

import numpy as np

from dmplay.agents._belief_policy import apply_by_group
from dmplay.agents._same_observation_planning import PartnerBeliefFilter, SharedObservationPlan
from dmplay.agents._single_agent_planning import MAX_ALPHA_VECTOR_TURNS
from dmplay.agents._turns_left import TurnsLeftPolicy
from dmplay.agents.available_agents import Roster
from dmplay.agents.base import EXACT_VALUES, AdviceQuestion, GreedyPolicy, SeatPolicy
from dmplay.agents.crying_baby import FeedWhenCrying
from dmplay.core import belief
from dmplay.core.arrays import Array, Reals
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory, Percept
from dmplay.core.problem import Problem, enumerate_outcomes
from dmplay.core.tabular import Tables
from dmplay.errors import BadPolicy
from dmplay.problems.multicaregiver_crying_baby import MulticaregiverCryingBaby
from dmplay.solvers.pomdp import exact_pomdp
from dmplay.solvers.pomdp.exact_pomdp import AlphaVectorStage

ACTIONS = MulticaregiverCryingBaby.actions[0]
N_LAST_OBSERVATIONS = 3  # last observations: nothing yet, crying, quiet
PARTNER_MODELS = ("feed-when-crying", "random", *ACTIONS)


@dataclass(frozen=True)
class _PartnerModelPolicy(SeatPolicy):
    """A policy whose memory is its belief if the partner always plays `to`.

    Both caregivers observe the same, so the partner's actions can be predicted. The problem becomes
    a POMDP whose state is the baby's state and the last observation.
    """

    to: str = parameter(
        "feed-when-crying", f"assumed partner: {', '.join(PARTNER_MODELS)}", choices=PARTNER_MODELS
    )

    @cached_property
    def pomdp_tables(self) -> Tables:
        """The arrays of that POMDP; its state is 3 times the baby's state plus the last
        observation.
        """
        return self._build_tables(self._partner_probabilities)

    @property
    def _partner_probabilities(self) -> Reals:
        """The probability `[S, A]` of each of the partner's actions."""
        last_observations, action_count = (
            np.arange(2 * N_LAST_OBSERVATIONS) % N_LAST_OBSERVATIONS - 1,
            len(ACTIONS),
        )
        if self.to == "random":
            return np.full((len(last_observations), action_count), 1 / action_count)
        if self.to in ACTIONS:
            return np.tile(
                np.eye(action_count)[ACTIONS.index(self.to)], (len(last_observations), 1)
            )
        partner = FeedWhenCrying(self.problem, 1 - self.seat)
        partner_actions = partner.choose(
            (last_observations,), None, np.zeros((len(last_observations), 0))
        )
        return np.asarray(np.eye(action_count)[partner_actions])

    def _build_tables(self, partner_probabilities: Reals) -> Tables:
        """Return the POMDP's arrays if the partner takes actions with probabilities `[S, A]`."""
        states, action_count = np.arange(2 * N_LAST_OBSERVATIONS), len(ACTIONS)
        transition = np.zeros((len(states), action_count, len(states)))
        rewards = np.zeros((len(states), action_count, 1))
        for action, partner_action in product(range(action_count), repeat=2):
            joint_action = (action, partner_action) if self.seat == 0 else (partner_action, action)
            p, outcome = enumerate_outcomes(
                self.problem, states // N_LAST_OBSERVATIONS, np.tile(joint_action, (len(states), 1))
            )
            p = p * partner_probabilities[:, partner_action, None]
            next_states = (
                outcome.state * N_LAST_OBSERVATIONS + outcome.observations[:, :, self.seat] + 1
            )
            np.add.at(transition[:, action], (states[:, None], next_states), p)
            rewards[:, action, 0] += (p * outcome.rewards[:, :, self.seat]).sum(axis=1)
        observation_model = np.eye(N_LAST_OBSERVATIONS - 1)[
            np.maximum(states % N_LAST_OBSERVATIONS - 1, 0)
        ]
        return Tables(transition, rewards, np.repeat(observation_model[None], action_count, axis=0))

    @cached_property
    def _belief_filter(self) -> PartnerBeliefFilter:
        """The belief filter by own action and observation, with a random partner as its
        fallback.
        """
        action_count = len(ACTIONS)
        random_tables = self._build_tables(
            np.full((2 * N_LAST_OBSERVATIONS, action_count), 1 / action_count)
        )
        return PartnerBeliefFilter.from_arrays(
            *(
                tables.joint_probabilities.transpose(1, 2, 0, 3)
                for tables in (self.pomdp_tables, random_tables)
            )
        )

    def initial_memory(self, observation: Array) -> Memory:
        """Return the belief before the first turn, with nothing observed yet."""
        b = np.zeros((len(observation), 2 * N_LAST_OBSERVATIONS))
        b[:, ::N_LAST_OBSERVATIONS] = belief.initial_belief(self.problem)
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
        (b,) = memory[0].reshape(len(memory[0]), -1, N_LAST_OBSERVATIONS).sum(axis=2)
        names = map(self.problem.format_state, self.problem.enumerate_states())
        return f"belief {', '.join(f'{name} {p:.3f}' for name, p in zip(names, b, strict=True))}"

    def forecast_observations(self, memory: Memory, action: int) -> tuple[Reals, Reals]:
        """Return the probability `[O]` of each observation, and the belief `[O, S]` after it."""
        tables = self.pomdp_tables
        joint = memory[0][0] @ tables.transition[:, action]
        by_state = joint.reshape(-1, N_LAST_OBSERVATIONS)[:, 1:].T  # [O, S]
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
        """Return the best response for the turns left, to a random or to an assumed partner.

        Beliefs, forecasts and hints assume one partner: a caregiver does not see the other act, so
        the belief of its seat takes the other to act uniformly at random, whoever it is. A person
        may assume another partner.
        """
        policy = super().adapt_to_game(question)
        if not question.opponents:
            return policy
        partner = question.opponents[0] if question.assumes_players else "random"
        return replace(policy, to=partner)


def build_roster(problem: Problem, seat: int) -> Roster:
    """Return the agents that care for a baby.

    The best response gives the hints, or the joint plan in a game without discount and turn limit.
    """
    adviser = "best-response" if problem.discount < 1.0 else "joint-plan"
    return Roster(
        {"best-response": BestResponse, "feed-when-crying": FeedWhenCrying,
         "joint-plan": SharedObservationPlan},
        adviser, "best-response", default_partner="feed-when-crying",
    )  # fmt: skip
