"""Solutions of problems of one agent whose finite state is hidden."""

from dataclasses import replace

import numpy as np

from dmplay import belief
from dmplay.budget import limit_total_work
from dmplay.chance import Ints
from dmplay.core import Problem
from dmplay.describe import format_count, format_upper_bound
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded
from dmplay.finding import agents
from dmplay.policies.point_based import PointBasedPolicy, format_bounds, suggest_more_work
from dmplay.policies.valued import MAX_HORIZON, NEGLIGIBLE_WEIGHT, FiniteHorizonPolicy
from dmplay.solutions.played import (
    DEFAULT_TURNS,
    resolve_horizon,
    resolve_work,
    solve_by_simulation,
)
from dmplay.solutions.solution import Row, Solution, format_action_names
from dmplay.solvers import alpha_vectors
from dmplay.solvers.alpha_vectors import AlphaVectorStage
from dmplay.solvers.value_iteration import mark_best_actions
from dmplay.tabular import tabulate

MAX_VECTOR_STATES = 3  # states whose every vector is worth listing
VECTOR_WORK_LIMIT = 4e9  # operations that listing them may take
MAX_SEARCH_TURNS = 100  # turns of a game: of longer ones a thousand are not searched


def solve_alpha_vectors(problem: Problem) -> Solution:
    """The alpha vectors of a game without end or, where that has no value, of some turns.

    Where there are too many, the bounds that are known without listing them. So where states have
    actions of their own: a vector does not tell which of them it is for.
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
    tables = tabulate(problem)
    start = belief.initial_belief(problem)
    turns = resolve_horizon(problem.horizon)
    found = agents.find_hint_provider(problem, 0, turns)
    counts = found is not None and found[1].plans_whole_game  # a game of so many turns
    usual = turns == DEFAULT_TURNS == problem.horizon and not counts
    far = turns is not None and problem.discount**turns < NEGLIGIBLE_WEIGHT
    if problem.discount < 1.0 and (turns is None or usual or far):
        stage: AlphaVectorStage = alpha_vectors.solve_infinite_horizon(tables, problem.discount)
        method = "alpha vectors, without end"
    else:
        stage = alpha_vectors.solve_finite_horizon(
            tables, problem.discount, turns or DEFAULT_TURNS
        )[-1]
        method = f"alpha vectors, {format_count(turns or DEFAULT_TURNS, 'turn')}"
    states = [problem.format_state(s) for s in problem.enumerate_states()]
    rows: list[Row] = [
        {f"at {name}": float(value) for name, value in zip(states, vector, strict=True)}
        | {"first": format_action_names(problem, able)}
        for vector, able in zip(stage.alpha_vectors, stage.first_action_mask, strict=True)
    ]
    value = float((stage.alpha_vectors @ start).max())
    more = f", at most {format_upper_bound(stage.gap)} more" if stage.gap else ""
    return Solution(
        method, f"{format_count(len(rows), 'vector')}; value {value:.6g} at the start{more}", rows
    )


def solve_first_actions(problem: Problem) -> Solution:
    """The value of each first action, by the agent that knows the optimum."""
    turns = resolve_horizon(problem.horizon) or (DEFAULT_TURNS if problem.discount >= 1.0 else None)
    found = agents.find_hint_provider(problem, 0, turns)
    if found is None:
        return solve_by_simulation(problem)
    name, agent = found
    try:
        if isinstance(agent, PointBasedPolicy):
            return _solve_bounds(agent, turns)
        q = agent.action_values(agent.initial_memory(np.full(1, -1)))
    except (BadPolicy, BudgetExceeded):  # more plans than can be listed
        if turns is not None and turns > MAX_SEARCH_TURNS:
            raise
        return solve_by_simulation(problem, ["search"])
    if q is None:
        return solve_by_simulation(problem)
    may = _find_legal_first_actions(problem)
    rows: list[Row] = [
        {"first": problem.format_action(0, a), "value": float(value), "best": "*" if able else ""}
        for a, value, able in zip(
            may.tolist(), q[0, may], mark_best_actions(q[0, may]), strict=True
        )
    ]
    ahead = (
        f", {format_count(agent.horizon, 'turn')} to go"
        if isinstance(agent, FiniteHorizonPolicy)
        else ""
    )
    told = f"value {q[0, may].max():.6g} at the start{ahead}"
    return Solution(f"the agent {name}", told, rows)


def _find_legal_first_actions(problem: Problem) -> Ints:
    """The actions that a state in which games start allows; all where each is over."""
    legal = problem.legal_actions_mask(
        problem.enumerate_states()[belief.initial_belief(problem) > 0]
    )
    some = np.ones(problem.action_counts[0], bool) if legal is None else legal[:, 0].any(axis=0)
    return np.flatnonzero(some if some.any() else ~some)


def _solve_bounds(agent: PointBasedPolicy, turns: int | None) -> Solution:
    """Two bounds of the value of each first action."""
    endless = agent.problem.discount < 1.0  # else a game of some turns is all there is
    if agent.planned_turns is None and turns is not None:
        if not endless and turns > MAX_HORIZON:
            needed = f"got {turns}, expected at most {MAX_HORIZON} where nothing is discounted"
            raise BadParameter(f"--turns: {needed}")
        if (
            not endless or turns <= MAX_SEARCH_TURNS
        ):  # however little the end counts, as so many are asked for
            agent = replace(agent, horizon=turns)
    agent = replace(agent, work=resolve_work())
    problem, may = agent.problem, _find_legal_first_actions(agent.problem)
    try:
        found = agent.bounds
    except BudgetExceeded:  # for so many turns
        if not endless:
            raise
        agent = replace(agent, horizon=0)
        found = agent.bounds
    each = zip(
        may.tolist(), found.action_lower_bounds[may], found.action_upper_bounds[may], strict=True
    )
    rows: list[Row] = [
        {
            "first": problem.format_action(0, a),
            "lower bound": float(low),
            "upper bound": float(high),
            "best": "*" if able else "",
        }
        for (a, low, high), able in zip(
            each, mark_best_actions(found.action_lower_bounds[may]), strict=True
        )
    ]
    span = format_count(agent.planned_turns, "turn") if agent.planned_turns else "without end"
    more = suggest_more_work(found, agent.work, "--work ")
    known = f"{format_bounds(found)}; {format_count(found.expanded_belief_count, 'belief')}{more}"
    return Solution(f"point-based, {span}", known, rows)
