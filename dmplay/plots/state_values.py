"""Plots of the values and the best actions of states that one agent sees."""

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.best_actions import mark_best_actions, select_greedy_actions
from dmplay.core.problem import Problem
from dmplay.core.tabular import tabulate
from dmplay.core.text import format_count, format_score
from dmplay.plots.plot_data import (
    GridPanel,
    HexPanel,
    LinePanel,
    Panel,
    Plot,
    PlottedHex,
    Series,
    TablePanel,
    make_value_axis,
)
from dmplay.plots.plotted_problem import PlottedProblem, format_actions, mask_illegal_actions
from dmplay.problems.collision_avoidance import grid as collision_avoidance_grid
from dmplay.problems.collision_avoidance.rules import ADVISED_RATES, CollisionAvoidance
from dmplay.problems.hexworld.rules import HexWorld
from dmplay.problems.mountain_car.agents import VALUE_GRID, solve_on_grid
from dmplay.problems.mountain_car.rules import LEFT_WALL, RIGHT_WALL, TOP_SPEED, MountainCar
from dmplay.problems.simple_regulator import linear_policy_evaluation as linear_gaussian_evaluation
from dmplay.problems.simple_regulator.rules import SimpleRegulator
from dmplay.solvers.mdp import grid_value_iteration, mdp_values
from dmplay.views.toolkit.canvas import format_signed
from dmplay.views.toolkit.plots import Axis

MAX_LISTED_STATES = 60
VALUE_LABEL = "expected return"
EQUAL_LABEL = "several equally good"
REGULATOR_STATES = np.linspace(-2.0, 2.0, 81)
COLLISION_CLIMB_RATES = (0.0, 5.0)  # m/s, of the panels
COLLISION_TIMES = Axis("time to collision (s)", 0.0, 40.0)
COLLISION_HEIGHTS = Axis("height above the other aircraft (m)", -200.0, 200.0)


def plot_values(subject: PlottedProblem) -> Plot:
    """Return the value of each state, with the best actions where they fit."""
    match subject.problem:
        case HexWorld():
            return _plot_hex_world(subject)
        case MountainCar():
            return _plot_mountain_car(subject, ["values"])
        case CollisionAvoidance():
            return plot_collision_avoidance(subject, ["values"])
        case SimpleRegulator():
            return _plot_regulator_values(subject)
    return _plot_state_table(subject, "values")


def plot_policy(subject: PlottedProblem) -> Plot:
    """Return the best actions of each state."""
    match subject.problem:
        case HexWorld():
            return _plot_hex_world(subject)
        case MountainCar():
            return _plot_mountain_car(subject, ["policy"])
        case CollisionAvoidance():
            return plot_collision_avoidance(subject, ["policy"])
        case SimpleRegulator():
            return _plot_regulator_policy(subject)
    return _plot_state_table(subject, "policy")


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


def _plot_hex_world(subject: PlottedProblem) -> Plot:
    """Return the map with the value and the best directions of each hex."""
    return Plot(
        f"{subject.title}: values and best actions, {subject.horizon_text}",
        [build_hex_value_panel(subject)],
        notes=[
            "a hex with a sign and no arrow pays that reward, and then the game is over",
            *subject.horizon_notes,
        ],
    )


def build_hex_value_panel(subject: PlottedProblem, title: str = "") -> HexPanel:
    """Return the map of hex world with values and best directions."""
    problem = subject.problem
    assert isinstance(problem, HexWorld)
    q, exits = compute_state_action_values(subject), dict(problem.rewards)
    cells = []
    for hex_, action_values in zip(problem.hexes, q[:-1], strict=True):
        value = float(action_values.max())
        if hex_ in exits:
            reward = exits[hex_]
            text = format_signed(reward)
            cells.append(PlottedHex(hex_, value, (), text, "gain" if reward > 0 else "loss"))
        else:
            directions = np.flatnonzero(mark_best_actions(action_values)).tolist()
            cells.append(PlottedHex(hex_, value, directions, f"{value:.2f}"))
    return HexPanel(title, cells, VALUE_LABEL)


def _plot_mountain_car(subject: PlottedProblem, contents: list[str]) -> Plot:
    """Return heat maps of the values, or of the best actions, by position and speed."""
    subject.refuse_turns(contents[0], "they are computed for an infinite horizon")
    problem = subject.problem
    values = solve_on_grid(problem, VALUE_GRID).values
    x, y = (
        Axis("position (track units)", LEFT_WALL, RIGHT_WALL),
        Axis("speed (track units per turn)", -TOP_SPEED, TOP_SPEED),
    )
    shape = VALUE_GRID.point_counts
    panels: list[Panel] = []
    if "values" in contents:
        panels.append(GridPanel("", x, y, values.reshape(shape), VALUE_LABEL))
    if "policy" in contents:
        states = VALUE_GRID.list_states()
        q = grid_value_iteration.compute_action_values(problem, VALUE_GRID, values, states)
        best = _index_best_actions(q)
        best[problem.terminal(states)] = np.nan
        categories = (*problem.actions[0].labels, EQUAL_LABEL)
        panels.append(GridPanel("", x, y, best.reshape(shape), categories=categories))
    noun = "values" if contents == ["values"] else "best action"
    method = f"value iteration on {shape[0]} x {shape[1]} points"
    return Plot(f"{subject.title}: {noun}, infinite horizon", panels, notes=[method])


def _index_best_actions(q: Reals) -> Reals:
    """Return the index of the best action `[N]` of Q `[N, A]`; A if several are equally good."""
    is_best = mark_best_actions(q)
    best = np.where(is_best.sum(axis=1) > 1, q.shape[1], is_best.argmax(axis=1))
    return np.asarray(best, float)


def plot_collision_avoidance(subject: PlottedProblem, contents: list[str]) -> Plot:
    """Return heat maps of the values, and of the best advisories, for two climb rates."""
    subject.refuse_turns(contents[0], "the time to the collision is an axis")
    problem = subject.problem
    q = collision_avoidance_grid.compute_optimal_q(problem)
    no_advisory = list(ADVISED_RATES).index(0.0)
    panels: list[Panel] = []
    for content in contents:
        for rate in COLLISION_CLIMB_RATES:
            j = int(np.searchsorted(collision_avoidance_grid.CLIMB_RATES, rate))
            q_slice = q[:, no_advisory, :, j]  # [time, height, action]
            title = f"climb rate {rate:g} m/s"
            if content == "values":
                panels.append(
                    GridPanel(
                        title,
                        COLLISION_TIMES,
                        COLLISION_HEIGHTS,
                        q_slice.max(axis=-1),
                        VALUE_LABEL,
                    )
                )
                continue
            best = select_greedy_actions(q_slice)
            # No advisory is chosen if it is among the best.
            best = np.where(mark_best_actions(q_slice)[..., no_advisory], no_advisory, best)
            panels.append(
                GridPanel(
                    title,
                    COLLISION_TIMES,
                    COLLISION_HEIGHTS,
                    best.astype(float),
                    categories=problem.actions[0].labels,
                )
            )
    nouns = {"values": "values", "policy": "best advisories"}
    names = " and ".join(nouns[content] for content in contents)
    notes = ["no advisory is active before; ties are shown as no advisory"]
    return Plot(f"{subject.title}: {names} until the collision", panels, columns=2, notes=notes)


def _plot_regulator_values(subject: PlottedProblem) -> Plot:
    """Return the curve of the value function of the simple regulator."""
    problem, policy = subject.problem, linear_gaussian_evaluation.OPTIMAL_POLICY
    assert isinstance(problem, SimpleRegulator)
    value = (
        linear_gaussian_evaluation.evaluate_infinite_horizon(problem, policy)
        if subject.horizon is None
        else linear_gaussian_evaluation.evaluate_finite_horizon(problem, policy, subject.horizon)
    )
    returns = np.array([value.evaluate_at(float(s)) for s in REGULATOR_STATES])
    panel = LinePanel(
        "",
        Axis("state s", float(REGULATOR_STATES[0]), float(REGULATOR_STATES[-1])),
        make_value_axis(VALUE_LABEL, returns),
        [Series("", REGULATOR_STATES, returns)],
    )
    notes = [f"U(s) = -({value.curvature:.4g} s^2 + {value.constant:.4g})", *subject.horizon_notes]
    return Plot(f"{subject.title}: value, {subject.horizon_text}", [panel], notes=notes)


def _plot_regulator_policy(subject: PlottedProblem) -> Plot:
    """Return the line of the best action of the simple regulator, which cancels the state."""
    subject.refuse_turns("policy", "the best action is the same for every number of turns left")
    gain = linear_gaussian_evaluation.OPTIMAL_POLICY.theta1
    low, high = float(REGULATOR_STATES[0]), float(REGULATOR_STATES[-1])
    panel = LinePanel(
        "",
        Axis("state s", low, high),
        Axis("best action a", low, high),
        [Series("", REGULATOR_STATES, gain * REGULATOR_STATES)],
    )
    return Plot(f"{subject.title}: best action, any horizon", [panel], notes=["a = -s"])


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
