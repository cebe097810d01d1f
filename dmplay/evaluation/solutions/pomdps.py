"""Solutions of problems of one agent with finitely many hidden states."""

from dataclasses import replace

import numpy as np

from dmplay.agents.belief_policy_bases import MAX_HORIZON, NEGLIGIBLE_WEIGHT, FiniteHorizonPolicy
from dmplay.agents.point_based import (
    PointBasedOptimalPolicy,
    PointBasedPolicy,
    format_bounds,
    suggest_more_work,
)
from dmplay.core import belief
from dmplay.core.arrays import Ints
from dmplay.core.problem import Problem
from dmplay.core.tabular import tabulate
from dmplay.core.text import format_count, format_upper_bound
from dmplay.core.work_budget import limit_total_work
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded
from dmplay.evaluation.solutions.simulated_returns import (
    DEFAULT_TURNS,
    resolve_horizon,
    resolve_work,
    solve_by_simulation,
)
from dmplay.evaluation.solutions.solution import Row, Solution, format_action_names
from dmplay.registry import agents
from dmplay.solvers.mdp.mdp_values import mark_best_actions
from dmplay.solvers.pomdp import exact_pomdp
from dmplay.solvers.pomdp.exact_pomdp import AlphaVectorStage

MAX_VECTOR_STATES = 3  # states, up to which every vector is listed
VECTOR_WORK_LIMIT = 4e9  # to list the vectors
MAX_SEARCH_TURNS = 100  # in longer games search is not simulated


def solve_alpha_vectors(problem: Problem) -> Solution:
    """Return the alpha vectors of an infinite horizon or, if that has no value, of some turns.

    If they are too many, return the value of each first action, which needs no list of them.
    Likewise if states have actions of their own: a vector does not say which of them it is for.
    """
    legal = problem.legal_actions_mask(problem.enumerate_states())
    if legal is not None and not legal.all():
        return solve_first_actions(problem)
    try:
        with limit_total_work(VECTOR_WORK_LIMIT):
            return _list_alpha_vectors(problem)
    except (BadParameter, BudgetExceeded):
        return solve_first_actions(problem)


def _list_alpha_vectors(problem: Problem) -> Solution:
    """Return the alpha vectors as a solution; raise BudgetExceeded if they are too many."""
    tables = tabulate(problem)
    start = belief.initial_belief(problem)
    turns = resolve_horizon(problem.horizon)
    hint_agent = agents.find_hint_provider(problem, 0, turns)
    plans_whole_game = hint_agent is not None and hint_agent[1].plans_whole_game
    is_default = (
        resolve_horizon(None) is None
        and turns == DEFAULT_TURNS == problem.horizon
        and not plans_whole_game
    )
    is_long = turns is not None and problem.discount**turns < NEGLIGIBLE_WEIGHT
    if problem.discount < 1.0 and (turns is None or is_default or is_long):
        stage: AlphaVectorStage = exact_pomdp.solve_infinite_horizon(tables, problem.discount)
        method = "alpha vectors, without end"
    else:
        stage = exact_pomdp.solve_finite_horizon(tables, problem.discount, turns or DEFAULT_TURNS)[
            -1
        ]
        method = f"alpha vectors, {format_count(turns or DEFAULT_TURNS, 'turn')}"
    states = [problem.format_state(s) for s in problem.enumerate_states()]
    rows: list[Row] = [
        {f"at {name}": float(value) for name, value in zip(states, vector, strict=True)}
        | {"first": format_action_names(problem, mask)}
        for vector, mask in zip(stage.alpha_vectors, stage.first_action_mask, strict=True)
    ]
    value = float((stage.alpha_vectors @ start).max())
    gap_text = f", at most {format_upper_bound(stage.gap)} more" if stage.gap else ""
    return Solution(
        method,
        f"{format_count(len(rows), 'vector')}; value {value:.6g} at the start{gap_text}",
        rows,
    )


def solve_first_actions(problem: Problem) -> Solution:
    """Return the value of each first action, computed by the agent that knows the optimum.

    A simulation stands in if there is no such agent or it knows no values.
    """
    turns = resolve_horizon(problem.horizon) or (DEFAULT_TURNS if problem.discount >= 1.0 else None)
    hint_agent = agents.find_hint_provider(problem, 0, turns)
    if hint_agent is None:
        return solve_by_simulation(problem)
    name, agent = hint_agent.name, hint_agent.policy
    try:
        if isinstance(agent, FiniteHorizonPolicy) and turns and agent.horizon < turns:
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
    rows: list[Row] = [
        {
            "first": problem.format_action(0, a),
            "value": float(value),
            "best": "*" if is_best else "",
        }
        for a, value, is_best in zip(
            legal.tolist(), q[0, legal], mark_best_actions(q[0, legal]), strict=True
        )
    ]
    horizon_text = (
        f", {format_count(agent.horizon, 'turn')} to go"
        if isinstance(agent, FiniteHorizonPolicy)
        else ""
    )
    summary = f"value {q[0, legal].max():.6g} at the start{horizon_text}"
    return Solution(f"the agent {name}", summary, rows)


def _find_legal_first_actions(problem: Problem) -> Ints:
    """Return the actions that some start state allows; all if none allows any."""
    legal = problem.legal_actions_mask(
        problem.enumerate_states()[belief.initial_belief(problem) > 0]
    )
    is_legal = np.ones(problem.action_counts[0], bool) if legal is None else legal[:, 0].any(axis=0)
    return np.flatnonzero(is_legal if is_legal.any() else ~is_legal)


def _plan_turns(agent: PointBasedPolicy, turns: int | None) -> PointBasedPolicy:
    """Return the agent that plans a game of `turns` turns, or without end if the end counts little.

    Raise BadParameter if it cannot plan as many turns and the end counts.
    """
    problem = agent.problem
    if turns is None or agent.planned_turns == turns:
        return agent
    is_discounted = problem.discount < 1.0
    if is_discounted and problem.horizon is None and turns > MAX_SEARCH_TURNS:
        return agent  # The method says that it is the plan without end.
    if turns > MAX_HORIZON and problem.discount**MAX_HORIZON >= NEGLIGIBLE_WEIGHT:
        where = "" if is_discounted else " where nothing is discounted"
        raise BadParameter(f"--turns: got {turns}, expected at most {MAX_HORIZON}{where}")
    return replace(agent, horizon=min(turns, MAX_HORIZON))


def _solve_bounds(agent: PointBasedPolicy, turns: int | None) -> Solution:
    """Return a lower and an upper bound on the value of each first action."""
    agent = _plan_turns(agent, turns)
    agent = replace(agent, work=resolve_work())
    problem, legal = agent.problem, _find_legal_first_actions(agent.problem)
    try:
        bounds = agent.bounds
    except BudgetExceeded:  # for this many turns
        if problem.discount == 1.0 or problem.horizon is not None:
            raise
        agent = replace(agent, horizon=0)
        bounds = agent.bounds
    action_bounds = zip(
        legal.tolist(),
        bounds.action_lower_bounds[legal],
        bounds.action_upper_bounds[legal],
        strict=True,
    )
    rows: list[Row] = [
        {
            "first": problem.format_action(0, a),
            "lower bound": float(low),
            "upper bound": float(high),
            "best": "*" if is_best else "",
        }
        for (a, low, high), is_best in zip(
            action_bounds, mark_best_actions(bounds.action_lower_bounds[legal]), strict=True
        )
    ]
    span = format_count(agent.planned_turns, "turn") if agent.planned_turns else "without end"
    remedy = suggest_more_work(bounds, agent.work, "--work ")
    summary = (
        f"{format_bounds(bounds)}; {format_count(bounds.expanded_belief_count, 'belief')}{remedy}"
    )
    return Solution(f"point-based, {span}", summary, rows)
