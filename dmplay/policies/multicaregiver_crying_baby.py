"""Policies for the two caregivers: that of one, best answers, and plans of both."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Self

import numpy as np

from dmplay import belief
from dmplay.chance import Array, Reals
from dmplay.core import Memory, Percept, Problem, enumerate_outcomes, parameter
from dmplay.errors import BadPolicy
from dmplay.policies._joint_plan import PartnerBeliefFilter, SharedObservationPlan
from dmplay.policies.crying_baby import FeedWhenCrying
from dmplay.policies.kinds import GreedyPolicy, SeatPolicy
from dmplay.policies.roster import Roster
from dmplay.problems.multicaregiver_crying_baby import MulticaregiverCryingBaby
from dmplay.solvers import alpha_vectors
from dmplay.solvers.alpha_vectors import AlphaVectorStage
from dmplay.tabular import Tables

ACTIONS = MulticaregiverCryingBaby.actions[0]
N_LAST_OBSERVATIONS = 3  # nothing yet, crying, quiet
PARTNER_MODELS = ("feed-when-crying", "random", *ACTIONS)


@dataclass(frozen=True)
class BestResponse(GreedyPolicy, SeatPolicy):
    """The best answer to a partner who plays `to`, for ever: an agent named so, or one action.

    Both hear the same, so the partner is foreseen: this is a POMDP whose state is the baby's and
    what was heard last. The values are against that partner.
    """

    to: str = parameter(
        "feed-when-crying", f"the partner: {', '.join(PARTNER_MODELS)}", choices=PARTNER_MODELS
    )

    def __post_init__(self) -> None:
        """Refuses a game without end and discount."""
        super().__post_init__()
        if self.problem.discount >= 1.0:
            raise BadPolicy("a game without end needs a discount below 1")

    @cached_property
    def pomdp_tables(self) -> Tables:
        """The arrays of that POMDP; its state is the baby's times 3, plus what was heard."""
        return self._build_tables(self._partner_probabilities)

    @property
    def _partner_probabilities(self) -> Reals:
        """How likely the partner takes each action `[S, A]`."""
        heard, many = np.arange(2 * N_LAST_OBSERVATIONS) % N_LAST_OBSERVATIONS - 1, len(ACTIONS)
        if self.to == "random":
            return np.full((len(heard), many), 1 / many)
        if self.to in ACTIONS:
            return np.tile(np.eye(many)[ACTIONS.index(self.to)], (len(heard), 1))
        partner = FeedWhenCrying(self.problem, 1 - self.seat)
        fed = partner.choose((heard,), None, np.zeros((len(heard), 0)))
        return np.asarray(np.eye(many)[fed])

    def _build_tables(self, partner_probabilities: Reals) -> Tables:
        """The arrays beside a partner who takes actions with probabilities `[S, A]`."""
        states, many = np.arange(2 * N_LAST_OBSERVATIONS), len(ACTIONS)
        transition = np.zeros((len(states), many, len(states)))
        rewards = np.zeros((len(states), many, 1))
        for action, other in product(range(many), repeat=2):
            both = (action, other) if self.seat == 0 else (other, action)
            p, outcome = enumerate_outcomes(
                self.problem, states // N_LAST_OBSERVATIONS, np.tile(both, (len(states), 1))
            )
            p = p * partner_probabilities[:, other, None]
            after = outcome.state * N_LAST_OBSERVATIONS + outcome.observations[:, :, self.seat] + 1
            np.add.at(transition[:, action], (states[:, None], after), p)
            rewards[:, action, 0] += (p * outcome.rewards[:, :, self.seat]).sum(axis=1)
        seen = np.eye(N_LAST_OBSERVATIONS - 1)[np.maximum(states % N_LAST_OBSERVATIONS - 1, 0)]
        return Tables(transition, rewards, np.repeat(seen[None], many, axis=0))

    @cached_property
    def _alpha_vectors(self) -> AlphaVectorStage:
        return alpha_vectors.solve_infinite_horizon(self.pomdp_tables, self.problem.discount)

    @cached_property
    def _belief_filter(self) -> PartnerBeliefFilter:
        """By one's own action and what is heard."""
        many = len(ACTIONS)
        random = self._build_tables(np.full((2 * N_LAST_OBSERVATIONS, many), 1 / many))
        return PartnerBeliefFilter.from_arrays(
            *(one.joint_probabilities.transpose(1, 2, 0, 3) for one in (self.pomdp_tables, random))
        )

    def initial_memory(self, observation: Array) -> Memory:
        """The distribution of the start state, and nothing is heard."""
        b = np.zeros((len(observation), 2 * N_LAST_OBSERVATIONS))
        b[:, ::N_LAST_OBSERVATIONS] = belief.initial_belief(self.problem)
        return (b,)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Bayes' rule; where that partner rules out what was heard, beside a random one."""
        return (
            self._belief_filter.update_beliefs(memory[0], (percept.action, percept.observation)),
        )

    def action_values(self, memory: Memory) -> Reals:
        """Q of each action against that partner."""
        return alpha_vectors.compute_action_values(self._alpha_vectors, memory[0])

    def adapt_to_game(self, turns: int | None, rivals: Sequence[str]) -> Self:
        """The answer to the partner who sits there, if it has one."""
        answered = [who for who in rivals if who in PARTNER_MODELS]
        return replace(self, to=answered[0]) if answered else self


def build_roster(problem: Problem, seat: int) -> Roster:
    """Who cares for a baby; the best answer advises where a game without end has one."""
    adviser = "best-response" if problem.discount < 1.0 else "joint-plan"
    return Roster(
        {"best-response": BestResponse, "feed-when-crying": FeedWhenCrying,
         "joint-plan": SharedObservationPlan},
        adviser, default_partner="feed-when-crying",
    )  # fmt: skip
