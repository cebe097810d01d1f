"""Figures F.10 to F.13: solutions of the partially observable problems over beliefs."""

from functools import partial

import numpy as np
from rich.text import Text

from dmplay.core.arrays import Reals
from dmplay.core.best_actions import select_greedy_actions
from dmplay.core.problem import Problem
from dmplay.core.tabular import tabulate
from dmplay.core.text import format_count
from dmplay.problems.catch import DISTANCES
from dmplay.registry.problems import load_problem
from dmplay.solvers.pomdp import exact_pomdp
from dmplay.solvers.pomdp.exact_pomdp import AlphaVectorStage
from dmplay.views.toolkit.belief_triangle import draw_belief_triangle
from dmplay.views.toolkit.canvas import Canvas
from dmplay.views.toolkit.plots import Axis, Plot

TEN_STEP_HORIZON = 10  # steps, in figure F.10
FOURTEEN_STEP_HORIZON = 14  # steps, in figure F.11
PLOTTED_HORIZONS = range(1, 21)  # in figure F.12
ACTION_STYLES = ("green", "cyan", "yellow", "magenta")
CURVE_GLYPHS = ("o", "x", "+", "*")


def draw_crying_baby_values() -> Text:
    """Return figure F.10: the value functions for ten steps and for an infinite horizon.

    The book draws the ten-step function, but describes it as the one for the infinite horizon.
    """
    problem = load_problem("crying-baby")
    tables = tabulate(problem)
    ten_steps = exact_pomdp.solve_finite_horizon(tables, problem.discount, TEN_STEP_HORIZON)[-1]
    infinite = exact_pomdp.solve_infinite_horizon(tables, problem.discount)
    figure = Text()
    for title, stage in (
        (f"{TEN_STEP_HORIZON} steps (as drawn)", ten_steps),
        ("infinite horizon", infinite),
    ):
        figure.append(f"{title}: alpha vectors over P(hungry)\n", style="bold")
        figure.append_text(_draw_alpha_vectors(problem, stage)).append("\n")
    return figure


def _draw_alpha_vectors(problem: Problem, stage: AlphaVectorStage) -> Text:
    """Return a plot of the alpha vectors of a stage as lines over the belief."""
    low, high = float(stage.alpha_vectors.min()), float(stage.alpha_vectors.max())
    plot = Plot(Axis(0.0, 1.0, "P(hungry)"), Axis(low, high, "U", "{:.1f}"), height=12)
    for number, (vector, actions) in enumerate(
        zip(stage.alpha_vectors, stage.first_action_mask, strict=True)
    ):
        glyph, style = (
            CURVE_GLYPHS[number % len(CURVE_GLYPHS)],
            ACTION_STYLES[number % len(ACTION_STYLES)],
        )
        plot.draw_curve(lambda b, v=vector: v[0] + b * (v[1] - v[0]), glyph, style)  # type: ignore[misc]
        names = " or ".join(problem.format_action(0, float(a)) for a in np.flatnonzero(actions))
        plot.write_note(number, f"{glyph} {names} ({vector[0]:.2f}, {vector[1]:.2f})", style)
    return plot.to_text()


def draw_fourteen_step_policy() -> Text:
    """Return figure F.11: the best first action of fourteen steps, over the belief triangle."""
    return _format_action_legend().append_text(
        _draw_belief_triangles([FOURTEEN_STEP_HORIZON], 24, 1)
    )


def draw_policies_by_horizon() -> Text:
    """Return figure F.12: the best first action for each horizon from one to twenty steps."""
    return _format_action_legend().append_text(_draw_belief_triangles(list(PLOTTED_HORIZONS), 8, 4))


def _format_action_legend() -> Text:
    """Return the legend of the actions and of the corners of a belief triangle."""
    text = Text()
    problem = load_problem("machine-replacement")
    for action, style in enumerate(ACTION_STYLES):
        label = problem.format_action(0, action)
        text.append(f"{label[0]} {label}  ", style=style)
    return text.append("top: none failed, left: one, right: both\n", style="dim")


def _draw_belief_triangles(horizons: list[int], rows: int, column_count: int) -> Text:
    """Return a belief triangle for each horizon, `rows` rows high, `column_count` to a line."""
    problem = load_problem("machine-replacement")
    stages = exact_pomdp.solve_finite_horizon(tabulate(problem), problem.discount, max(horizons))
    canvas = Canvas()
    for position, step in enumerate(horizons):
        x, y = position % column_count * (2 * rows + 3), position // column_count * (rows + 2)
        canvas.write_text(x, y, format_count(step, "step"), "bold")
        draw_belief_triangle(canvas, x, y + 1, rows, partial(_mark_best_action, stages[step - 1]))
    return canvas.to_text()


def _mark_best_action(stage: AlphaVectorStage, belief: Reals) -> tuple[str, str]:
    """Return the first letter of the best first action at a belief `[S]`, and its style."""
    best_vector = int(select_greedy_actions(stage.alpha_vectors @ belief))
    action = int(np.argmax(stage.first_action_mask[best_vector]))
    return "meir"[action], ACTION_STYLES[action]


def draw_catch_success_curves() -> Text:
    """Return figure F.13: the probability of a catch by distance, for the four proficiencies."""
    problem = load_problem("catch")
    catch_probabilities = tabulate(problem).rewards[:, :, 0] / DISTANCES
    plot = Plot(Axis(10.0, 100.0, "distance d"), Axis(0.0, 1.0, "P(catch)"))
    for number, name in enumerate(problem.format_state(s) for s in problem.enumerate_states()):
        probabilities = catch_probabilities[number]
        style = ACTION_STYLES[number]
        plot.draw_curve(
            lambda d, p=probabilities: float(np.interp(d, DISTANCES, p)),  # type: ignore[misc]
            CURVE_GLYPHS[number],
            style,
        )
        plot.write_note(number, f"{CURVE_GLYPHS[number]} s = {name}", style)
    return plot.to_text()


FIGURES = {
    "F.10": ("the crying baby's value function", draw_crying_baby_values),
    "F.11": ("machine replacement, the 14-step policy", draw_fourteen_step_policy),
    "F.12": ("machine replacement, policies for 1 to 20 steps", draw_policies_by_horizon),
    "F.13": ("the probability of a catch", draw_catch_success_curves),
}
