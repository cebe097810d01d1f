"""The mean regret of each seat in many games, by the agent that gives the hints of the game."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dmplay.agents.base import AdviceQuestion
from dmplay.agents.script import Script
from dmplay.core.arrays import Ints, Reals
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.core.return_bounds import MIN_PLAYED_WEIGHT, turn_limit_or_default
from dmplay.core.text import format_number
from dmplay.evaluation.statistics import Estimate, estimate_mean, estimate_ratio
from dmplay.game.turn_facts import Row
from dmplay.registry.agents import HintAgent, find_agent_name, find_hint_provider


class RegretSummary(NamedTuple):
    """The regret of one seat, as lower and upper bounds, which are equal if it is exact.

    There are no estimates if the regret is unknown; `basis` is then the reason.
    """

    per_game: tuple[Estimate, Estimate] | None  # discounted, as the return is
    per_choice: tuple[Estimate, Estimate] | None  # the mean of all choices, not discounted
    basis: str  # the agent whose values tell the regret, and the game that they are about

    @property
    def is_exact(self) -> bool:
        """True if the regret is known exactly in each game."""
        return self.per_game is not None and self.per_game[0] == self.per_game[1]

    def __str__(self) -> str:
        """Return the mean regret of a game, the means between which it lies, or "unknown"."""
        if self.per_game is None:
            return "unknown"
        means = dict.fromkeys(format_number(bound.mean, 5) for bound in self.per_game)
        return f"{' to '.join(means)} per game"

    def make_row(self) -> Row:
        """Return the regret as columns of data, which are empty if it is unknown."""
        columns: Row = {}
        for name, bounds in (("regret", self.per_game), ("choice regret", self.per_choice)):
            low, high = bounds or (None, None)
            columns[name] = low and low.mean
            columns[f"{name} error"] = low and low.standard_error
            columns[f"{name} at most"] = high and high.mean
        return {**columns, "regret by": self.basis}


def find_regret_meters(
    problem: Problem, policies: Sequence[Policy], turn_limit: int | None
) -> list[HintAgent | None]:
    """Return the agent that values the choices of each seat beside these policies, or None."""
    limit = turn_limit_or_default(problem, turn_limit)
    if limit is not None and problem.discount**limit <= MIN_PLAYED_WEIGHT:
        limit = None
    names = tuple(find_agent_name(problem, seat, policy) for seat, policy in enumerate(policies))
    scripts = tuple(policy for policy in policies if isinstance(policy, Script))
    questions = [AdviceQuestion(seat, limit, names, scripts=scripts) for seat in range(len(names))]
    return [find_hint_provider(problem, question) for question in questions]


def summarize_regret(meter: HintAgent | None, regrets: Reals, choice_counts: Ints) -> RegretSummary:
    """Return the regret of a seat from the sums `[E, 2, 2]` and the choices `[E]` of its games."""
    if meter is None:
        return RegretSummary(None, None, "no agent can compute the values of these actions")
    reason = meter.explain_unknown_regrets()
    if not reason and not np.isfinite(regrets).all():
        reason = f"the values of {meter.base_name} have no bounds"
    if reason:
        return RegretSummary(None, None, reason)
    basis = ", ".join(filter(None, (meter.base_name, meter.describe_game(0))))
    low, high = (estimate_mean(regrets[:, 0, bound]) for bound in range(2))
    choice_low, choice_high = (
        estimate_ratio(regrets[:, 1, bound], choice_counts) for bound in (0, 1)
    )
    return RegretSummary((low, high), (choice_low, choice_high), basis)
