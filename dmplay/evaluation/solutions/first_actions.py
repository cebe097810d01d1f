"""The value of each first action of one agent with finitely many hidden states."""

from dataclasses import replace
from typing import cast

import numpy as np

from dmplay.agents.base import AdviceQuestion, SeatPolicy
from dmplay.agents.horizon import MAX_HORIZON, MIN_PLANNED_WEIGHT, HorizonPolicy
from dmplay.agents.point_based import (
    PointBasedOptimalPolicy,
    PointBasedPolicy,
    format_bounds,
    suggest_closer_bounds,
)
from dmplay.agents.single_agent_planning import RecedingHorizonPolicy
from dmplay.core import belief
from dmplay.core.action_values import Accuracy
from dmplay.core.arrays import Bools, Ints, Reals
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.problem import Problem
from dmplay.core.text import format_count, format_value
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded
from dmplay.evaluation.solutions.options import DEFAULT_TURNS, resolve_bounds_work, resolve_horizon
from dmplay.evaluation.solutions.simulated_returns import solve_by_simulation
from dmplay.evaluation.solutions.solution import Row, Solution
from dmplay.registry import agents

MAX_SEARCH_TURNS = 100  # in longer games search is not simulated


def solve_first_actions(problem: Problem) -> Solution:
    """Return the value of each first action, computed by the agent that knows the optimum.

    A simulation stands in if there is no such agent or it knows no values.
    """
    turns = resolve_horizon(problem.horizon) or (DEFAULT_TURNS if problem.discount >= 1.0 else None)
    hint_agent = agents.find_hint_provider(problem, AdviceQuestion(0, turns))
    name, agent = "optimal", cast(SeatPolicy, PointBasedOptimalPolicy(problem, 0))
    is_bounded = hint_agent is None or isinstance(hint_agent.policy, PointBasedPolicy)
    if hint_agent and not is_bounded and hint_agent.basis.accuracy is Accuracy.EXACT:
        name, agent = hint_agent.name, hint_agent.policy
    try:
        if turns and (_count_planned_turns(agent) or turns) < turns:
            # The agent plans fewer turns at a time than the game has.
            agent = PointBasedOptimalPolicy(problem, 0)
        if isinstance(agent, PointBasedPolicy):
            return _solve_bounds(agent, turns)
        q = agent.action_values(agent.initial_memory(np.full(1, -1)))
    except (BadPolicy, BudgetExceeded):  # There are more plans than can be listed.
        if turns is not None and turns > MAX_SEARCH_TURNS:
            raise
        return solve_by_simulation(problem, ["search"])
    if q is None:
        return solve_by_simulation(problem)
    legal = _find_legal_first_actions(problem)
    rows = _build_action_rows(
        problem, {"value": q[0]}, mark_best_actions(q[0, legal], problem.reward_scale), legal
    )
    horizon = _count_planned_turns(agent)
    horizon_text = f", {format_count(horizon, 'turn')} left" if horizon else ""
    value = float(q[0, legal].max())
    summary = f"value {format_value(value, problem.reward_scale)} at the start{horizon_text}"
    return Solution(
        f"agent {name}",
        summary,
        rows,
        lambda problem, seat: agent,
        Accuracy.EXACT,
        start_values=(value,),
    )


def solve_by_point_based_bounds(problem: Problem) -> Solution:
    """Return bounds on the value of each first action, by point-based planning."""
    turns = resolve_horizon(problem.horizon) or (DEFAULT_TURNS if problem.discount >= 1.0 else None)
    return _solve_bounds(PointBasedOptimalPolicy(problem, 0), turns)


def _build_action_rows(
    problem: Problem, columns: dict[str, Reals], is_best: Bools, legal: Ints
) -> list[Row]:
    """Return a row for each legal action, with its numbers in columns `[A]` and its mark."""
    rows: list[Row] = []
    for a, mark in zip(legal.tolist(), is_best, strict=True):
        row: Row = {"first": problem.format_action(0, a)}
        row |= {name: float(numbers[a]) for name, numbers in columns.items()}
        rows.append(row | {"best": bool(mark)})
    return rows


def _count_planned_turns(agent: SeatPolicy) -> int | None:
    """Return the number of turns of a plan, or that an agent plans ahead; None of other agents."""
    if isinstance(agent, RecedingHorizonPolicy):
        return agent.horizon
    return agent.game_turns if isinstance(agent, HorizonPolicy) and agent.repeats_plan else None


def _find_legal_first_actions(problem: Problem) -> Ints:
    """Return the actions that some start state allows; all if none allows any."""
    start_states = problem.enumerate_states()[belief.initial_belief(problem) > 0]
    legal = problem.legal_actions_mask(start_states)
    is_legal = np.ones(problem.action_counts[0], bool) if legal is None else legal[:, 0].any(axis=0)
    return np.flatnonzero(is_legal if is_legal.any() else ~is_legal)


def _make_agent_for_turns(agent: PointBasedPolicy, turns: int | None) -> PointBasedPolicy:
    """Return the agent that plans a game of `turns` turns, or an infinite horizon if that is close.

    Raise BadParameter if it cannot plan as many turns and the end counts.
    """
    problem = agent.problem
    if turns is None or agent.game_turns == turns:
        return agent
    is_discounted = problem.discount < 1.0
    if is_discounted and problem.horizon is None and turns > MAX_SEARCH_TURNS:
        return agent  # The method names the infinite horizon.
    if turns > MAX_HORIZON and problem.discount**MAX_HORIZON >= MIN_PLANNED_WEIGHT:
        where = "" if is_discounted else " without a discount"
        raise BadParameter(f"turns: got {turns}, expected at most {MAX_HORIZON}{where}")
    return replace(agent, horizon=min(turns, MAX_HORIZON))


def _solve_bounds(agent: PointBasedPolicy, turns: int | None) -> Solution:
    """Return a lower and an upper bound on the value of each first action."""
    agent = _make_agent_for_turns(agent, turns)
    agent = replace(agent, work=resolve_bounds_work())
    problem, legal = agent.problem, _find_legal_first_actions(agent.problem)
    try:
        bounds = agent.bounds
    except BudgetExceeded:  # for this many turns
        if problem.discount == 1.0 or problem.horizon is not None:
            raise
        agent = replace(agent, horizon=0)
        bounds = agent.bounds
    lower, upper = bounds.action_lower_bounds, bounds.action_upper_bounds
    marks = np.asarray(upper[legal] >= lower[legal].max() - bounds.min_gap)
    rows = _build_action_rows(problem, {"lower bound": lower, "upper bound": upper}, marks, legal)
    span = format_count(agent.game_turns, "turn") if agent.game_turns else "infinite horizon"
    remedy = suggest_closer_bounds(bounds, agent.work, "work=")
    if bounds.upper_bound - bounds.lower_bound > bounds.min_gap and marks.sum() > 1:
        remedy = f"; the bounds of {marks.sum()} actions overlap{remedy}"
    beliefs = format_count(bounds.expanded_belief_count, "belief")
    summary = f"{format_bounds(bounds)}; {beliefs}{remedy}"
    return Solution(
        f"point-based, {span}",
        summary,
        rows,
        lambda problem, seat: agent,
        Accuracy.EXACT if bounds.has_all_vectors else Accuracy.LOWER_BOUND,
        start_values=(bounds.lower_bound,),
        start_bounds=(bounds.lower_bound, bounds.upper_bound),
    )
