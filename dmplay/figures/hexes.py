"""Figures F.2 and F.16: both hex worlds solved, and the start of the hunt."""

import numpy as np
from rich.text import Text

from dmplay.chance import Array
from dmplay.core import Problem, exact_start
from dmplay.finding.problems import load
from dmplay.hexes import Hex
from dmplay.problems.hexworld import HexWorld
from dmplay.problems.predator_prey import PredatorPrey
from dmplay.solvers import value_iteration
from dmplay.tabular import tabulate
from dmplay.views.canvas import short, signed
from dmplay.views.hexgrid import ARROWS, NORMAL, Cell, Size, grid


def hex_worlds() -> Text:
    """Both maps with the best action and the value of every hex."""
    drawn = Text()
    for name in ("hexworld", "hexworld:straight-line"):
        drawn.append(f"{name}: optimal actions and values\n", style="bold")
        drawn.append_text(_solved(load(name))).append("\n")
    return drawn


def _solved(problem: Problem) -> Text:
    """A map with the best action and the value of every hex."""
    assert isinstance(problem, HexWorld)
    q = value_iteration.optimal(tabulate(problem), problem.discount)
    exits = dict(problem.rewards)

    def cell(hex_: Hex, size: Size) -> Cell:
        if hex_ in exits:
            return Cell("◆" if exits[hex_] > 0 else "✗", signed(exits[hex_]), style="bold")
        values = q[problem.hexes.index(hex_)]
        arrow = ARROWS[value_iteration.greedy(values)]
        value = float(values.max())
        return Cell(arrow, short(value, 5), style="green" if value > 0 else "yellow")

    return grid(problem.hexes, cell, NORMAL)


def hunt() -> Text:
    """The start of predator-prey on the standard map."""
    problem = PredatorPrey()
    p, states = exact_start(problem)
    return Text("predator P, prey o\n").append_text(_start(problem, states[int(np.argmax(p))]))


def _start(problem: PredatorPrey, state: Array) -> Text:
    marks = dict(zip((problem.hexes[int(s)] for s in state), "Po", strict=True))

    def cell(hex_: Hex, size: Size) -> Cell:
        mark = marks.get(hex_, "")
        return Cell(mark, style={"P": "bold red", "o": "bold blue"}.get(mark, ""))

    return grid(problem.hexes, cell, NORMAL)


FIGURES = {
    "F.2": ("hex world and straight-line hex world, an optimal policy", hex_worlds),
    "F.16": ("the initial state of predator-prey hex world", hunt),
}
