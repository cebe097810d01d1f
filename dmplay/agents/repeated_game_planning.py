"""Planning of the rounds left in a repeated game, against a known rule or a mix of rules."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import ClassVar, Self

import numpy as np

from dmplay.agents.base import AdviceQuestion, GreedyPolicy, PolicyLookup, SeatPolicy
from dmplay.agents.random_agent import Random
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.core.arrays import Array, Ints, Reals
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory, Percept, requires_fields
from dmplay.core.work_budget import Budget
from dmplay.errors import BadPolicy, DmplayError
from dmplay.solvers.games import bimatrix_game

MAX_PLANNED_ROUNDS = 100
MIN_POSTERIOR = 1e-9  # rules that are less probable are left out of the values
MAX_SHOWN_RULES = 3
UNNAMED_PLAYERS = ("human", "bot", "replay")  # players whose rule has no name
SHOWN_PROBABILITY = 0.005  # rules that are less probable are not shown
ROUND_WORK = 2e4  # operations for one action in one memory of a rule
MAX_WORK = 1e9


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
    policy_lookup: PolicyLookup | None = field(default=None, compare=False, repr=False)

    plans_whole_game = True
    candidate_rules: ClassVar[Mapping[str, type[SeatPolicy]]] = {}  # set by each problem

    def with_policy_lookup(self, policy_lookup: PolicyLookup) -> Self:
        """Return this plan with a function that makes the opponent named by `to`."""
        policy = replace(self, policy_lookup=policy_lookup)
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
        """Return the most probable rules of an unknown opponent with their probabilities."""
        if self.to:
            return ""
        weights = self._posterior(memory)[0]
        order = np.argsort(-weights, kind="stable")
        names = [name for name, _ in self._rules]
        likely = [i for i in order[:MAX_SHOWN_RULES] if weights[i] >= SHOWN_PROBABILITY]
        text = ", ".join(f"{names[i]} {weights[i]:.2f}" for i in likely)
        has_more = int((weights >= SHOWN_PROBABILITY).sum()) > len(likely)
        return f"{text}{', ...' * has_more}"

    def predict_actions(self, memory: Memory, seat: int) -> Reals:
        """Return the probability `[B, A]` of each action of the opponent, over its rules."""
        posterior = self._posterior(memory)
        rules = zip(self._rules, self._split_memories(memory), strict=True)
        return np.asarray(
            sum(
                posterior[:, [index]] * self._choice_probabilities(rule, rule_memory)
                for index, ((_, rule), rule_memory) in enumerate(rules)
            )
        )

    @cached_property
    def _rules(self) -> list[tuple[str, SeatPolicy]]:
        """The rules that the opponent may play, by name."""
        opponent = 1 - self.seat
        if not self.to:
            return [
                (name, rule(self.problem, opponent)) for name, rule in self.candidate_rules.items()
            ]
        if self.to in self.candidate_rules:
            return [(self.to, self.candidate_rules[self.to](self.problem, opponent))]
        if self.to == "random":
            return [(self.to, Random(self.problem, opponent))]
        policy = self.policy_lookup(opponent, self.to) if self.policy_lookup else None
        if policy is None:
            raise BadPolicy(f"plan-rounds: no rule {self.to!r} of the opponent")
        return [(self.to, policy)]

    @cached_property
    def _payoffs(self) -> Reals:
        """The rewards of the seat `[own A, opponent's A]`."""
        payoffs = bimatrix_game.build_payoffs(self.problem)[:, :, self.seat]
        return payoffs if self.seat == 0 else payoffs.T

    @cached_property
    def _memory_lengths(self) -> list[int]:
        """The number of arrays in the memory of each rule."""
        observation = np.zeros(1, np.int64)
        return [len(rule.initial_memory(observation)) for _, rule in self._rules]

    def initial_memory(self, observation: Array) -> Memory:
        """Return zero rounds, log likelihoods `[B, K]` of the rules, and the memory of each."""
        row_count = len(observation)
        memories = [rule.initial_memory(observation) for _, rule in self._rules]
        return (
            np.zeros(row_count, np.int64),
            np.zeros((row_count, len(self._rules))),
            *(array for memory in memories for array in memory),
        )

    @requires_fields("actions")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the memory after a round, from both agents' actions."""
        assert percept.actions is not None
        opponent_actions = percept.actions[:, 1 - self.seat]
        log_likelihoods = memory[1].copy()
        updated_memories: list[Array] = []
        rules = zip(self._rules, self._split_memories(memory), strict=True)
        for index, ((_, rule), rule_memory) in enumerate(rules):
            chances = self._choice_probabilities(rule, rule_memory)
            with np.errstate(divide="ignore"):
                log_likelihoods[:, index] += np.log(
                    chances[np.arange(len(chances)), opponent_actions]
                )
            updated_memories += self._update_rule(rule, rule_memory, percept.actions)
        return (memory[0] + 1, log_likelihoods, *updated_memories)

    def action_values(self, memory: Memory) -> Reals:
        """Return the expected return `[B, A]` of each action over the rounds left.

        After the last round a game begins again.
        """
        rows = [tuple(array[row : row + 1] for array in memory) for row in range(len(memory[0]))]
        keys = [b"".join(array.tobytes() for array in row) for row in rows]
        values_by_key = {
            key: self._row_values(row) for key, row in dict(zip(keys, rows, strict=True)).items()
        }
        return np.stack([values_by_key[key] for key in keys])

    def _row_values(self, memory: Memory) -> Reals:
        """Return the expected return `[A]` of each action for a memory of one row."""
        rounds_left = self.horizon - int(memory[0][0]) % self.horizon
        (posterior,) = self._posterior(memory)
        rule_memories = self._split_memories(memory)
        return np.asarray(
            sum(
                posterior[index] * self._values_against(index, rule_memories[index], rounds_left)
                for index in np.flatnonzero(posterior > MIN_POSTERIOR).tolist()
            )
        )

    def _posterior(self, memory: Memory) -> Reals:
        """Return the posterior probability `[B, K]` of each rule; uniform if none is possible."""
        log_likelihoods = memory[1]
        largest = log_likelihoods.max(axis=1, keepdims=True)
        weights = np.exp(log_likelihoods - np.where(np.isfinite(largest), largest, 0.0))
        weights[~np.isfinite(largest[:, 0])] = 1.0
        return np.asarray(weights / weights.sum(axis=1, keepdims=True))

    def _split_memories(self, memory: Memory) -> list[Memory]:
        """Return the memory of each rule."""
        ends = np.cumsum([2, *self._memory_lengths])
        return [memory[start:end] for start, end in pairwise(ends)]

    @staticmethod
    def _choice_probabilities(rule: SeatPolicy, memory: Memory) -> Reals:
        """Return the probability `[B, A]` of each action of a rule; raise BadPolicy if unknown."""
        probabilities = rule.choice_probabilities(memory)
        if probabilities is None:
            raise BadPolicy(f"plan-rounds: the choices of {type(rule).__name__} are not known")
        return probabilities

    def _update_rule(self, rule: SeatPolicy, memory: Memory, actions: Ints) -> Memory:
        """Return the memory of the opponent's rule after the joint actions `[B, 2]`."""
        state = np.zeros(len(actions), np.int64)
        opponent = 1 - self.seat
        return rule.update_memory(memory, Percept(actions[:, opponent], state, actions, None))

    @cached_property
    def _cached_values(self) -> dict[tuple[int, bytes, int], Reals]:
        """The values by rule, memory and rounds left that were computed before."""
        return {}

    @cached_property
    def _budget(self) -> Budget:
        return Budget("planning a repeated game", "try fewer turns", MAX_WORK)

    def _values_against(self, index: int, memory: Memory, rounds_left: int) -> Reals:
        """Return the value `[A]` of each action against one rule with this memory of one row."""
        key = index, b"".join(array.tobytes() for array in memory), rounds_left
        if key not in self._cached_values:
            self._budget.spend_work(ROUND_WORK * len(self._payoffs))
            self._cached_values[key] = self._compute_values(index, memory, rounds_left)
        return self._cached_values[key]

    def _compute_values(self, index: int, memory: Memory, rounds_left: int) -> Reals:
        """Return the expected reward of each action and, discounted, the best value after it."""
        _, rule = self._rules[index]
        probabilities = self._choice_probabilities(rule, memory)[0]
        values = np.asarray(self._payoffs @ probabilities)
        if rounds_left == 1:
            return values
        own_actions = np.arange(len(self._payoffs))
        for opponent_action in np.flatnonzero(probabilities):
            columns = [own_actions, np.full(len(own_actions), opponent_action)]
            joint_actions = np.stack(columns if self.seat == 0 else columns[::-1], axis=1)
            rows = tuple(array.repeat(len(own_actions), axis=0) for array in memory)
            next_memories = self._update_rule(rule, rows, joint_actions)
            # A rule that ignores the player's action has one next memory: 100 rounds of 99 claims
            # against a random traveler are planned in 0.3 s, not 5 s.
            is_equal = all((array == array[:1]).all() for array in next_memories)
            best_values = [
                self._values_against(
                    index, tuple(array[row : row + 1] for array in next_memories), rounds_left - 1
                ).max()
                for row in ([0] if is_equal else own_actions)
            ]
            weight = self.problem.discount * probabilities[opponent_action]
            values = values + weight * np.array(best_values)
        return values
