"""Figure F.16 of the book: the start of predator-prey."""

import numpy as np

from dmplay.core.problem import initial_state_distribution
from dmplay.draw.panels import HexPanel, Plot, PlottedHex
from dmplay.game.plot_kinds import Figure
from dmplay.plots.plotted_problem import PlottedProblem

from .rules import PredatorPrey


def _draw_hunt_start(subject: PlottedProblem) -> Plot:
    """Return figure F.16: the initial state of predator-prey on the standard map."""
    problem = subject.problem
    assert isinstance(problem, PredatorPrey)
    p, states = initial_state_distribution(problem)
    hunter, prey, *_ = (problem.hexes[int(s)] for s in states[int(np.argmax(p))])
    marked = {
        prey: PlottedHex(prey, text="prey", kind="prey"),
        hunter: PlottedHex(hunter, text="predator", kind="hunter"),
    }
    cells = [marked.get(hex_, PlottedHex(hex_)) for hex_ in problem.hexes]
    return Plot(f"{subject.title}: initial state", [HexPanel("", cells)])


FIGURES = {"F.16": Figure("initial state of predator-prey", _draw_hunt_start)}
