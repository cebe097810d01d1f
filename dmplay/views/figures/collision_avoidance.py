"""Figure F.9: optimal value and policy of collision avoidance, in four slices."""

import numpy as np
from rich.text import Text

from dmplay.core.arrays import Reals
from dmplay.core.best_actions import VALUE_TOLERANCE, mark_best_actions
from dmplay.registry.problems import load_problem
from dmplay.solvers.mdp import collision_avoidance_grid
from dmplay.views.toolkit.canvas import Canvas

CLIMB_RATES = (0.0, 5.0)  # m/s, in the left and the right column
NO_ADVISORY_INDEX = 1  # index both as last advisory and as action
LOSS_LEVELS = " ▁▂▃▄▅▆▇█"
ADVISORY_GLYPHS = ("↓", "·", "↑")
ADVISORY_STYLES = ("bold yellow", "dim", "bold blue")


def draw_value_and_policy_slices() -> Text:
    """Return figure F.9: values above, advisories below; rate 0 at the left, 5 m/s at the right."""
    q = collision_avoidance_grid.compute_optimal_q(load_problem("collision-avoidance"))
    canvas = Canvas()
    for column, rate in enumerate(CLIMB_RATES):
        j = int(np.searchsorted(collision_avoidance_grid.CLIMB_RATES, rate))
        q_slice = q[:, NO_ADVISORY_INDEX, :, j]  # [time, height, action]
        x = 8 + 48 * column
        canvas.write_text(
            x,
            0,
            f"rate {rate:g} m/s: expected cost, {LOSS_LEVELS[1]} low {LOSS_LEVELS[-1]} 1",
        )
        _draw_values(canvas, x, 1, q_slice)
        canvas.write_text(x, 24, "advisory: ↑ climb, ↓ descend, · none")
        _draw_policy(canvas, x, 25, q_slice)
    return canvas.to_text()


def _draw_axes(canvas: Canvas, x: int, y: int) -> None:
    """Draw the labels of the height axis and of the time axis."""
    for row, height in ((0, "+200 m"), (10, "0"), (20, "-200 m")):
        canvas.write_text(x - 8, y + row, height.rjust(7), "dim")
    canvas.write_text(x, y + 21, "0 s".ljust(20) + "20 s".ljust(17) + "40 s", "dim")


def _draw_values(canvas: Canvas, x: int, y: int, q: Reals) -> None:
    """Draw the loss at each time and height, in eighths of a row."""
    _draw_axes(canvas, x, y)
    for time, heights in enumerate(-q.max(axis=2)):
        for i, loss in enumerate(heights):
            level = int(
                np.ceil(min(max(loss, 0.0), 1.0) * (len(LOSS_LEVELS) - 1) - VALUE_TOLERANCE)
            )
            canvas.write_text(x + time, y + 20 - i, LOSS_LEVELS[level], "red" if loss > 0.1 else "")


def _draw_policy(canvas: Canvas, x: int, y: int, q: Reals) -> None:
    """Draw the best advisory at each time and height; no advisory if it is among the best."""
    _draw_axes(canvas, x, y)
    for time, heights in enumerate(q):
        for i, values in enumerate(heights):
            is_best = mark_best_actions(values)
            advisory = NO_ADVISORY_INDEX if is_best[NO_ADVISORY_INDEX] else int(np.argmax(is_best))
            canvas.write_text(
                x + time, y + 20 - i, ADVISORY_GLYPHS[advisory], ADVISORY_STYLES[advisory]
            )


FIGURES = {
    "F.9": ("collision avoidance, optimal values and advisories", draw_value_and_policy_slices)
}
