"""Agents for any partially observable problem of one agent, whatever its number of states."""

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, floor, log10
from typing import NamedTuple

import numpy as np

from dmplay.agents.base import AdviceQuestion
from dmplay.agents.belief_policy import GreedyBeliefPolicy
from dmplay.agents.horizon import MAX_HORIZON, MIN_PLANNED_WEIGHT, HorizonPolicy
from dmplay.agents.single_agent_planning import FastInformedBound
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory
from dmplay.core.problem import Problem
from dmplay.core.tabular import tabulate
from dmplay.core.text import format_number
from dmplay.core.work_budget import has_total_work_limit, limit_total_work
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded, DmplayError
from dmplay.solvers.pomdp import exact_pomdp, point_based, sparse_pomdp
from dmplay.solvers.pomdp.point_based import PointBasedBounds

MAX_EXACT_STATES = 4  # maximum number of states for which exact alpha vectors are tried first
EXACT_WORK_LIMIT = 7e8  # operations that the exact solution may take
# decimals of a value at a scale of 1; further ones depend on which beliefs are evaluated together
VALUE_DECIMALS = 9
# turns up to which a game is always planned to its end, or only if its end matters
ALWAYS_PLANNED_TURNS, MAX_PLANNED_TURNS = 10, 100
MIN_WORK_FACTOR, MAX_WORK_FACTOR = 0.01, 100.0  # bounds of the factor on the default work
WORK_INCREASE_FACTOR = 10.0  # factor by which more work is suggested
# discount**turns up to which the end of a game with many states is ignored
MAX_IGNORED_END_WEIGHT = 0.1
CACHE_SIZE = 8  # maximum number of cached bounds


class BoundsRequest(NamedTuple):
    """A problem to solve, with its horizon, relative gap and work factor."""

    problem: Problem
    horizon: int | None
    gap: float
    work: float


@dataclass(frozen=True)
class PointBasedPolicy(HorizonPolicy, GreedyBeliefPolicy):
    """Takes the action with the highest lower bound on its value, by point-based value iteration.

    The lower and the upper bound are at most `gap` apart, as a share of the value, or as close as
    the work allows.
    """

    horizon: int = parameter(0, "turns of a game; 0: the problem's horizon, if any", 0, MAX_HORIZON)
    gap: float = parameter(0.01, "largest gap of the bounds, as a share of the value", 0.0, 1.0)
    work: float = parameter(
        1.0, "factor on the work; 1 takes about ten seconds", MIN_WORK_FACTOR, MAX_WORK_FACTOR
    )

    plans_whole_game = True
    repeats_plan = True

    @property
    def game_turns(self) -> int | None:
        """The number of turns planned; None without an end or if its weight is negligible."""
        turns = self.horizon or self.problem.horizon
        return None if turns and self.problem.discount**turns < MIN_PLANNED_WEIGHT else turns

    @property
    def bounds(self) -> PointBasedBounds:
        """The bounds on the problem's value, which are cached.

        Raises BadPolicy for an infinite horizon if the discount is 1.
        """
        if self.game_turns is None and self.problem.discount >= 1.0:
            raise BadPolicy("an infinite horizon needs a discount below 1; or set --turns")
        return _get_cached_bounds(BoundsRequest(self.problem, self.game_turns, self.gap, self.work))

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return exact values if all alpha vectors are known, else lower bounds.

        The bounds on the value at the start are named until their gap is closed. Without a turn
        limit the turns are those of the problem.
        """
        bounds, turns = self.bounds, question.turn_limit or self.game_turns
        accuracy = Accuracy.EXACT if bounds.has_all_vectors else Accuracy.LOWER_BOUND
        method = "" if bounds.is_gap_closed else f"point-based, {format_bounds(bounds)}"
        basis = super().values_basis(replace(question, turn_limit=turns))
        return basis._replace(accuracy=accuracy, method=method)

    def describe_bounds(self, name: str) -> str:
        """Return the bounds after the agent's `name`, and how to request closer ones."""
        horizon_note = "" if self.game_turns else ", infinite horizon"
        suggestion = suggest_closer_bounds(
            self.bounds, self.work, f"{name.partition(':')[0]}:work="
        )
        return f"{name}: {format_bounds(self.bounds)}{horizon_note}{suggestion}"

    def values_with_turns_left(self, info_state: Reals, turns_left: int | None) -> Reals:
        """Return lower bounds of Q `[B, A]` of beliefs `[B, S]` with these rewards to come.

        They are the values of the best plan of each first action.
        """
        plans, scale = self.bounds.plans_by_turns_left[turns_left or 0], self.problem.reward_scale
        support = np.flatnonzero(info_state.any(axis=0))
        b = info_state[:, support]
        q = np.stack([(b @ vectors[:, support].T).max(axis=1) for vectors in plans], axis=1)
        rounded_q = scale * np.round(q / scale, VALUE_DECIMALS)
        return self._move_values_to_legal_action(info_state, rounded_q)

    def value_bounds(self, memory: Memory, actions: Array) -> tuple[Reals, Reals] | None:
        """Return the value of the best known plan, and the fast informed bound, of an action."""
        informed = FastInformedBound(self.problem, self.seat)
        try:
            high = self.apply_by_turns_left(informed.values_with_turns_left, memory)
        except DmplayError:  # too many states for its tables
            return None
        rows = np.arange(len(actions))
        low, high = self.action_values(memory)[rows, actions], high[rows, actions]
        return low, np.maximum(low, high)

    @cached_property
    def _legal_by_state(self) -> Bools | None:
        """The legal actions of each state `[S, A]`; None if all are legal."""
        legal = self.problem.legal_actions_mask(self.problem.enumerate_states())
        return None if legal is None else legal[:, 0]

    def _move_values_to_legal_action(self, b: Reals, q: Reals) -> Reals:
        """Return the values `[B, A]`, with the best one of illegal actions for the first legal one.

        The solver takes an illegal action for the first legal one (`replace_illegal_actions`), so
        that plans which begin with the latter may be stored under the former. All possible states
        of a belief have the same legal actions.
        """
        if self._legal_by_state is None:
            return q
        legal = self._legal_by_state[b.argmax(axis=1)]
        rows, first_legal = np.arange(len(q)), legal.argmax(axis=1)
        best_illegal = np.where(legal, -np.inf, q).max(axis=1)
        q = q.copy()
        q[rows, first_legal] = np.maximum(q[rows, first_legal], best_illegal)
        return q

    def can_plan_turns(self, turns: int) -> bool:
        """Return whether the end of a game of `turns` turns matters and can be planned to."""
        end_matters = (
            _has_few_states(self.problem)
            or turns <= ALWAYS_PLANNED_TURNS
            or self.problem.discount**turns > MAX_IGNORED_END_WEIGHT
        )
        return turns <= MAX_PLANNED_TURNS and end_matters


@dataclass(frozen=True)
class PointBasedOptimalPolicy(PointBasedPolicy):
    """Takes the best action for its belief: exact, or within bounds that are reported."""

    gap: float = parameter(0.001, "largest gap of the bounds, as a share of the value", 0.0, 1.0)


def _has_few_states(problem: Problem) -> bool:
    """Return whether a problem has so few states that exact alpha vectors are tried first."""
    return isinstance(problem.state_count, int) and problem.state_count <= MAX_EXACT_STATES


def format_bounds(bounds: PointBasedBounds) -> str:
    """Return the value at the start, or its bounds with enough digits to tell them apart."""
    low, high = bounds.lower_bound, bounds.upper_bound
    gap = high - low
    if gap <= bounds.min_gap:
        return f"value {format_number(low)} at the start"
    decimals = 1 - floor(log10(gap))
    low, high = floor(low * 10**decimals) / 10**decimals, ceil(high * 10**decimals) / 10**decimals
    return f"value {low:.{max(decimals, 0)}f} to {high:.{max(decimals, 0)}f} at the start"


def suggest_closer_bounds(bounds: PointBasedBounds, work: float, option_text: str) -> str:
    """Return a note on how to get closer bounds than with this work; '' if none are needed.

    A suggestion of more work ends in the work factor. The bounds cannot get closer if memory is
    full.
    """
    if bounds.is_memory_full:
        return "; memory allows no closer bounds"
    if bounds.is_gap_closed or work >= MAX_WORK_FACTOR:
        return ""
    more_work = min(WORK_INCREASE_FACTOR * work, MAX_WORK_FACTOR)
    return f"; for closer bounds: {option_text}{more_work:g}"


# the bounds, and whether they are not closed because of a limit on the total work
_bounds_cache: dict[BoundsRequest, tuple[PointBasedBounds, bool]] = {}


def _get_cached_bounds(request: BoundsRequest) -> PointBasedBounds:
    """Return the cached bounds of a problem, or solve it.

    Bounds that were computed under a limit on the total work are used only while there is a limit.
    """
    try:
        bounds, was_limited = _bounds_cache.get(request, (None, False))
    except TypeError:  # an unhashable problem is solved again each time
        return _solve_bounds(request)
    if bounds is None or (was_limited and not has_total_work_limit()):
        bounds = _solve_bounds(request)
        while len(_bounds_cache) >= CACHE_SIZE:
            _bounds_cache.pop(next(iter(_bounds_cache)))
        _bounds_cache[request] = bounds, has_total_work_limit() and not bounds.is_gap_closed
    return bounds


def _solve_bounds(request: BoundsRequest) -> PointBasedBounds:
    """Return the bounds by exact alpha vectors if states are few, else by point-based trials."""
    problem, horizon, gap, work = request
    if _has_few_states(problem):
        with suppress(BadParameter, BudgetExceeded), limit_total_work(EXACT_WORK_LIMIT):
            bounds = _solve_exactly(problem, horizon)
            if bounds.is_gap_closed:
                return bounds
    work_limit = work * point_based.DEFAULT_WORK_LIMIT
    return point_based.solve_point_based(problem, horizon, gap, work_limit)


def _solve_exactly(problem: Problem, horizon: int | None) -> PointBasedBounds:
    """Return bounds from all alpha vectors, the lower one equal to the upper one."""
    tables, initial_joint = (
        tabulate(problem),
        sparse_pomdp.compute_initial_joint_probabilities(problem),
    )
    if horizon is None:
        stages = [exact_pomdp.solve_infinite_horizon(tables, problem.discount)]
    else:
        stages = exact_pomdp.solve_finite_horizon(tables, problem.discount, horizon)
    plans = [tuple(item.alpha_vectors for item in stage.plans_by_action) for stage in stages]
    plan_values = [initial_joint @ vectors.T for vectors in plans[-1]]
    value = float(np.max([item.max(axis=1) for item in plan_values], axis=0).sum())
    first_action_values = np.array([item.max(axis=1).sum() for item in plan_values])
    ended_plans = [] if horizon is None else [tuple(np.zeros_like(item[:1]) for item in plans[0])]
    q, count, close = first_action_values, len(initial_joint), not stages[-1].gap
    plans = [*ended_plans, *plans]
    return PointBasedBounds(value, value, q, q, tuple(plans), count, close, has_all_vectors=close)
