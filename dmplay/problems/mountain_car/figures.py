"""Figure F.7 of the book, the valley, and the values on a grid."""

import numpy as np

from dmplay.draw.axes import Axis
from dmplay.draw.panels import GridPanel, Label, Plot, Polyline, Shape, ShapesPanel
from dmplay.game.plot_kinds import Figure
from dmplay.plots.plotted_problem import VALUE_LABEL, PlottedProblem
from dmplay.plots.state_values import EQUAL_LABEL, find_unique_best_actions

from .agents import VALUE_GRID, compute_action_values, solve_on_grid
from .rules import LEFT_WALL, RIGHT_WALL, TOP_SPEED, MountainCar
from .view import VALLEY_FLOOR_X, compute_hill_height

HILL_POINTS = 181
POSITIONS = Axis("position (track units)", LEFT_WALL, RIGHT_WALL)
SPEEDS = Axis("speed (track units per turn)", -TOP_SPEED, TOP_SPEED)
GRID_SHAPE = VALUE_GRID.point_counts
METHOD = f"value iteration on {GRID_SHAPE[0]} x {GRID_SHAPE[1]} points"
TURNS_REASON = "they are computed for an infinite horizon"


def _draw_valley(subject: PlottedProblem) -> Plot:
    """Return figure F.7: the valley, with the car at its lowest point, and the goal."""
    problem = subject.problem
    assert isinstance(problem, MountainCar)
    positions = np.linspace(LEFT_WALL, RIGHT_WALL, HILL_POINTS).tolist()
    hill = [(x, compute_hill_height(x)) for x in positions]
    floor, goal = VALLEY_FLOOR_X, problem.goal
    low, flag_foot = compute_hill_height(floor), compute_hill_height(goal)
    arrow_height = low + 0.45
    shapes: list[Shape] = [
        Polyline(hill),
        Polyline([hill[0], (LEFT_WALL, 1.4)]),
        Polyline([(goal, flag_foot), (goal, flag_foot + 0.45)]),
        Polyline([(floor - 0.1, arrow_height), (floor - 0.26, arrow_height)], "end"),
        Polyline([(floor + 0.1, arrow_height), (floor + 0.26, arrow_height)], "end"),
        Label("wall", LEFT_WALL, 1.3),
        Label(f"goal {goal:g}", goal, flag_foot + 0.4, "left"),
        Label("", floor, low + 0.1, has_dot=True),
        Label("car", floor, low + 0.25, "above"),
    ]
    panel = ShapesPanel(
        "",
        Axis("position x", LEFT_WALL - 0.05, RIGHT_WALL + 0.05),
        Axis("height of the hill, sin(3x)", -1.1, 1.5),
        shapes,
    )
    notes = ["the car is at the lowest point; it accelerates left or right, or coasts"]
    return Plot(f"{subject.title}: the valley and the goal", [panel], notes=notes)


def _plot_values(subject: PlottedProblem) -> Plot:
    """Return a heat map of the values by position and speed."""
    subject.check_no_turns("values", TURNS_REASON)
    values = solve_on_grid(subject.problem, VALUE_GRID).values
    panel = GridPanel("", POSITIONS, SPEEDS, values.reshape(GRID_SHAPE), VALUE_LABEL)
    return Plot(f"{subject.title}: values, infinite horizon", [panel], notes=[METHOD])


def _plot_policy(subject: PlottedProblem) -> Plot:
    """Return a heat map of the best actions by position and speed."""
    subject.check_no_turns("policy", TURNS_REASON)
    problem, states = subject.problem, VALUE_GRID.list_states()
    best = find_unique_best_actions(compute_action_values(problem, states))
    best[problem.terminal(states)] = np.nan
    categories = (*problem.actions[0].labels, EQUAL_LABEL)
    panel = GridPanel("", POSITIONS, SPEEDS, best.reshape(GRID_SHAPE), categories=categories)
    return Plot(f"{subject.title}: best action, infinite horizon", [panel], notes=[METHOD])


FIGURES = {
    "F.7": Figure("valley and goal of the mountain car", _draw_valley),
    "values": Figure("value of each position and speed", _plot_values),
    "policy": Figure("best action of each position and speed", _plot_policy),
}
