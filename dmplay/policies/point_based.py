"""The agents that a hidden problem of one agent allows, however many its states."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import ceil, floor, log10
from typing import NamedTuple, Self

import numpy as np

from dmplay.budget import has_total_work_limit, limit_total_work
from dmplay.chance import Reals
from dmplay.core import Memory, Problem, parameter
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded
from dmplay.policies._believing import BeliefAndTurnPolicy
from dmplay.policies.kinds import GreedyPolicy
from dmplay.policies.valued import MAX_HORIZON, NEGLIGIBLE_WEIGHT
from dmplay.solvers import alpha_vectors, hidden_rows, point_based
from dmplay.solvers.point_based import PointBasedBounds, VectorsByAction
from dmplay.tabular import tabulate

MAX_EXACT_STATES = 4  # states of which alpha vectors are tried first
EXACT_WORK_LIMIT = 7e8  # operations that they may take
VALUE_DECIMALS = 9  # of a value: what lies beyond depends on which beliefs are valued together
ALWAYS_PLANNED_TURNS, MAX_PLANNED_TURNS = (
    10,
    100,
)  # turns of a game that is always planned to its end, or where it counts
MIN_WORK_FACTOR, MAX_WORK_FACTOR = 0.01, 100.0  # times the usual work
WORK_INCREASE_FACTOR = 10.0  # times as much work is advised
MAX_IGNORED_END_WEIGHT = (
    0.1  # what the end of a game of many states may count for, and not be planned to
)
CACHE_SIZE = 8  # plans


class BoundsRequest(NamedTuple):
    """What is to be solved."""

    problem: Problem
    horizon: int | None
    gap: float
    work: float


@dataclass(frozen=True)
class PointBasedPolicy(GreedyPolicy, BeliefAndTurnPolicy):
    """Earns the lower of two bounds of what its belief is worth, found at the beliefs that matter.

    They are `gap` apart, as a share of the value, or as close as the work allows.
    """

    horizon: int = parameter(0, "turns of a game; 0: as many as the problem has", 0, MAX_HORIZON)
    gap: float = parameter(0.01, "share of the value that its bounds may be apart", 0.0, 1.0)
    work: float = parameter(
        1.0, "times the usual work, which takes some ten seconds", MIN_WORK_FACTOR, MAX_WORK_FACTOR
    )

    plans_whole_game = True

    @property
    def planned_turns(self) -> int | None:
        """The turns that it plans; None without end, or where the end weighs nothing."""
        turns = self.horizon or self.problem.horizon
        return None if turns and self.problem.discount**turns < NEGLIGIBLE_WEIGHT else turns

    @property
    def bounds(self) -> PointBasedBounds:
        """What is known of the problem; the same is kept."""
        if self.planned_turns is None and self.problem.discount >= 1.0:
            raise BadPolicy("a game without end needs a discount below 1; --turns gives it one")
        return _cached_bounds(BoundsRequest(self.problem, self.planned_turns, self.gap, self.work))

    @property
    def hint_basis(self) -> str:
        """The bounds of the value at the start, where they are not close."""
        found = self.bounds
        return "" if found.is_gap_closed else f"point-based, {format_bounds(found)}"

    def describe_bounds(self, name: str) -> str:
        """The same by the name of who knows it, with how to know more."""
        plain, span = name.partition(":")[0], "" if self.planned_turns else " of a game without end"
        more = suggest_more_work(self.bounds, self.work, f"{plain}:work=")
        return f"{name}: {format_bounds(self.bounds)}{span}{more}"

    def action_values(self, memory: Memory) -> Reals:
        """Q of each action, from below, with the turns that are left; then it starts again."""
        b, done = memory
        plans = self.bounds.plans_by_turns_left
        if self.planned_turns is None:
            return _evaluate_plans(plans[0], b)
        left = self.planned_turns - done % self.planned_turns
        q = np.zeros((len(b), len(plans[0])))
        for turns in np.unique(left):
            q[left == turns] = _evaluate_plans(plans[turns], b[left == turns])
        return q

    def adapt_to_game(self, turns: int | None, rivals: Sequence[str]) -> Self:
        """One that plans the whole game, where that can be done in time."""
        if turns in (None, self.planned_turns) or not self._can_plan_to_end(turns or 0):
            return self
        return replace(self, horizon=turns)

    def _can_plan_to_end(self, turns: int) -> bool:
        """Whether the end of so many turns is in sight, and can be planned to."""
        few = (
            isinstance(self.problem.state_count, int)
            and self.problem.state_count <= MAX_EXACT_STATES
        )
        counts = (
            few
            or turns <= ALWAYS_PLANNED_TURNS
            or self.problem.discount**turns > MAX_IGNORED_END_WEIGHT
        )
        return turns <= MAX_PLANNED_TURNS and counts


@dataclass(frozen=True)
class PointBasedOptimalPolicy(PointBasedPolicy):
    """Earns what its belief is worth: exactly, or within a thousandth, or as close as it tells."""

    gap: float = parameter(0.001, "share of the value that its bounds may be apart", 0.0, 1.0)


def format_bounds(bounds: PointBasedBounds) -> str:
    """The value at the start, or its bounds in as many digits as tell them apart."""
    low, high = bounds.lower_bound, bounds.upper_bound
    apart = high - low
    if apart <= point_based.MIN_GAP:
        return f"value {low:.6g} at the start"
    places = 1 - floor(log10(apart))
    low, high = (side(one * 10**places) / 10**places for side, one in ((floor, low), (ceil, high)))
    return f"value {low:.{max(places, 0)}f} to {high:.{max(places, 0)}f} at the start"


def suggest_more_work(bounds: PointBasedBounds, work: float, option_text: str) -> str:
    """How to ask for closer bounds than with so much work, in words that end in a number."""
    if bounds.is_memory_full:
        return "; they are as close as memory allows"
    if bounds.is_gap_closed or work >= MAX_WORK_FACTOR:
        return ""
    return f"; more work brings them closer: {option_text}{min(WORK_INCREASE_FACTOR * work, MAX_WORK_FACTOR):g}"


def _evaluate_plans(plans: VectorsByAction, b: Reals) -> Reals:
    """The value `[B, A]` of the best plan of each action at beliefs `[B, S]`."""
    some = np.flatnonzero(b.any(axis=0))
    ahead = b[:, some]
    each = [(ahead @ vectors[:, some].T).max(axis=1) for vectors in plans]
    return np.round(np.stack(each, axis=1), VALUE_DECIMALS)


_bounds_cache: dict[
    BoundsRequest, tuple[PointBasedBounds, bool]
] = {}  # and whether with less work than there may be


def _cached_bounds(request: BoundsRequest) -> PointBasedBounds:
    """The bounds; those that were found in a hurry serve while there is hurry."""
    try:
        found, hurried = _bounds_cache.get(request, (None, False))
    except TypeError:  # a problem that cannot be told from others is solved anew
        return _solve_bounds(request)
    if found is None or (hurried and not has_total_work_limit()):
        found = _solve_bounds(request)
        while len(_bounds_cache) >= CACHE_SIZE:
            _bounds_cache.pop(next(iter(_bounds_cache)))
        _bounds_cache[request] = found, has_total_work_limit() and not found.is_gap_closed
    return found


def _solve_bounds(request: BoundsRequest) -> PointBasedBounds:
    """The bounds by alpha vectors where these are few, else by trials."""
    problem, horizon, gap, work = request
    if isinstance(problem.state_count, int) and problem.state_count <= MAX_EXACT_STATES:
        with suppress(BadParameter, BudgetExceeded), limit_total_work(EXACT_WORK_LIMIT):
            found = _solve_exactly(problem, horizon)
            if found.is_gap_closed:
                return found
    return point_based.solve_point_based(
        problem, horizon, gap, work * point_based.DEFAULT_WORK_LIMIT
    )


def _solve_exactly(problem: Problem, horizon: int | None) -> PointBasedBounds:
    """The values by alpha vectors, all of them."""
    tables, start = tabulate(problem), hidden_rows.compute_initial_joint(problem)
    if horizon is None:
        stages = [alpha_vectors.solve_infinite_horizon(tables, problem.discount)]
    else:
        stages = alpha_vectors.solve_finite_horizon(tables, problem.discount, horizon)
    plans = [tuple(one.alpha_vectors for one in stage.plans_by_action) for stage in stages]
    each = [start @ vectors.T for vectors in plans[-1]]
    value = float(np.max([one.max(axis=1) for one in each], axis=0).sum())
    first = np.array([one.max(axis=1).sum() for one in each])
    over = [] if horizon is None else [tuple(np.zeros_like(one[:1]) for one in plans[0])]
    close = not stages[-1].gap
    return PointBasedBounds(value, value, first, first, (*over, *plans), len(start), close)
