"""Solutions of problems in which a finite state is seen and one agent at a time decides."""

from math import ceil, log
from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget, scale_progress
from dmplay.chance import Ints, Reals
from dmplay.core import Problem, initial_state_distribution
from dmplay.describe import format_count, format_upper_bound
from dmplay.policies import seeing
from dmplay.solutions.played import resolve_horizon
from dmplay.solutions.solution import Row, Solution, format_action_names
from dmplay.solvers import backward_sweeps, graph, value_iteration
from dmplay.solvers.graph import TransitionGraph
from dmplay.solvers.value_iteration import mark_best_actions
from dmplay.tabular import tabulate

MAX_SWEEPS = 10_000  # at most
CONVERGENCE_THRESHOLD = 1e-10  # a change that ends them
VALUE_DECIMALS = 9  # after the point, of what the start is worth
MAX_STATE_TURNS = (
    10_000_000  # turns in all states that are planned to tell what a game of some is worth
)
MAX_LISTED_STATES = 1000  # states whose values are told; of more, those in which games start


def solve_mdp(problem: Problem) -> Solution:
    """What is best for one agent in a game without end, and what a game of so many turns is worth.

    Where nothing is discounted there is none but that.
    """
    horizon = resolve_horizon(problem.horizon)
    if problem.discount == 1.0 and horizon is not None:
        return solve_finite_horizon(problem)
    few = isinstance(problem.state_count, int) and problem.state_count <= MAX_LISTED_STATES
    found = solve_by_value_iteration(problem) if few else solve_infinite_horizon(problem)
    if horizon is None:
        return found
    span = format_count(horizon, "turn")
    ahead = min(horizon, _effective_horizon(problem.discount))
    if len(problem.enumerate_states()) * ahead > MAX_STATE_TURNS:
        told = f"what {span} are worth takes too much to tell; try fewer"
    else:
        within = seeing.solve_by_backward_induction(problem, ahead)
        told = f"{format_start_values(problem, within.graph, within.get_values(ahead))} of {span}"
    return found._replace(result=f"{found.result}; {told}")


def _effective_horizon(discount: float) -> int:
    """The turns that count where later ones are discounted so; `discount` below 1."""
    return ceil(log(CONVERGENCE_THRESHOLD) / log(discount)) if discount else 1


def solve_by_value_iteration(problem: Problem) -> Solution:
    """Values and best actions of every state."""
    tables = tabulate(problem)
    values = np.zeros(len(tables.transition))
    done, change = 0, np.inf
    budget = Budget("value iteration", "try fewer states, or play search", 1e10)
    while change >= CONVERGENCE_THRESHOLD and done < MAX_SWEEPS:
        budget.spend_work(ARRAY_CALL_WORK + tables.transition.size, done / MAX_SWEEPS)
        after = value_iteration.compute_action_values(tables, problem.discount, values).max(axis=1)
        change = float(abs(after - values).max())
        values = after
        done += 1
    q = value_iteration.compute_optimal_q(tables, problem.discount)
    off = float(abs(q.max(axis=1) - values).max())
    states = problem.enumerate_states()
    legal = problem.legal_actions_mask(states)
    if legal is not None:  # where nothing is legal the game is over
        q = np.where(legal[:, 0] | ~legal[:, 0].any(axis=1, keepdims=True), q, -np.inf)
    rows: list[Row] = [
        {
            "state": problem.format_state(s),
            "value": float(row.max()),
            "best": format_action_names(problem, mark_best_actions(row)),
        }
        for s, row in zip(states, q, strict=True)
    ]
    last = f"below {CONVERGENCE_THRESHOLD:g}" if change < CONVERGENCE_THRESHOLD else f"{change:.3g}"
    told = f"change {last} after {format_count(done, 'sweep')}"
    if problem.discount < 1.0:
        told += f"; {off:.1g} from policy iteration"
    return Solution("value iteration", told, rows)


class _GraphValues(NamedTuple):
    """What is known of the states of a graph."""

    graph: TransitionGraph
    values: Reals  # [S, n]
    deciding_seat: Ints  # [S], who decides
    decider_q: Reals  # [R], what each joint action is worth to who decides


def solve_infinite_horizon(problem: Problem) -> Solution:
    """Values and best actions in a game without end, of many states."""
    with scale_progress(0.0, 0.3):
        whole = [graph.build_full_graph(problem)]
    with scale_progress(0.3, 1.0):
        swept = backward_sweeps.run_backward_value_iteration(whole.pop(), problem.discount)
    found = swept.graph
    nobody = np.zeros(len(found.states), np.int64)
    known = _GraphValues(found, swept.values[:, None], nobody, swept.q)
    gap = format_upper_bound(swept.gap)
    far = f"at most {gap} from the optimum" if swept.gap else "exact"
    if problem.discount == 1.0:
        far = f"the last change {gap}"
    value = format_start_values(problem, found, known.values)
    told = f"{value}, {far}, {format_count(swept.sweep_count, 'sweep')}"
    method = f"value iteration over {format_count(len(found.states), 'state')}"
    if len(found.nonterminal_states) < len(found.states):
        method += ", backwards from where games end"
    return Solution(method, told, _build_rows(problem, known))


def solve_finite_horizon(problem: Problem) -> Solution:
    """Values and best actions of a game of some turns, or one that ends, of who is to decide."""
    horizon = resolve_horizon(problem.horizon)
    found = seeing.solve_by_backward_induction(problem, horizon)
    before = found.get_values(None if horizon is None else horizon - 1)
    q = found.graph.compute_action_values(
        np.arange(len(found.graph.rewards)), problem.discount, before
    )
    own = q[np.arange(len(q)), found.deciding_seats[found.graph.source_states]]
    known = _GraphValues(found.graph, found.get_values(horizon), found.deciding_seats, own)
    far = (
        f"at most {format_upper_bound(found.gap)} from that of longer games"
        if found.gap
        else "exact"
    )
    span = "without end" if horizon is None else format_count(horizon, "turn")
    method = f"backward induction over {format_count(len(before), 'state')}, {span}"
    return Solution(
        method,
        f"{format_start_values(problem, known.graph, known.values)}, {far}",
        _build_rows(problem, known),
    )


def format_start_values(problem: Problem, state_graph: TransitionGraph, values: Reals) -> str:
    """What the start is worth to each agent, by the values `[S, n]`."""
    likely, start = initial_state_distribution(problem)
    mean = (
        np.round(likely @ values[state_graph.find_state_indices(problem, start)], VALUE_DECIMALS)
        + 0.0
    )
    if len(mean) == 1:
        return f"value {mean[0]:.6g} at the start"
    each = zip(mean, problem.agents, strict=True)
    return f"value {', '.join(f'{one:.6g} to {agent}' for one, agent in each)} at the start"


def select_listed_states(problem: Problem, state_graph: TransitionGraph) -> Ints:
    """The states that are told: all or, of many, those in which games start."""
    if len(state_graph.states) <= MAX_LISTED_STATES:
        return np.arange(len(state_graph.states))
    return np.unique(
        state_graph.find_state_indices(problem, initial_state_distribution(problem)[1])
    )[:MAX_LISTED_STATES]


def _build_rows(problem: Problem, graph_values: _GraphValues) -> list[Row]:
    """The values of the states that are told, and what is best there."""
    return [
        _build_row(problem, graph_values, place)
        for place in select_listed_states(problem, graph_values.graph).tolist()
    ]


def _build_row(problem: Problem, graph_values: _GraphValues, state_index: int) -> Row:
    found, mover = graph_values.graph, int(graph_values.deciding_seat[state_index])
    row: Row = {"state": problem.format_transcript_state(found.states[state_index])}
    some = slice(found.action_starts[state_index], found.action_starts[state_index + 1])
    able = np.zeros(problem.action_counts[mover], bool)
    if len(graph_values.decider_q[some]):
        able[found.joint_actions[some, mover][mark_best_actions(graph_values.decider_q[some])]] = (
            True
        )
    each = graph_values.values[state_index].tolist()
    if len(each) == 1:
        return row | {"value": each[0], "best": format_action_names(problem, able)}
    each_one = {f"value {agent}": one for agent, one in zip(problem.agents, each, strict=True)}
    who = problem.agents[mover] if able.any() else ""
    return row | each_one | {"to decide": who, "best": format_action_names(problem, able, mover)}
