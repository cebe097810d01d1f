"""The possible outcomes of an action, and the parts of its value that they explain."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Array, Reals

END_PREFIX = "the end ("  # of the text of a state that ends the problem
RELATIVE_TOLERANCE = 1e-6  # largest difference, as a share, of parts that sum to the value


class PossibleOutcome(NamedTuple):
    """A possible outcome of an action: the next state, an observation, or the others' actions."""

    text: str
    probability: float
    reward: float  # expected reward of this turn, given the outcome
    value_after: float  # value of playing on; 0 after the end of the game
    belief: Reals | None = None  # [S], the belief after an observation
    ends_problem: bool = False  # whether the problem ends with it, not only the turn limit

    @property
    def label(self) -> str:
        """The outcome as text, which says whether the next state ends the problem."""
        is_end = self.ends_problem and self.belief is None
        return f"{END_PREFIX}{self.text})" if is_end else self.text


class Payoff(NamedTuple):
    """The expected reward of an action if the other agents act in one way."""

    joint_action: Array  # [n]
    probability: float
    reward: float


@dataclass(frozen=True, eq=False)
class ActionBreakdown:
    """The value of an action and its parts.

    The values after an outcome come from the agent that gives the hints, with its memory after that
    outcome. An exact value therefore equals reward + discount x sum(probability x value after).
    """

    action: int
    value: float
    discount: float
    outcomes: tuple[PossibleOutcome, ...]  # likeliest first
    replies: Reals | None  # [A'], probability of each action of the only other agent, if modelled
    next_replies: Reals | None  # [A'], the same in the next turn
    information_value: float  # part of the value lost if the next action is chosen blindly
    is_last_turn: bool  # whether the value counts no later turn
    scale: float = 1.0  # of the problem's rewards

    @property
    def reward(self) -> float:
        """The expected reward of this turn."""
        return sum(outcome.probability * outcome.reward for outcome in self.outcomes)

    @property
    def value_after(self) -> float:
        """The mean value of playing on, not discounted."""
        return sum(outcome.probability * outcome.value_after for outcome in self.outcomes)

    @property
    def later_value(self) -> float:
        """The part of the value that comes from later turns."""
        return self.discount * self.value_after

    @property
    def mean_belief(self) -> Reals | None:
        """The mean belief `[S]` after the observations; None if no state is hidden."""
        if self.outcomes[0].belief is None:
            return None
        beliefs = np.array([outcome.belief for outcome in self.outcomes])
        return np.asarray(np.array([outcome.probability for outcome in self.outcomes]) @ beliefs)

    def outcome_total(self, outcome: PossibleOutcome) -> float:
        """Return the reward of an outcome plus the discounted value after it."""
        return outcome.reward + self.discount * outcome.value_after

    @property
    def adds_up(self) -> bool:
        """True if the parts sum to the value, as those of exact values do."""
        difference = self.value - self.reward - self.later_value
        return abs(difference) <= RELATIVE_TOLERANCE * max(self.scale, abs(self.value))


class OutcomeShare(NamedTuple):
    """The share of one outcome in the difference between the values of two actions."""

    outcome: PossibleOutcome
    better_probability: float  # after the action with the higher value
    worse_probability: float
    share: float


def merge_outcomes_by_text(outcomes: Iterable[PossibleOutcome]) -> list[PossibleOutcome]:
    """Return outcomes of which no two have the same text, likeliest first.

    The probabilities of outcomes with the same text are added, and their rewards and values are
    means weighted by these probabilities.
    """
    merged: dict[str, PossibleOutcome] = {}
    for outcome in outcomes:
        same = merged.setdefault(outcome.text, outcome)
        if same is not outcome:
            probability = same.probability + outcome.probability
            share = outcome.probability / probability
            merged[outcome.text] = same._replace(
                probability=probability,
                reward=(1.0 - share) * same.reward + share * outcome.reward,
                value_after=(1.0 - share) * same.value_after + share * outcome.value_after,
            )
    return sorted(merged.values(), key=lambda outcome: -outcome.probability)


def compute_outcome_shares(better: ActionBreakdown, worse: ActionBreakdown) -> list[OutcomeShare]:
    """Return the shares of all outcomes in the difference of two values, largest first.

    With the probabilities p of an outcome after both actions, its share is
    (p_better - p_worse) (x - v) / difference. x is its reward plus the discounted value after it,
    and v is the value of the worse action. Outcomes with other rewards or other later values are
    other outcomes. The shares sum to 1 if both values add up.
    """
    difference = better.value - worse.value
    probabilities: list[tuple[PossibleOutcome, list[float]]] = []
    by_text: dict[str, list[tuple[PossibleOutcome, list[float]]]] = {}
    for index, parts in enumerate((better, worse)):
        for outcome in parts.outcomes:
            same_text = by_text.setdefault(outcome.label, [])
            pair = next(
                (item for item in same_text if _is_same(item[0], outcome, better.scale)), None
            )
            if pair is None:
                pair = outcome, [0.0, 0.0]
                same_text.append(pair)
                probabilities.append(pair)
            pair[1][index] += outcome.probability
    shares = [
        OutcomeShare(
            outcome,
            p[0],
            p[1],
            (p[0] - p[1]) * (better.outcome_total(outcome) - worse.value) / difference,
        )
        for outcome, p in probabilities
    ]
    return sorted(shares, key=lambda item: -item.share)


def _is_same(outcome: PossibleOutcome, other: PossibleOutcome, scale: float) -> bool:
    """Return whether two outcomes of the same text have the same reward and later value."""
    atol = RELATIVE_TOLERANCE**2 * scale
    return np.allclose(outcome[2:4], other[2:4], rtol=RELATIVE_TOLERANCE, atol=atol)
