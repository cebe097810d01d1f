"""Solutions of finite, fully observed problems in which one agent at a time decides."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import ceil, log
from typing import NamedTuple

import numpy as np

from dmplay.agents.base import SeatPolicy
from dmplay.agents.fully_observable_problems import BackwardInductionPolicy
from dmplay.agents.single_agent_planning import MdpOptimalPolicy, list_action_values
from dmplay.core.action_values import Accuracy
from dmplay.core.arrays import Ints, Reals
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.problem import Problem, initial_state_distribution
from dmplay.core.tabular import tabulate
from dmplay.core.text import format_count, format_upper_bound, format_value
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget, scale_progress
from dmplay.errors import BadParameter
from dmplay.evaluation.solutions.options import resolve_horizon
from dmplay.evaluation.solutions.solution import (
    Row,
    Solution,
    list_marked_actions,
    make_informed_agent,
)
from dmplay.solvers.mdp import (
    backward_induction,
    large_mdp_value_iteration,
    mdp_values,
    transition_graph,
)
from dmplay.solvers.mdp.backward_induction import solve_by_backward_induction
from dmplay.solvers.mdp.transition_graph import TransitionGraph

MAX_SWEEPS = 10_000
CONVERGENCE_THRESHOLD = 1e-10  # change of the values below which sweeps stop, at a scale of 1
MAX_STATE_TURNS = 10_000_000  # up to which the value of a finite game is reported too
MAX_LISTED_STATES = 1000  # If there are more states, only the start states are listed.


def solve_mdp(problem: Problem) -> Solution:
    """Return the values of games of the requested turns, else of an infinite horizon.

    Without a discount, a problem with a horizon is solved only for that. With a discount, the
    value with its horizon follows the values of an infinite horizon.
    """
    horizon, requested_turns = resolve_horizon(problem.horizon), resolve_horizon(None)
    if horizon is not None and problem.discount == 1.0:
        return solve_finite_horizon(problem)
    if requested_turns is not None and requested_turns < _effective_horizon(problem.discount):
        _check_planned_turns(problem, requested_turns)
        return solve_finite_horizon(problem)
    is_small = isinstance(problem.state_count, int) and problem.state_count <= MAX_LISTED_STATES
    solution = solve_small_mdp(problem) if is_small else solve_by_value_iteration(problem)
    if horizon is None:
        return solution
    span = format_count(horizon, "turn")
    effective_turns = min(horizon, _effective_horizon(problem.discount))
    if len(problem.enumerate_states()) * effective_turns > MAX_STATE_TURNS:
        value_text = f"the value of {span} takes too long to compute; try fewer turns"
    else:
        finite = solve_by_backward_induction(problem, effective_turns)
        values = average_start_values(problem, finite.graph, finite.get_values(effective_turns))
        value_text = f"{format_start_values(problem, values)} with {span}"
    return replace(
        solution,
        method=f"{solution.method}, infinite horizon",
        result=f"{solution.result}; {value_text}",
    )


def _check_planned_turns(problem: Problem, turns: int) -> None:
    """Raise BadParameter if the values of games of `turns` turns take too much to compute."""
    state_count = len(problem.enumerate_states())
    max_turns = min(backward_induction.MAX_TURNS, MAX_STATE_TURNS // state_count)
    if turns > max_turns:
        raise BadParameter(
            f"turns: got {turns}, expected at most {max_turns} "
            f"for {format_count(state_count, 'state')}; without turns the horizon is infinite"
        )


def _effective_horizon(discount: float) -> int:
    """Return the number of turns after which discounted rewards are negligible.

    `discount` is below 1.
    """
    return ceil(log(CONVERGENCE_THRESHOLD) / log(discount)) if discount else 1


def solve_small_mdp(problem: Problem) -> Solution:
    """Return the values and best actions of every state, by value and policy iteration.

    The values are those of policy iteration, and the sweeps of value iteration confirm them.
    """
    tables = tabulate(problem)
    values = np.zeros(len(tables.transition))
    done, change, threshold = 0, np.inf, CONVERGENCE_THRESHOLD * problem.reward_scale
    budget = Budget("value iteration", "try fewer states, or the agent search", 1e10)
    while change >= threshold and done < MAX_SWEEPS:
        budget.spend_work(ARRAY_CALL_WORK + tables.transition.size, done / MAX_SWEEPS)
        next_values = mdp_values.compute_action_values(tables, problem.discount, values).max(axis=1)
        change = float(abs(next_values - values).max())
        values = next_values
        done += 1
    q = mdp_values.compute_optimal_q(tables, problem.discount)
    if problem.discount < 1.0 and change >= threshold:  # Sweeps converge too slowly.
        return _list_policy_iteration_values(problem, q)
    change_text = f"below {threshold:.2g}" if change < threshold else f"{change:.3g}"
    summary = f"last change {change_text} after {format_count(done, 'sweep')}"
    if problem.discount < 1.0:
        summary += f"; {abs(q.max(axis=1) - values).max():.1g} away from policy iteration"
    return _make_mdp_solution(problem, "value iteration", summary, q)


def solve_by_policy_iteration(problem: Problem) -> Solution:
    """Return the values and best actions of every state, by policy iteration."""
    if problem.discount == 1.0:
        raise BadParameter("policy iteration: got discount 1, expected a discount below 1")
    q = mdp_values.compute_optimal_q(tabulate(problem), problem.discount)
    return _list_policy_iteration_values(problem, q)


def _list_policy_iteration_values(problem: Problem, q: Reals) -> Solution:
    """Return the solution with Q `[S, A]` of policy iteration, and its largest error."""
    next_q = mdp_values.compute_action_values(tabulate(problem), problem.discount, q.max(axis=1))
    error = float(abs(next_q - q).max()) / (1.0 - problem.discount)
    precision = f"error at most {format_upper_bound(error)}" if error else "exact"
    return _make_mdp_solution(problem, "policy iteration", precision, q, error)


def _make_mdp_solution(
    problem: Problem, method: str, summary: str, q: Reals, error: float = 0.0
) -> Solution:
    """Return the solution that lists the values and best actions of all states, by Q `[S, A]`."""
    states = problem.enumerate_states()
    legal = problem.legal_actions_mask(states)
    legal_q = q
    if legal is not None:  # Without a legal action the game is over.
        legal_q = np.where(legal[:, 0] | ~legal[:, 0].any(axis=1, keepdims=True), q, -np.inf)
    table = [
        {
            "state": problem.format_state(s),
            "value": float(row.max()),
            "best": list_marked_actions(problem, mark_best_actions(row, problem.reward_scale)),
        }
        for s, row in zip(states, legal_q, strict=True)
    ]
    agent = make_informed_agent(MdpOptimalPolicy, {"_q": q})
    return Solution(method, summary, table, agent, Accuracy.EXACT, error)


class _GraphValues(NamedTuple):
    """The values of the states and joint actions of a graph."""

    graph: TransitionGraph
    values: Reals  # [S, n]
    deciding_seat: Ints  # [S]
    decider_q: Reals  # [R], of each joint action to the seat that decides


def solve_by_value_iteration(problem: Problem) -> Solution:
    """Return the values and best actions of one agent, infinite horizon, by value iteration.

    The states are swept backward from the terminal ones; there may be millions.
    """
    with scale_progress(0.0, 0.3):
        graphs = [transition_graph.build_full_graph(problem)]
    run_value_iteration = large_mdp_value_iteration.run_backward_value_iteration
    with scale_progress(0.3, 1.0):
        optimum = run_value_iteration(graphs.pop(), problem.discount)
    state_graph, gap = optimum.graph, format_upper_bound(optimum.gap)
    precision = f"error at most {gap}" if optimum.gap else "exact"
    if problem.discount == 1.0:
        precision = f"last change {gap}"
    single_seat = np.zeros(len(state_graph.states), np.int64)
    graph_values = _GraphValues(state_graph, optimum.values[:, None], single_seat, optimum.q)
    start_values = average_start_values(problem, state_graph, graph_values.values)
    value_text = format_start_values(problem, start_values)
    method = f"value iteration over {format_count(len(state_graph.states), 'state')}"
    if len(state_graph.nonterminal_states) < len(state_graph.states):
        method += ", backward from the terminal states"

    def make_agent(problem: Problem, seat: int) -> SeatPolicy:
        """Return the agent with these values."""
        q = list_action_values(problem, optimum)
        return make_informed_agent(MdpOptimalPolicy, {"_q": q})(problem, seat)

    return Solution(
        method,
        f"{value_text}, {precision}, {format_count(optimum.sweep_count, 'sweep')}",
        _build_state_rows(problem, graph_values),
        make_agent,
        Accuracy.EXACT,
        optimum.gap,
        start_values,
    )


def solve_finite_horizon(problem: Problem) -> Solution:
    """Return the values and best actions of a game that ends, for the seat that decides."""
    horizon = resolve_horizon(problem.horizon)
    result = solve_by_backward_induction(problem, horizon)
    next_values = result.get_values(None if horizon is None else horizon - 1)
    rows = np.arange(len(result.graph.rewards))
    q = result.graph.compute_action_values(rows, problem.discount, next_values)
    decider_q = q[rows, result.deciding_seats[result.graph.source_states]]
    values = result.get_values(horizon)
    graph_values = _GraphValues(result.graph, values, result.deciding_seats, decider_q)
    precision = "exact"
    if result.gap:
        precision = f"longer games differ by at most {format_upper_bound(result.gap)}"
    names = " and ".join(problem.agents[seat] for seat in sorted(result.indifferent_seats))
    if names:
        precision += f" if {names} at a tie chooses the first best action, on which others depend"
    span = "infinite horizon" if horizon is None else format_count(horizon, "turn")
    start_values = average_start_values(problem, result.graph, values)
    is_alone = len(problem.agents) == 1 and horizon is not None
    return Solution(
        f"backward induction over {format_count(len(next_values), 'state')}, {span}",
        f"{format_start_values(problem, start_values)}, {precision}",
        _build_state_rows(problem, graph_values),
        partial(MdpOptimalPolicy if is_alone else BackwardInductionPolicy, horizon=horizon or 0),
        Accuracy.EXACT,
        result.gap,
        start_values,
    )


def average_start_values(
    problem: Problem, state_graph: TransitionGraph, values: Reals
) -> tuple[float, ...]:
    """Return the value of the start to each agent, from values `[S, n]`."""
    probabilities, states = initial_state_distribution(problem)
    means = probabilities @ values[state_graph.find_state_indices(problem, states)]
    return tuple(means.tolist())


def format_start_values(problem: Problem, start_values: Sequence[float]) -> str:
    """Return a text with the value of the start to each agent."""
    texts = [format_value(value, problem.reward_scale) for value in start_values]
    if len(texts) == 1:
        return f"value {texts[0]} at the start"
    value_list = ", ".join(map("{} for {}".format, texts, problem.agents))
    return f"value {value_list} at the start"


def select_listed_states(problem: Problem, state_graph: TransitionGraph) -> Ints:
    """Return the indices of the states to list: all or, if many, those in which games start."""
    if len(state_graph.states) <= MAX_LISTED_STATES:
        return np.arange(len(state_graph.states))
    start_states = initial_state_distribution(problem)[1]
    indices = state_graph.find_state_indices(problem, start_states)
    return np.unique(indices)[:MAX_LISTED_STATES]


def _build_state_rows(problem: Problem, graph_values: _GraphValues) -> list[Row]:
    """Return the rows of the listed states, with their values and best actions."""
    return [
        _build_state_row(problem, graph_values, state_index)
        for state_index in select_listed_states(problem, graph_values.graph).tolist()
    ]


def _build_state_row(problem: Problem, graph_values: _GraphValues, state_index: int) -> Row:
    """Return the row of one state: its values, the agent that decides and the best actions."""
    state_graph, deciding_seat = graph_values.graph, int(graph_values.deciding_seat[state_index])
    row: Row = {"state": problem.format_transcript_state(state_graph.states[state_index])}
    action_rows = slice(*state_graph.action_starts[state_index : state_index + 2])
    mask = np.zeros(problem.action_counts[deciding_seat], bool)
    q = graph_values.decider_q[action_rows]
    if len(q):
        is_best = mark_best_actions(q, problem.reward_scale)
        mask[state_graph.joint_actions[action_rows, deciding_seat][is_best]] = True
    state_values = graph_values.values[state_index].tolist()
    if len(state_values) == 1:
        return row | {"value": state_values[0], "best": list_marked_actions(problem, mask)}
    value_columns = {
        f"value {agent}": value for agent, value in zip(problem.agents, state_values, strict=True)
    }
    row |= value_columns | {"to decide": problem.agents[deciding_seat] if mask.any() else ""}
    return row | {"best": list_marked_actions(problem, mask, deciding_seat)}
