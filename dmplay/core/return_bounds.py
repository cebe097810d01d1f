"""The smallest and the largest return that a game can have, from the bounds of its rewards."""

from math import ceil, log

from dmplay.core.problem import Problem
from dmplay.core.session import DEFAULT_TURN_LIMIT
from dmplay.core.tabular import Tabular

MIN_PLAYED_WEIGHT = 1e-9  # discount of a turn below which turns are not played
ROUNDING_TOLERANCE = 1e-9  # relative, of a sum of rewards


def compute_return_bounds(problem: Problem, turn_limit: int | None) -> tuple[float, float] | None:
    """Return the smallest and the largest return of a game of at most `turn_limit` turns.

    They allow for rounding errors, and are wider than necessary if a game may end early. None if
    rewards have no known bounds, or if their sum has none.
    """
    if problem.return_bounds is not None:
        return problem.return_bounds
    limit = turn_limit_or_default(problem, turn_limit)
    bounds = _find_reward_bounds(problem)
    if bounds is None or (limit is None and problem.discount == 1.0):
        return None
    weight = sum_discounts(problem.discount, limit) * (1.0 + ROUNDING_TOLERANCE)
    return min(bounds[0], 0.0) * weight, max(bounds[1], 0.0) * weight


def _find_reward_bounds(problem: Problem) -> tuple[float, float] | None:
    """Return the bounds of the rewards that a problem states, or those in its tables, or None."""
    if problem.reward_bounds is not None:
        return problem.reward_bounds
    if isinstance(problem, Tabular) and type(problem).resolve_events is Tabular.resolve_events:
        rewards = problem.sparse_tables.rewards
        return float(rewards.min()), float(rewards.max())
    return None


def turn_limit_or_default(problem: Problem, turn_limit: int | None) -> int | None:
    """Return the turn limit of a game of agents: the given one, the problem's own, or the default.

    None if games end by themselves, so that they need no limit.
    """
    default_limit = DEFAULT_TURN_LIMIT if problem.can_run_forever else None
    return (problem.horizon or default_limit) if turn_limit is None else turn_limit


def count_weighty_turns(problem: Problem) -> int | None:
    """Return the turns whose discount is at least MIN_PLAYED_WEIGHT, at most DEFAULT_TURN_LIMIT.

    None without discounting.
    """
    if problem.discount == 1.0:
        return None
    turns = log(MIN_PLAYED_WEIGHT) / log(problem.discount) if problem.discount else 1
    return min(ceil(turns), DEFAULT_TURN_LIMIT)


def sum_discounts(discount: float, turns: int | None) -> float:
    """Return the sum of the discount factors of `turns` turns, or of infinitely many."""
    if discount == 1.0:
        return float("inf") if turns is None else float(turns)
    return (1.0 - (0.0 if turns is None else discount**turns)) / (1.0 - discount)
