"""The value that a player lost in a game: by seeing (a wrong belief), by choosing, and by luck.

With b the exact belief, c the belief that the player stated, a*(.) the best action of a belief (the
mean of all best ones), a the action and Q the values of this game, a turn has three parts:

    seeing = Q(b, a*(b)) - Q(b, a*(c))
    choosing = Q(b, a*(c)) - Q(b, a)
    luck = reward + discount V(b') - Q(b, a)

b' is the belief after the turn, and V is 0 after the end of the game. Actions of other players are
luck. Then return = V(b0) + sum over turns t of discount^t (luck - seeing - choosing). Without a
stated belief, c is b. If states are visible, b is the state.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from dmplay.agents.base import AdviceQuestion, bound_action_values, bound_best_number
from dmplay.core.action_values import Accuracy
from dmplay.core.arrays import Bools, Reals
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.policy import Memory
from dmplay.core.problem import Problem
from dmplay.core.return_bounds import compute_return_bounds
from dmplay.core.session import SeatedPolicy, Session, Turn
from dmplay.errors import BadParameter
from dmplay.registry.agents import HintAgent, find_hint_provider
from dmplay.transcript.format import NATURAL_END_REASONS

Bounds = tuple[float, float]  # a lower and an upper bound; equal if the number is exact
ZERO = (0.0, 0.0)


class TurnParts(NamedTuple):
    """The parts of one turn of a seat, as bounds that are equal if the values are exact."""

    turn: int
    seeing: Bounds
    choosing: Bounds
    luck: Bounds
    regret: Bounds  # the value of the best action minus that of the action: seeing and choosing
    has_choice: bool  # False if the seat was inactive
    nats: float | None  # divergence of the stated belief from the exact one; None if none is stated
    stated_regret: Bounds | None  # the regret of the action if the stated belief were true


class GameParts(NamedTuple):
    """The value of one seat at the start of a game, and the parts of each turn."""

    start_value: Bounds
    turns: tuple[TurnParts, ...]
    discount: float

    def sum_discounted(self, name: str) -> Bounds:
        """Return the sum of a part over all turns, each discounted to the first turn."""
        weights = [self.discount ** (turn.turn - 1) for turn in self.turns]
        pairs = [getattr(turn, name) for turn in self.turns]
        low, high = (
            math.fsum(weight * pair[side] for weight, pair in zip(weights, pairs, strict=True))
            for side in (0, 1)
        )
        return low, high


class ValueMeter:
    """The values of one seat in the game of a question, by which games are divided into parts.

    Raise BadParameter if these values are neither exact nor bounded in this game.
    """

    def __init__(
        self, problem: Problem, question: AdviceQuestion, agent: HintAgent | None = None
    ) -> None:
        agent = agent or find_hint_provider(problem, question)
        if agent is None:
            raise BadParameter("no agent computes values of this problem")
        if not agent.is_about_game:
            about = agent.basis.scope or "other players"
            raise BadParameter(f"no values are about this game, only {about}")
        self._problem, self._agent = problem, agent
        self._tolerance = VALUE_TOLERANCE * problem.reward_scale

    @property
    def is_exact(self) -> bool:
        """True if the values are exact."""
        return self._agent.has_exact_regrets

    def divide_game(self, session: Session) -> GameParts:
        """Return the parts of a finished game.

        Raise BadParameter for a game that did not end by itself, or without values or bounds.
        """
        reason = explain_missing_parts(session)
        if reason:
            raise BadParameter(reason)
        positions = [*self._iter_positions(session)]
        values_after = [(*position.best_value,) for position in positions[1:]] + [ZERO]
        rewards = [turn.rewards.item(self._agent.question.seat) for turn in session.turns]
        turns = tuple(
            position.divide(number, reward, value_after, self._problem.discount)
            for number, (position, reward, value_after) in enumerate(
                zip(positions, rewards, values_after, strict=True), 1
            )
        )
        return GameParts(positions[0].best_value, turns, self._problem.discount)

    def _iter_positions(self, session: Session) -> Iterator["ValuedChoice"]:
        """Yield the seat's values and action in each turn of a game."""
        replayed, seat = session.copy_at_start(), self._agent.question.seat
        adviser = SeatedPolicy(replayed, seat, self._agent.policy)
        for turn in session.turns:
            yield self.weigh_choice(replayed, adviser.current_memory(), turn)
            replayed.append_turns([turn])

    def weigh_choice(self, session: Session, memory: Memory, turn: Turn) -> "ValuedChoice":
        """Return the values of the seat's actions and its choice, before it plays a turn.

        `memory` is that of the policy of the values. Raise BadParameter without values or bounds.
        """
        policy, seat = self._agent.policy, self._agent.question.seat
        action, legal = float(turn.actions[seat]), session.legal_actions_mask(seat)
        turns_left = None
        if session.turn_limit is not None:
            turns_left = session.turn_limit - len(session.turns)

        def bound_legal(some_memory: Memory) -> Reals:
            """Return the bounds of the values of legal actions, -inf for the others."""
            values = self._bound_values(some_memory, action, turns_left)
            return values if legal is None else np.where(legal, values, -np.inf)

        values, stated_values, nats = bound_legal(memory), None, None
        stated, exact = turn.stated_beliefs.get(seat), policy.state_belief(memory)
        if stated is not None and exact is not None:
            stated_memory = policy.replace_state_belief(memory, stated)
            if stated_memory is None:
                raise BadParameter("the values of this problem are not those of a belief")
            stated_values = bound_legal(stated_memory)
            nats = compute_divergence(exact[0], stated)
        index = int(action) if self._problem.actions[seat].labels else 0
        is_active = not session.is_inactive(seat)
        return ValuedChoice(values, index, stated_values, nats, is_active, self._tolerance)

    def _bound_values(self, memory: Memory, action: float, turns_left: int | None) -> Reals:
        """Return the bounds `[2, A]` of the values of all actions, equal if they are exact.

        If actions are real numbers, they are those of the action and of the best one.
        """
        agent, policy = self._agent, self._agent.policy
        labels = self._problem.actions[policy.seat].labels
        if labels and self.is_exact:
            q = policy.action_values(memory)
            if q is not None:
                return np.stack([q[0], q[0]])
        if labels:
            bounds = bound_action_values(policy, memory)
            if bounds is not None:
                return bounds[:, 0]
        else:
            chosen = policy.value_bounds(memory, np.array([action]))
            best = bound_best_number(policy, memory, None)
            if chosen is not None and best is not None:
                return np.concatenate([np.stack(chosen), best], axis=1)
        return self._bound_by_rewards(agent, memory, turns_left)

    def _bound_by_rewards(self, agent: HintAgent, memory: Memory, turns_left: int | None) -> Reals:
        """Return bounds `[2, A]`: those of the agent on one side, of all returns on the other."""
        q = agent.policy.action_values(memory) if agent.basis.accuracy.is_bound else None
        returns = compute_return_bounds(self._problem, turns_left)
        if q is None or returns is None:
            words = agent.basis.accuracy.words
            raise BadParameter(f"the agent that gives the hints has {words}, not exact ones")
        if agent.basis.accuracy is Accuracy.UPPER_BOUND:
            return np.stack([np.minimum(returns[0], q[0]), q[0]])
        return np.stack([q[0], np.maximum(returns[1], q[0])])


def explain_missing_parts(session: Session) -> str:
    """Return why a game cannot be divided into parts, '' if it can if its values are known."""
    if session.end_reason not in NATURAL_END_REASONS:
        return "not finished"
    if session.reroll_counts:
        return "turns were played again with new random numbers"
    return "" if session.turns else "no turns"


class ValuedChoice(NamedTuple):
    """The values of a seat's actions at one turn, its action, and the belief that it stated."""

    values: Reals  # [2, A], a lower and an upper bound; -inf for illegal actions
    action: int
    stated_values: Reals | None  # [2, A] under the stated belief; None if none is stated
    nats: float | None
    has_choice: bool
    tolerance: float

    @property
    def best_value(self) -> Bounds:
        """The bounds of the value of the best action."""
        low, high = self.values.max(axis=1).tolist()
        return low, high

    def divide(self, number: int, reward: float, value_after: Bounds, discount: float) -> TurnParts:
        """Return the parts of turn `number`, with its reward and the value after it."""
        low, high = self.values[:, self.action].tolist()
        luck = reward + discount * value_after[0] - high, reward + discount * value_after[1] - low
        regret, stated_regret = self._bound_regret(self.values), None
        if self.stated_values is not None:
            stated_regret = self._bound_regret(self.stated_values)
        return TurnParts(
            number, *self.split_regret(), luck, regret, self.has_choice, self.nats, stated_regret
        )

    def split_regret(self) -> tuple[Bounds, Bounds]:
        """Return the loss by seeing and by choosing; without a stated belief, all by choosing."""
        regret = self._bound_regret(self.values)
        if self.stated_values is None:
            return ZERO, regret
        is_best = self._find_best(self.stated_values)
        if not (np.array_equal(*self.values) and np.array_equal(*self.stated_values)):
            return self._bound_seeing(is_best), self._bound_choosing(is_best)
        mean = float(self.values[0, is_best].mean())  # all best actions are equally probable
        seeing = self._round_to_zero(self.best_value[0] - mean)
        choosing = self._round_to_zero(regret[0] - seeing)
        return (seeing, seeing), (choosing, choosing)

    def _find_best(self, values: Reals) -> Bools:
        """Return the mask `[A]` of the actions that may be the best ones."""
        return np.asarray(values[1] >= values[0].max() - self.tolerance)

    def _bound_regret(self, values: Reals) -> Bounds:
        """Return the bounds of the regret of the action; 0 if no other may be better."""
        others = np.delete(values, self.action, axis=1)
        if not others.size:
            return ZERO
        low = self._round_to_zero(max(float(others[0].max() - values[1, self.action]), 0.0))
        high = self._round_to_zero(max(float(others[1].max() - values[0, self.action]), 0.0))
        return low, high

    def _bound_seeing(self, is_best: Bools) -> Bounds:
        """Return the bounds of seeing, if the best actions of the stated belief are among these."""
        low = max(float(self.values[0].max() - self.values[1, is_best].max()), 0.0)
        if is_best.sum() == 1:
            others = np.delete(self.values, is_best.argmax(), axis=1)
            best_other = float(others[1].max()) if others.size else -math.inf
            return low, max(best_other - float(self.values[0, is_best].min()), 0.0)
        return low, max(self.best_value[1] - float(self.values[0, is_best].min()), 0.0)

    def _bound_choosing(self, is_best: Bools) -> Bounds:
        """Return the bounds of choosing, if the best actions of the stated belief are these."""
        if is_best.sum() == 1 and is_best[self.action]:
            return ZERO
        low, high = self.values[:, self.action]
        best = self.values[:, is_best]
        return float(best[0].min() - high), float(best[1].max() - low)

    def _round_to_zero(self, number: float) -> float:
        """Return a number, 0 if it is no larger than the errors of rounding."""
        return 0.0 if abs(number) <= self.tolerance else number


def compute_divergence(exact: Reals, stated: Reals) -> float:
    """Return the Kullback-Leibler divergence of a stated belief from the exact one, in nats.

    It is sum_s b(s) log(b(s) / c(s)): infinite if a possible state is stated as impossible.
    """
    is_possible = exact > 0.0
    b, c = exact[is_possible], stated[is_possible]
    if not (c > 0.0).all():
        return math.inf
    return max(float((b * np.log(b / c)).sum()), 0.0)
