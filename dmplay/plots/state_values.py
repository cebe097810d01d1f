"""Plots of the values and the best actions of states that one agent sees."""

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.hexgrid import HexMap, find_hex_map
from dmplay.core.problem import Problem
from dmplay.core.tabular import tabulate
from dmplay.core.text import format_count, format_score
from dmplay.plots.plot_data import HexPanel, Plot, PlottedHex, TablePanel
from dmplay.plots.plotted_problem import (
    VALUE_LABEL,
    PlottedProblem,
    format_actions,
    mask_illegal_actions,
)
from dmplay.solvers.mdp import mdp_values
from dmplay.views.toolkit.canvas import format_signed

MAX_LISTED_STATES = 60


def plot_states(subject: PlottedProblem, what: str) -> Plot:
    """Return the values and the best actions of all states: on a map of hexes, or as a table."""
    hex_map = find_hex_map(subject.problem)
    return _plot_hex_map(subject, hex_map) if hex_map else _plot_state_table(subject, what)


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


def _plot_state_table(subject: PlottedProblem, what: str) -> Plot:
    """Return a table of the states of a finite problem, with their values and best actions."""
    problem = subject.problem
    count = _count_states(problem)
    if len(problem.agents) > 1:
        raise subject.refuse(what, f"it has {len(problem.agents)} agents, expected 1")
    if not count or not problem.action_counts[0]:
        raise subject.refuse(what, "it has no list of states and actions; try dmplay solve")
    if count > MAX_LISTED_STATES:
        count_text = format_count(count, "state", ",")
        raise subject.refuse(
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


def _count_states(problem: Problem) -> int:
    """Return the number of states; 0 if they cannot be listed."""
    return problem.state_count if isinstance(problem.state_count, int) else 0
