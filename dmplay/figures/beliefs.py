"""Figures F.10 to F.13: the solutions of the partially observed problems over beliefs."""

import numpy as np
from rich.text import Text

from dmplay.chance import Reals
from dmplay.core import Problem
from dmplay.describe import counted
from dmplay.finding.problems import load
from dmplay.problems.catch import DISTANCES
from dmplay.solvers import alpha_vectors
from dmplay.solvers.alpha_vectors import Stage
from dmplay.solvers.value_iteration import greedy
from dmplay.tabular import tabulate
from dmplay.views.canvas import Canvas
from dmplay.views.plot import Axis, Plot

TEN = 10  # steps, of the function that figure F.10 draws
FOURTEEN = 14  # steps, of figure F.11
HORIZONS = range(1, 21)  # of figure F.12
STYLES = ("green", "cyan", "yellow", "magenta")
MARKS = ("o", "x", "+", "*")


def crying_baby() -> Text:
    """Both value functions: the drawing is the ten-step one, the claim the endless one."""
    problem = load("crying-baby")
    tables = tabulate(problem)
    ten = alpha_vectors.stages(tables, problem.discount, TEN)[-1]
    endless = alpha_vectors.infinite(tables, problem.discount)
    drawn = Text()
    for title, stage in ((f"{TEN} steps (as drawn)", ten), ("without end", endless)):
        drawn.append(f"{title}: alpha vectors over P(hungry)\n", style="bold")
        drawn.append_text(_lines(problem, stage)).append("\n")
    return drawn


def _lines(problem: Problem, stage: Stage) -> Text:
    """The vectors of a stage as lines over the belief."""
    low, high = float(stage.vectors.min()), float(stage.vectors.max())
    plot = Plot(Axis(0.0, 1.0, "P(hungry)"), Axis(low, high, "U", "{:.1f}"), height=12)
    for number, (vector, actions) in enumerate(zip(stage.vectors, stage.actions, strict=True)):
        glyph, style = MARKS[number % len(MARKS)], STYLES[number % len(STYLES)]
        plot.curve(lambda b, v=vector: v[0] + b * (v[1] - v[0]), glyph, style)  # type: ignore[misc]
        names = " or ".join(problem.action_name(0, float(a)) for a in np.flatnonzero(actions))
        plot.note(number, f"{glyph} {names} ({vector[0]:.2f}, {vector[1]:.2f})", style)
    return plot.text()


def fourteen_steps() -> Text:
    """The best first action of fourteen, over the triangle of beliefs."""
    return _legend().append_text(_triangles([FOURTEEN], 24, 1))


def horizons() -> Text:
    """The best first action for one to twenty steps."""
    return _legend().append_text(_triangles(list(HORIZONS), 8, 4))


def _legend() -> Text:
    text = Text()
    problem = load("machine-replacement")
    for action, style in enumerate(STYLES):
        label = problem.action_name(0, action)
        text.append(f"{label[0]} {label}  ", style=style)
    return text.append("top: none failed, left: one, right: both\n", style="dim")


def _triangles(steps: list[int], rows: int, across: int) -> Text:
    """A triangle for each number of steps, so many rows high, some to a line."""
    problem = load("machine-replacement")
    stages = alpha_vectors.stages(tabulate(problem), problem.discount, max(steps))
    canvas = Canvas()
    for place, step in enumerate(steps):
        x, y = place % across * (2 * rows + 3), place // across * (rows + 2)
        canvas.put(x, y, counted(step, "step"), "bold")
        _triangle(canvas, x, y + 1, rows, stages[step - 1])
    return canvas.text()


def _triangle(canvas: Canvas, x: int, y: int, rows: int, stage: Stage) -> None:
    """A triangle of beliefs, each point the best first action there."""
    for row in range(rows):
        sound = 1.0 - row / (rows - 1)
        wide = 2 * row + 1
        for column in range(wide):
            both = (1.0 - sound) * (column / (wide - 1) if wide > 1 else 0.0)
            b = np.array([[sound, 1.0 - sound - both, both]])
            action = _first(stage, b)
            canvas.put(x + rows - 1 - row + column, y + row, "meir"[action], STYLES[action])


def _first(stage: Stage, b: Reals) -> int:
    top = int(greedy(stage.vectors @ b[0]))
    return int(np.argmax(stage.actions[top]))


def catch() -> Text:
    """The probability of a catch by distance, for the four proficiencies."""
    problem = load("catch")
    pay = tabulate(problem).rewards[:, :, 0] / DISTANCES
    plot = Plot(Axis(10.0, 100.0, "distance d"), Axis(0.0, 1.0, "P(catch)"))
    for number, name in enumerate(problem.notation(s) for s in problem.enumerated()):
        shares = pay[number]
        style = STYLES[number]
        plot.curve(lambda d, p=shares: float(np.interp(d, DISTANCES, p)), MARKS[number], style)  # type: ignore[misc]
        plot.note(number, f"{MARKS[number]} s = {name}", style)
    return plot.text()


FIGURES = {
    "F.10": ("the crying baby's value function", crying_baby),
    "F.11": ("machine replacement, the 14-step policy", fourteen_steps),
    "F.12": ("machine replacement, policies for 1 to 20 steps", horizons),
    "F.13": ("the probability of a catch", catch),
}
