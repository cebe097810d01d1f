"""Plots of the values and the best actions of states that one agent sees."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from dmplay.algorithms.finite_mdp import FiniteMdp, build_finite_mdp, explain_mdp_misfit, find_grid
from dmplay.algorithms.value_iteration import MAX_SWEEPS, is_converged
from dmplay.core.arrays import Reals
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.hexgrid import HexMap, find_hex_map
from dmplay.core.state_grid import StateGrid
from dmplay.core.tabular import tabulate
from dmplay.core.text import format_count, format_score
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.draw.axes import Axis
from dmplay.draw.canvas import format_signed
from dmplay.draw.panels import GridPanel, HexPanel, Plot, PlottedHex, TablePanel
from dmplay.plots.plotted_problem import (
    VALUE_LABEL,
    PlottedProblem,
    format_actions,
    mask_illegal_actions,
)
from dmplay.solvers.mdp import mdp_values

MAX_LISTED_STATES = 60
MAX_MAPS = 4  # of a grid with more than two axes
EQUAL_LABEL = "several equally good"
PLOTTED_NOUNS = {"values": "values", "policy": "best action"}


def plot_states(subject: PlottedProblem, what: str) -> Plot:
    """Return the values and the best actions of all states.

    They are on a map of hexes, on maps of a grid over states of real numbers, or in a table.
    """
    hex_map, grid = find_hex_map(subject.problem), find_grid(subject.problem)
    if hex_map:
        return _plot_hex_map(subject, hex_map)
    return _plot_grid(subject, what, grid) if grid else _plot_state_table(subject, what)


def compute_state_action_values(subject: PlottedProblem) -> Reals:
    """Return Q `[S, A]` of a finite problem for the turns left; -inf for illegal actions."""
    problem, tables = subject.problem, tabulate(subject.problem)
    if subject.horizon is None:
        q = mdp_values.compute_optimal_q(tables, problem.discount)
    else:
        values = mdp_values.compute_finite_horizon_values(
            tables, problem.discount, subject.horizon - 1
        )
        q = mdp_values.compute_action_values(tables, problem.discount, values)
    return mask_illegal_actions(problem, q)


def _plot_hex_map(subject: PlottedProblem, hex_map: HexMap) -> Plot:
    """Return the map with the value and the best directions of each hex."""
    return Plot(
        f"{subject.title}: values and best actions, {subject.horizon_text}",
        [build_hex_value_panel(subject, hex_map)],
        notes=[
            "a hex with a sign and no arrow pays that reward, and then the game is over",
            *subject.horizon_notes,
        ],
    )


def build_hex_value_panel(subject: PlottedProblem, hex_map: HexMap, title: str = "") -> HexPanel:
    """Return a map of hexes with their values and best directions."""
    (hexes, exits), q = hex_map, compute_state_action_values(subject)
    cells = []
    for hex_, action_values in zip(hexes, q[: len(hexes)], strict=True):
        value = float(action_values.max())
        if hex_ in exits:
            reward = exits[hex_]
            text = format_signed(reward)
            cells.append(PlottedHex(hex_, value, (), text, "gain" if reward > 0 else "loss"))
        else:
            directions = np.flatnonzero(mark_best_actions(action_values)).tolist()
            cells.append(PlottedHex(hex_, value, directions, f"{value:.2f}"))
    return HexPanel(title, cells, VALUE_LABEL)


def _plot_grid(subject: PlottedProblem, what: str, grid: StateGrid) -> Plot:
    """Return the values, or the best actions, on maps of a grid over states of real numbers.

    There is a map for each drawn point of the axes other than x and y.
    """
    obstacle = explain_mdp_misfit(subject.problem)
    if obstacle:
        raise subject.make_error(what, obstacle)
    others = [axis for index, axis in enumerate(grid.axes) if index not in (grid.x, grid.y)]
    slices = [*product(*(axis.points if axis.drawn is None else axis.drawn for axis in others))]
    if len(slices) > MAX_MAPS:
        reason = f"its state_grid has {len(slices)} maps, expected at most {MAX_MAPS}"
        raise subject.make_error(what, f"{reason}; set drawn of the other axes")
    mdp = build_finite_mdp(subject.problem)
    q, categories = _iterate_values(mdp, subject), ()
    plotted = q.max(axis=1)
    if what == "policy":
        plotted = find_unique_best_actions(q, subject.problem.reward_scale)
        plotted[mdp.terminal] = np.nan
        categories = (*subject.problem.actions[0].labels, EQUAL_LABEL)
    panels = [_build_grid_panel(grid, numbers, plotted, categories) for numbers in slices]
    points = " x ".join(map(str, grid.shape))
    notes = [f"value iteration on {points} points", *filter(None, [grid.note])]
    title = f"{subject.title}: {PLOTTED_NOUNS[what]}, {subject.horizon_text}"
    return Plot(title, panels, notes=[*notes, *subject.horizon_notes])


def _iterate_values(mdp: FiniteMdp, subject: PlottedProblem) -> Reals:
    """Return Q `[S, A]` for the turns left; without end, until the values are close to optimal."""
    budget = Budget("value iteration on a grid", "use fewer points in state_grid", 2e10)
    values, scale = np.zeros(len(mdp.states)), subject.problem.reward_scale
    for _ in range(subject.horizon or MAX_SWEEPS):
        budget.spend_work(ARRAY_CALL_WORK + mdp.probabilities.size)
        q = mdp.compute_action_values(values)
        previous, values = values, np.where(mdp.terminal, 0.0, q.max(axis=1))
        change = float(np.abs(values - previous).max())
        if subject.horizon is None and is_converged(mdp.discount, change, scale):
            break
    return np.where(mdp.terminal[:, None], 0.0, q)


def _build_grid_panel(
    grid: StateGrid, numbers: Sequence[float], plotted: Reals, categories: Sequence[str]
) -> GridPanel:
    """Return the map of what is plotted `[S]` at these numbers of the axes other than x and y.

    Its points are evenly spaced. Values are interpolated; categories are those of the nearest
    point of the grid.
    """
    all_points = [axis.points for axis in grid.axes]
    coordinates = [np.linspace(points[0], points[-1], len(points)) for points in all_points]
    others = [index for index in range(len(grid.axes)) if index not in (grid.x, grid.y)]
    for index, number in zip(others, numbers, strict=True):
        coordinates[index] = np.array([number])
    states = np.stack(np.meshgrid(*coordinates, indexing="ij"), axis=-1)  # [.., .., ..., d]
    states = np.moveaxis(states, (grid.x, grid.y), (0, 1)).reshape(-1, len(grid.axes))
    corners, weights = grid.find_corners(states)
    if categories:
        numbers_on_map = plotted[corners[np.arange(len(states)), weights.argmax(axis=1)]]
    else:
        numbers_on_map = (plotted[corners] * weights).sum(axis=1)
    x, y = coordinates[grid.x], coordinates[grid.y]
    return GridPanel(
        ", ".join(f"{grid.axes[i].name} {n:g}" for i, n in zip(others, numbers, strict=True)),
        Axis(grid.axes[grid.x].name, float(x[0]), float(x[-1])),
        Axis(grid.axes[grid.y].name, float(y[0]), float(y[-1])),
        numbers_on_map.reshape(len(x), len(y)),
        "" if categories else VALUE_LABEL,
        categories,
    )


def find_unique_best_actions(q: Reals, scale: float = 1.0) -> Reals:
    """Return the index of the best action `[N]` of Q `[N, A]`; A if several are equally good."""
    is_best = mark_best_actions(q, scale)
    best = np.where(is_best.sum(axis=1) > 1, q.shape[1], is_best.argmax(axis=1))
    return np.asarray(best, float)


def _plot_state_table(subject: PlottedProblem, what: str) -> Plot:
    """Return a table of the states of a finite problem, with their values and best actions."""
    problem = subject.problem
    count = problem.state_count if isinstance(problem.state_count, int) else 0
    if len(problem.agents) > 1:
        raise subject.make_error(what, f"it has {len(problem.agents)} agents, expected 1")
    if not count or not problem.action_counts[0]:
        raise subject.make_error(what, "it has no list of states and actions; try dmplay solve")
    if count > MAX_LISTED_STATES:
        count_text = format_count(count, "state", ",")
        raise subject.make_error(
            what, f"it has {count_text}, expected at most {MAX_LISTED_STATES}; try dmplay solve"
        )
    q, states = compute_state_action_values(subject), problem.enumerate_states()
    is_best = mark_best_actions(q, problem.reward_scale) & ~problem.terminal(states)[:, None]
    cells = [
        [format_score(row.max()), format_actions(problem, mask)]
        for row, mask in zip(q, is_best, strict=True)
    ]
    names = [problem.format_state(s) for s in states]
    columns = [VALUE_LABEL, "best action"]
    panel = TablePanel("", "state", "", names, columns, cells)
    title = f"{subject.title}: values and best actions, {subject.horizon_text}"
    return Plot(title, [panel], notes=subject.horizon_notes)
