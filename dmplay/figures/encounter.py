"""Figure F.9: optimal value and policy of collision avoidance, in four slices."""

import numpy as np
from rich.text import Text

from dmplay.chance import Reals
from dmplay.finding.problems import load
from dmplay.solvers import collision_grid
from dmplay.solvers.value_iteration import SLACK, best
from dmplay.views.canvas import Canvas

RATES = (0.0, 5.0)  # m/s, of the left and the right column
NO_ADVISORY = 1  # the index of the last advisory and of the action
DEPTHS = " ▁▂▃▄▅▆▇█"
ADVISORIES = ("↓", "·", "↑")
STYLES = ("bold yellow", "dim", "bold blue")


def slices() -> Text:
    """Values above, advisories below; rate 0 at the left, 5 m/s at the right."""
    q = collision_grid.optimal(load("collision-avoidance"))
    canvas = Canvas()
    for column, rate in enumerate(RATES):
        j = int(np.searchsorted(collision_grid.CLIMBS, rate))
        known = q[:, NO_ADVISORY, :, j]  # [time, height, action]
        x = 8 + 48 * column
        canvas.put(x, 0, f"rate {rate:g} m/s: how much is lost, {DEPTHS[1]} little {DEPTHS[-1]} 1")
        _values(canvas, x, 1, known)
        canvas.put(x, 24, "advisory: ↑ climb, ↓ descend, · none")
        _policy(canvas, x, 25, known)
    return canvas.text()


def _axes(canvas: Canvas, x: int, y: int) -> None:
    for row, height in ((0, "+200 m"), (10, "0"), (20, "-200 m")):
        canvas.put(x - 8, y + row, height.rjust(7), "dim")
    canvas.put(x, y + 21, "0 s".ljust(20) + "20 s".ljust(17) + "40 s", "dim")


def _values(canvas: Canvas, x: int, y: int, q: Reals) -> None:
    _axes(canvas, x, y)
    for time, heights in enumerate(-q.max(axis=2)):
        for i, lost in enumerate(heights):
            depth = int(np.ceil(min(max(lost, 0.0), 1.0) * (len(DEPTHS) - 1) - SLACK))
            canvas.put(x + time, y + 20 - i, DEPTHS[depth], "red" if lost > 0.1 else "")


def _policy(canvas: Canvas, x: int, y: int, q: Reals) -> None:
    _axes(canvas, x, y)
    for time, heights in enumerate(q):
        for i, values in enumerate(heights):
            right = best(values)
            chosen = NO_ADVISORY if right[NO_ADVISORY] else int(np.argmax(right))
            canvas.put(x + time, y + 20 - i, ADVISORIES[chosen], STYLES[chosen])


FIGURES = {"F.9": ("collision avoidance, optimal values and advisories", slices)}
