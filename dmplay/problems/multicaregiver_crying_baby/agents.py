"""Policies for two caregivers: the single caregiver's rule, best responses and joint plans."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import AdviceQuestion, ConstantPolicy, SeatPolicy
from dmplay.agents.best_response_in_team import BestResponseInTeam
from dmplay.agents.single_agent_planning import MAX_ALPHA_VECTOR_TURNS
from dmplay.core.arrays import Reals
from dmplay.core.parameters import parameter
from dmplay.core.problem import Problem
from dmplay.core.tabular import Tables
from dmplay.errors import BadPolicy, DmplayError
from dmplay.problems.crying_baby.agents import FeedWhenCrying
from dmplay.solvers.pomdp import exact_pomdp
from dmplay.solvers.pomdp.exact_pomdp import AlphaVectorStage

from .rules import MulticaregiverCryingBaby
from .same_observation_planning import SharedObservationPlan

ACTIONS = MulticaregiverCryingBaby.actions[0]
N_OBSERVATIONS = 2  # crying and quiet
DEFAULT_PARTNER = "feed-when-crying"


@dataclass(frozen=True)
class BestResponse(BestResponseInTeam):
    """Plays a best response to the partner, if it plays as assumed.

    The partner is assumed to play `to` (an agent or an action) always. It plans for an infinite
    horizon or for `horizon` turns, in a POMDP that includes the partner. The values are against
    that partner.
    """

    to: str = parameter(DEFAULT_PARTNER, "assumed partner: an agent or an action")

    max_belief_size = 120  # alpha vectors of more probabilities take too long
    splits_observations = True  # both hear the same, so that a node determines what this seat hears

    def __post_init__(self) -> None:
        """Raise BadPolicy for an infinite horizon without a discount."""
        super().__post_init__()
        if self.problem.discount >= 1.0 and not self.horizon:
            raise BadPolicy("an infinite horizon needs a discount below 1; set horizon=TURNS")

    def make_partner(self, seat: int) -> SeatPolicy | None:
        """Return the policy `to` of the partner in its seat; None if there is none."""
        if self.to == DEFAULT_PARTNER:
            return FeedWhenCrying(self.problem, seat)
        if self.to in ACTIONS:
            return _Constant(self.problem, seat, ACTIONS.index(self.to))
        return super().make_partner(seat)

    @cached_property
    def pomdp_tables(self) -> Tables:
        """The arrays of the POMDP whose states are the partner's nodes with the baby's states."""
        observations = np.repeat(self.partner_machine.observations, 2)
        size, action_count = len(observations), len(ACTIONS)
        transition = np.zeros((size, action_count, size))
        for action in range(action_count):
            for part in self._cached_transitions(action).values():
                transition[part.source, action, part.target] += part.weight
        observation_model = np.eye(N_OBSERVATIONS)[np.maximum(observations, 0)]
        observation_model = np.repeat(observation_model[None], action_count, axis=0)
        return Tables(transition, self.rewards.T[:, :, None], observation_model)

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

    def values_with_turns_left(self, info_state: Reals, turns_left: int | None) -> Reals:
        """Return Q `[B, A]` of beliefs against that partner with these rewards to come."""
        stage = self._alpha_vectors if turns_left is None else self._stages[turns_left - 1]
        return exact_pomdp.compute_action_values(stage, info_state)

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
            _ = partner.partner_machine
        except DmplayError:
            return replace(policy, to="random")
        return partner


@dataclass(frozen=True)
class _Constant(ConstantPolicy):
    """A partner that always takes the same action."""

    action: int = 0


def list_agents(problem: Problem, seat: int) -> Roster:
    """Return the agents that care for a baby.

    The best response gives the hints, or the joint plan in a game without discount and turn limit.
    """
    adviser = "best-response" if problem.discount < 1.0 else "joint-plan"
    return Roster(
        {"best-response": BestResponse, "feed-when-crying": FeedWhenCrying,
         "joint-plan": SharedObservationPlan},
        adviser, "best-response", default_partner=DEFAULT_PARTNER,
        rule_of_thumb="feed-when-crying",
    )  # fmt: skip


AGENTS = list_agents
