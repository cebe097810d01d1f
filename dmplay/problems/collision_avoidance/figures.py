"""Figures F.8 and F.9 of the book: an encounter, and its values on a grid."""

from itertools import product

import numpy as np

from dmplay.core.arrays import Array
from dmplay.core.best_actions import mark_best_actions, select_greedy_actions
from dmplay.draw.axes import Axis
from dmplay.draw.panels import GridPanel, Label, Panel, Plot, Polyline, Shape, ShapesPanel
from dmplay.game.plot_kinds import Figure
from dmplay.plots.plotted_problem import FIGURE_SEED, VALUE_LABEL, PlottedProblem, sample_start

from . import grid
from .rules import ADVISED_RATES, COLLISION_DISTANCE, GUST_ACCELERATIONS, CollisionAvoidance

CALM_SECONDS = 8  # of the flight that shows the vertical rate
PLOTTED_CLIMB_RATES = (0.0, 5.0)  # m/s, of the panels
TIMES = Axis("time to collision (s)", 0.0, 40.0)
HEIGHTS = Axis("height above the other aircraft (m)", -200.0, 200.0)


def _draw_encounter(subject: PlottedProblem) -> Plot:
    """Return figure F.8: the state variables of an encounter of two aircraft."""
    problem = subject.problem
    assert isinstance(problem, CollisionAvoidance)
    state = sample_start(problem)
    height, rate, last_advisory, time = state.tolist()
    advisory = problem.actions[0].labels[ADVISED_RATES.tolist().index(last_advisory)]
    later_height, _, _, later_time = _fly_in_calm_air(problem, state).tolist()
    bound = 1.3 * max(abs(height), abs(later_height), COLLISION_DISTANCE)
    time_height = -0.6 * bound
    shapes: list[Shape] = [
        Polyline([(0.0, 0.0), (time, 0.0)], is_dashed=True),
        Polyline([(0.0, -COLLISION_DISTANCE), (0.0, COLLISION_DISTANCE)]),
        Polyline([(time, 0.0), (time, height)], "both"),
        Polyline([(0.0, time_height), (time, time_height)], "both"),
        Polyline([(time, height), (later_time, later_height)], "end"),
        Label(f"collision: closer than {COLLISION_DISTANCE:g} m", 0.0, COLLISION_DISTANCE),
        Label("", 0.0, 0.0, has_dot=True),
        Label("other aircraft", 0.0, -0.15 * bound),
        Label(f"h = {height:+.0f} m", time, height / 2),
        Label(f"t_col = {time:g} s", time / 2, time_height, "below"),
        Label(f"dh = {rate:+.1f} m/s", later_time, later_height, "left"),
        Label("", time, height, has_dot=True),
        Label(f"our aircraft, a_prev = {advisory}", 0.9 * time, height, "above"),
    ]
    panel = ShapesPanel(
        "",
        Axis("time to collision t_col (s)", -2.0, 1.2 * time),
        Axis("height above the other aircraft h (m)", -bound, bound),
        shapes,
    )
    notes = [
        f"a random starting state (seed {FIGURE_SEED})",
        "dh: vertical rate; its arrow is the flight of "
        f"{CALM_SECONDS} s without an advisory or a gust",
        "a_prev: the last advisory",
    ]
    return Plot(f"{subject.title}: state variables", [panel], notes=notes)


def _fly_in_calm_air(problem: CollisionAvoidance, state: Array) -> Array:
    """Return the state after CALM_SECONDS turns without an advisory or a gust."""
    s, a = state[None], np.array([[problem.parse_action(0, "no-advisory")]], np.int64)
    calm = np.flatnonzero(GUST_ACCELERATIONS == 0)
    for _ in range(CALM_SECONDS):
        s = problem.resolve_events(s, a, (calm,)).state
    return s[0]  # type: ignore[no-any-return]


def _plot_climb_rates(subject: PlottedProblem, *contents: str) -> Plot:
    """Return heat maps of the values, and of the best advisories, for two climb rates."""
    subject.check_no_turns(contents[0], "the time to the collision is an axis")
    problem = subject.problem
    q = grid.compute_optimal_q(problem)
    no_advisory = list(ADVISED_RATES).index(0.0)
    panels: list[Panel] = []
    for content, rate in product(contents, PLOTTED_CLIMB_RATES):
        j = int(np.searchsorted(grid.CLIMB_RATES, rate))
        q_slice = q[:, no_advisory, :, j]  # [time, height, action]
        title = f"climb rate {rate:g} m/s"
        if content == "values":
            values = q_slice.max(axis=-1)
            panels.append(GridPanel(title, TIMES, HEIGHTS, values, VALUE_LABEL))
            continue
        best = select_greedy_actions(q_slice)
        # No advisory is chosen if it is among the best.
        best = np.where(mark_best_actions(q_slice)[..., no_advisory], no_advisory, best)
        categories = problem.actions[0].labels
        panels.append(GridPanel(title, TIMES, HEIGHTS, best.astype(float), categories=categories))
    nouns = {"values": "values", "policy": "best advisories"}
    names = " and ".join(nouns[content] for content in contents)
    notes = ["no advisory is active before; ties are shown as no advisory"]
    return Plot(f"{subject.title}: {names} until the collision", panels, columns=2, notes=notes)


FIGURES = {
    "F.8": Figure("state variables of collision avoidance", _draw_encounter),
    "F.9": Figure(
        "optimal values and advisories of collision avoidance",
        lambda subject: _plot_climb_rates(subject, "values", "policy"),
    ),
    "values": Figure(
        "values at two climb rates", lambda subject: _plot_climb_rates(subject, "values")
    ),
    "policy": Figure(
        "best advisories at two climb rates", lambda subject: _plot_climb_rates(subject, "policy")
    ),
}
