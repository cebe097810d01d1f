"""Planning of the rounds left in a repeated game, against a known rule or a mix of rules."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain, pairwise
from typing import ClassVar, Self

import numpy as np

from dmplay.agents.base import AdviceQuestion, GreedyPolicy, PolicyMaker, SeatPolicy
from dmplay.agents.best_response_plan import BestResponsePlan
from dmplay.agents.random_agent import Random
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.core.arrays import Array, Reals
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory, Percept, requires_fields
from dmplay.errors import BadPolicy, DmplayError

MAX_PLANNED_ROUNDS = 100
MIN_POSTERIOR = 1e-9  # rules that are less probable are left out of the values
MAX_SHOWN_RULES = 3
UNNAMED_PLAYERS = ("human", "bot", "replay")  # players whose rule has no name
SHOWN_PROBABILITY = 0.005  # rules that are less probable are not shown


@dataclass(frozen=True)
class RepeatedGamePlan(GreedyPolicy, SeatPolicy):
    """Plans the rounds left against a rule, or against rules weighted by their posterior.

    Against a known rule `to` the values are exact, by backward induction over the rule's memory and
    the rounds left. Otherwise the opponent plays one of the problem's rules, each with the same
    prior probability. The values are then the mean over the posterior of the values against each
    rule, as if the rule were known from the next round on (QMDP, section 21.1).
    """

    to: str = parameter("", "rule that the opponent plays; empty: unknown")
    horizon: int = parameter(10, "rounds of a game", 1, MAX_PLANNED_ROUNDS)
    policy_maker: PolicyMaker | None = field(default=None, compare=False, repr=False)

    plans_whole_game = True
    candidate_rules: ClassVar[Mapping[str, type[SeatPolicy]]] = {}  # set by each problem

    def with_policy_maker(self, policy_maker: PolicyMaker) -> Self:
        """Return this plan with a function that makes the opponent named by `to`."""
        policy = replace(self, policy_maker=policy_maker)
        if self.to:
            _ = policy._rules  # raises an error for an unknown name
        return policy

    def adapt_to_game(self, question: AdviceQuestion) -> Self:
        """Return a plan for the rounds of a game against its opponent.

        An opponent whose rule cannot be planned against counts as unknown.
        """
        horizon = min(question.turn_limit or self.horizon, MAX_PLANNED_ROUNDS)
        policy = replace(self, horizon=horizon)
        if len(question.opponents) != 1 or self.to:
            return policy
        exact_policy = replace(policy, to=question.opponents[0])
        try:
            exact_policy.action_values(exact_policy.initial_memory(np.zeros(1, np.int64)))
        except DmplayError:
            return policy
        return exact_policy

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return exact values against a known rule, else a guess by the rules that may be played.

        The name of an agent that plays none of these rules is added.
        """
        basis, opponents = super().values_basis(question), question.actual_opponents
        basis = basis.with_plan(self.horizon, question.turn_limit)
        if self.to:
            assumption = "" if (self.to,) == opponents else f"against {self.to}"
            return basis._replace(accuracy=Accuracy.EXACT, assumed_players=assumption)
        name = opponents[0].partition(":")[0] if opponents else ""
        player = self.problem.agents[1 - self.seat]
        other = "" if name in {"", *UNNAMED_PLAYERS} else f" and not {name}"
        assumption = f"if {player} plays one of {len(self._rules)} rules{other}"
        return basis._replace(
            accuracy=Accuracy.ESTIMATED, assumed_players=assumption, has_regrets=False
        )

    def describe_model(self, memory: Memory) -> str:
        """Return the opponent's likeliest rules with probabilities; '' if its rule is known."""
        if self.to:
            return ""
        weights = self._infer_posterior(memory)[0]
        order = np.argsort(-weights, kind="stable")
        names = [name for name, _ in self._rules]
        likely = [i for i in order[:MAX_SHOWN_RULES] if weights[i] >= SHOWN_PROBABILITY]
        text = ", ".join(f"{names[i]} {weights[i]:.2f}" for i in likely)
        has_more = int((weights >= SHOWN_PROBABILITY).sum()) > len(likely)
        return f"{text}{', ...' * has_more}"

    def predict_actions(self, memory: Memory, seat: int) -> Reals:
        """Return the probability `[B, A]` of each action of the opponent, over its rules."""
        predictions = (
            weights[:, None] * plan.predict_actions(plan_memory, seat)
            for weights, plan, plan_memory in self._iter_weighted_plans(memory)
        )
        return np.asarray(sum(predictions))

    @cached_property
    def _rules(self) -> list[tuple[str, SeatPolicy]]:
        """The rules that the opponent may play, by name; raise BadPolicy for an unknown `to`."""
        opponent = 1 - self.seat
        if not self.to or self.to in self.candidate_rules:
            names = [self.to] if self.to else self.candidate_rules
            return [(name, self.candidate_rules[name](self.problem, opponent)) for name in names]
        if self.to == "random":
            return [(self.to, Random(self.problem, opponent))]
        policy = self.policy_maker(opponent, self.to) if self.policy_maker else None
        if policy is None:
            raise BadPolicy(f"plan-rounds: no rule {self.to!r} of the opponent")
        return [(self.to, policy)]

    @cached_property
    def _plans(self) -> list[BestResponsePlan]:
        """The best response to each rule."""
        return [
            BestResponsePlan(self.problem, self.seat, (name,), self.horizon, (rule,))
            for name, rule in self._rules
        ]

    @cached_property
    def _memory_lengths(self) -> list[int]:
        """The number of arrays in the memory of each best response."""
        observation = np.zeros(1, np.int64)
        return [len(plan.initial_memory(observation)) for plan in self._plans]

    def initial_memory(self, observation: Array) -> Memory:
        """Return log likelihoods `[B, K]` of the rules, and the memory of each best response."""
        memories = (plan.initial_memory(observation) for plan in self._plans)
        return (np.zeros((len(observation), len(self._rules))), *chain(*memories))

    @requires_fields("observation", "actions")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the memory after a round, from both agents' actions."""
        assert percept.actions is not None
        opponent = 1 - self.seat
        log_likelihoods = memory[0].copy()
        updated_memories: list[Array] = []
        plans = zip(self._plans, self._split_memories(memory), strict=True)
        for index, (plan, plan_memory) in enumerate(plans):
            chances = plan.predict_actions(plan_memory, opponent)
            likelihoods = chances[np.arange(len(chances)), percept.actions[:, opponent]]
            with np.errstate(divide="ignore"):
                log_likelihoods[:, index] += np.log(likelihoods)
            updated_memories += plan.update_memory(plan_memory, percept)
        return (log_likelihoods, *updated_memories)

    def action_values(self, memory: Memory) -> Reals:
        """Return the expected return `[B, A]` of each action over the rounds left.

        After the last round a game begins again.
        """
        q = np.zeros((len(memory[0]), self.problem.action_counts[self.seat]))
        for weights, plan, plan_memory in self._iter_weighted_plans(memory):
            rows = np.flatnonzero(weights > MIN_POSTERIOR)
            if len(rows):
                values = plan.action_values(tuple(array[rows] for array in plan_memory))
                q[rows] += weights[rows, None] * values
        return q

    def _iter_weighted_plans(
        self, memory: Memory
    ) -> Iterator[tuple[Reals, BestResponsePlan, Memory]]:
        """Yield the posterior probability `[B]` of each rule, its best response and its memory."""
        return zip(
            self._infer_posterior(memory).T, self._plans, self._split_memories(memory), strict=True
        )

    def _infer_posterior(self, memory: Memory) -> Reals:
        """Return the posterior probability `[B, K]` of each rule; uniform if none is possible."""
        log_likelihoods = memory[0]
        largest = log_likelihoods.max(axis=1, keepdims=True)
        weights = np.exp(log_likelihoods - np.where(np.isfinite(largest), largest, 0.0))
        weights[~np.isfinite(largest[:, 0])] = 1.0
        return np.asarray(weights / weights.sum(axis=1, keepdims=True))

    def _split_memories(self, memory: Memory) -> list[Memory]:
        """Return the memory of each best response."""
        ends = np.cumsum([1, *self._memory_lengths])
        return [memory[start:end] for start, end in pairwise(ends)]
