"""Action values of one seat: their accuracy, and the turns and players that they are about."""

from enum import Enum
from typing import NamedTuple, Self

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.text import format_count

TURN_LIMIT_IGNORED, DISCOUNT_IGNORED = "turn limit ignored", "discount ignored"
MIN_LEAD_ERRORS = 2.0  # standard errors by which an estimate must lead to be the best
MAX_UNSEEN_SAMPLES = 3.0  # n times the probability of outcomes that n samples hardly ever miss
# the rules for ties
ENDS_SOONEST, PAYS_SOONEST = "tie broken by earliest end", "tie broken by earliest reward"


class Accuracy(Enum):
    """The accuracy of action values: their name on the screen, and in data."""

    UNKNOWN = "values", ""
    EXACT = "exact values", "exact"
    CONDITIONAL = "conditional values", "conditional"  # exact if others play as they assume
    ESTIMATED = "estimated values", "estimated"
    LOWER_BOUND = "lower bounds", "lower bounds"
    UPPER_BOUND = "upper bounds", "upper bounds"
    RATING = "ratings, not points", "ratings, not points"  # numbers that only compare actions

    def __init__(self, words: str, data_name: str) -> None:
        self.words, self.data_name = words, data_name

    @property
    def is_estimate(self) -> bool:
        """True if small differences of the values may be errors."""
        return self not in {Accuracy.UNKNOWN, Accuracy.EXACT, Accuracy.CONDITIONAL}

    @property
    def is_bound(self) -> bool:
        """True if the values are bounds, whose differences are no regrets."""
        return self in {Accuracy.LOWER_BOUND, Accuracy.UPPER_BOUND}

    @property
    def data(self) -> dict[str, str]:
        """The accuracy as data, for example `exact`; {} if it is unknown."""
        return {"accuracy": self.data_name} if self.data_name else {}


class Horizon(Enum):
    """The turns whose rewards action values count, in words around a number of turns."""

    GAME = ""  # as many as the game has left
    PLAN = "in plans of {}"  # those of a plan that then begins again
    AHEAD = "{} ahead"  # the next ones, of which the game may have fewer
    AT_MOST = "at most {} ahead"
    ROUND = "for one round"  # of a repeated game


class ValuesBasis(NamedTuple):
    """The basis of the action values of one seat, in the game of a question.

    By default, values of unknown accuracy are about the turns that the game has left.
    """

    accuracy: Accuracy = Accuracy.UNKNOWN
    horizon: Horizon = Horizon.GAME
    horizon_turns: int = 0  # the turns of the plan, or those ahead
    ignores_turn_limit: bool = False
    ignores_discount: bool = False
    opponents: tuple[str, ...] = ()  # players of the game of whom the agent has a model
    preposition: str = "against"  # before their names
    assumed_players: str = ""  # other players that the values assume in their place, in words
    has_regrets: bool = True  # False if the values guess the other players
    tie_rule: str = ""  # that chooses among several best actions, '' for the first
    method: str = ""  # by which they are computed, '' if the agent's name says enough
    resolution: float = 0.0  # differences of at most this may be errors, and judge no choice

    def with_plan(self, turns: int, turn_limit: int | None) -> Self:
        """Return the basis of a plan of `turns` turns that begins again if the game goes on."""
        is_game = turns == turn_limit
        return self if is_game else self._replace(horizon=Horizon.PLAN, horizon_turns=turns)

    @property
    def turns_scope(self) -> str:
        """The turns that they are about, '' if these are as many as the game has left."""
        turns = self.horizon.value.format(format_count(self.horizon_turns, "turn"))
        notes = (
            TURN_LIMIT_IGNORED * self.ignores_turn_limit,
            DISCOUNT_IGNORED * self.ignores_discount,
        )
        return ", ".join(filter(None, (turns, *notes)))

    @property
    def scope(self) -> str:
        """The game that they are about, '' if it is that of the question."""
        return ", ".join(filter(None, (self.turns_scope, self.assumed_players)))

    @property
    def players(self) -> str:
        """The other players that they are about, '' if the agent has no model of them."""
        if self.assumed_players or not self.opponents:
            return self.assumed_players
        return f"{self.preposition} {' and '.join(dict.fromkeys(self.opponents))}"

    @property
    def has_exact_regrets(self) -> bool:
        """True if their differences are the regrets in this game: no guesses, and no bounds."""
        return self.has_regrets and not self.accuracy.is_bound and not self.turns_scope


UNKNOWN_BASIS = ValuesBasis()


class ActionValues(NamedTuple):
    """The values of one seat's actions. Estimates by sampling have standard errors."""

    q: Reals  # [A], nan for illegal actions
    basis: ValuesBasis = UNKNOWN_BASIS
    scale: float = 1.0  # of the problem's rewards
    errors: Reals | None = None  # [A], infinite if unknown
    return_bounds: tuple[float, float] | None = None  # of the samples, if they are known
    sample_count: int = 1  # of each action

    @property
    def regrets(self) -> Reals:
        """The best value minus the value of each action `[A]`; nan for illegal actions."""
        finite = np.where(np.isfinite(self.q), self.q, np.nan)
        differences = np.fmax.reduce(finite) - finite
        return np.where(differences <= VALUE_TOLERANCE * self.scale, 0.0, differences)

    @property
    def best_actions(self) -> Ints:
        """The actions of the greatest value; of estimates, all actions that may have it.

        The greatest estimate must lead by more than two standard errors, and by more than the
        outcomes that all n samples missed can be worth, whose probability is hardly above 3 / n.
        """
        regrets = self.regrets
        if self.errors is None:
            return np.flatnonzero(regrets == 0.0)
        best = int(np.nanargmin(regrets))
        margins = MIN_LEAD_ERRORS * np.hypot(self.errors, self.errors[best])
        if self.return_bounds is not None:
            low, high = self.return_bounds
            unseen = np.fmax(high - self.q, self.q[best] - low)
            margins = np.fmax(margins, MAX_UNSEEN_SAMPLES / self.sample_count * unseen)
        margins[best] = 0.0
        return np.flatnonzero(regrets <= margins)

    @property
    def is_too_close(self) -> bool:
        """True if estimates do not tell which action is the best one."""
        return self.errors is not None and len(self.best_actions) > 1

    def rank_actions(self, first: float | None = None) -> list[int]:
        """Return the actions with finite values, best first; of equals, `first` first."""
        regrets = self.regrets.tolist()
        finite = np.flatnonzero(np.isfinite(self.q)).tolist()
        return sorted(finite, key=lambda action: (regrets[action], action != first))
