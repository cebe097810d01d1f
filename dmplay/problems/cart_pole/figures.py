"""Figure F.6 of the book: the cart-pole."""

import math

import numpy as np

from dmplay.core.arrays import Array
from dmplay.core.text import format_count
from dmplay.draw.axes import Axis
from dmplay.draw.panels import Box, Label, Plot, Polyline, Shape, ShapesPanel
from dmplay.game.plot_kinds import Figure
from dmplay.plots.plotted_problem import PlottedProblem

from .rules import CartPole

CART_WIDTH, CART_HEIGHT = 0.5, 0.3  # m; the problem has no size of the cart


def _draw_cart_pole(subject: PlottedProblem) -> Plot:
    """Return figure F.6: the cart, its pole, the two pushes and the limits."""
    problem = subject.problem
    assert isinstance(problem, CartPole)
    turns, state = _push_until_pole_leans(problem)
    x, v, theta, omega = state.tolist()
    half, top, limit = CART_WIDTH / 2, 1.15 * problem.length, problem.x_limit
    margin = 0.1 * max(limit, problem.length)
    width = max(limit, abs(x) + half) + margin
    pivot, tip = (x, CART_HEIGHT), _find_line_end((x, CART_HEIGHT), theta, problem.length)
    max_angle = math.radians(problem.theta_limit)
    right_limit = _find_line_end(pivot, max_angle, top)
    push_height = 0.7 * CART_HEIGHT
    pole_text = f"pole {problem.length:g} m, {problem.mass_pole:g} kg"
    cart_text = f"cart {problem.mass_cart:g} kg, x {x:+.2f} m, v {v:+.2f} m/s"
    shapes: list[Shape] = [
        Polyline([(-limit, 0.0), (limit, 0.0)]),
        Polyline([(-limit, 0.0), (-limit, CART_HEIGHT + top)], is_dashed=True),
        Polyline([(limit, 0.0), (limit, CART_HEIGHT + top)], is_dashed=True),
        Polyline([pivot, _find_line_end(pivot, -max_angle, top)], is_dashed=True),
        Polyline([pivot, right_limit], is_dashed=True),
        Polyline([pivot, tip]),
        Box(x - half, 0.02, x + half, CART_HEIGHT),
        Polyline([(x - half, push_height), (x - 3 * half, push_height)], "end"),
        Polyline([(x + half, push_height), (x + 3 * half, push_height)], "end"),
        Label(f"force {problem.force:g} N", x - 3 * half, push_height, "left"),
        Label(f"force {problem.force:g} N", x + 3 * half, push_height),
        Label(pole_text, tip[0], CART_HEIGHT + top, "above"),
        Label(f"theta {math.degrees(theta):+.1f} deg", right_limit[0], CART_HEIGHT + top),
        Label(f"omega {math.degrees(omega):+.0f} deg/s", right_limit[0], CART_HEIGHT + 0.7 * top),
        Label(cart_text, x, -margin / 2, "below"),
    ]
    panel = ShapesPanel(
        "",
        Axis("position x (m)", -width, width),
        Axis("height (m)", -1.5 * margin, CART_HEIGHT + top + margin),
        shapes,
        has_equal_scales=True,
    )
    notes = [
        f"the state after {format_count(turns, 'turn')} of pushes to the left, from rest",
        "v: speed of the cart; theta: angle of the pole; omega: rate of this angle",
        f"dashed: limits of x ({limit:g} m) and theta ({problem.theta_limit:g} deg); "
        "the game ends past a limit",
    ]
    return Plot(f"{subject.title}: the state, the two pushes and the limits", [panel], notes=notes)


def _push_until_pole_leans(problem: CartPole) -> tuple[int, Array]:
    """Return the number of pushes to the left until the pole leans, and the state after them.

    It leans half of its limit. The cart and the pole are at rest at first. There are fewer pushes
    if the game ends before.
    """
    a, no_uniforms = np.zeros((1, 1), np.int64), np.zeros((1, 0))
    s = np.zeros((1, 4))
    for pushes in range(problem.horizon):
        next_s = problem.step(s, a, no_uniforms).state
        is_over = problem.terminal(next_s)[0] or not np.isfinite(next_s).all()
        if is_over or abs(s[0, 2]) > math.radians(problem.theta_limit) / 2:
            return pushes, s[0]
        s = next_s
    return problem.horizon, s[0]


def _find_line_end(foot: tuple[float, float], angle: float, length: float) -> tuple[float, float]:
    """Return the upper end of a line that leans this angle in radians to the right."""
    return foot[0] + length * math.sin(angle), foot[1] + length * math.cos(angle)


FIGURES = {"F.6": Figure("state, pushes and limits of the cart-pole", _draw_cart_pole)}
