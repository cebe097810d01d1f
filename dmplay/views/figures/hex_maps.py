"""Figures F.2 and F.16: policies of both hex worlds, and the start of predator-prey."""

import numpy as np
from rich.text import Text

from dmplay.core.arrays import Array
from dmplay.core.best_actions import select_greedy_actions
from dmplay.core.problem import Problem, initial_state_distribution
from dmplay.core.tabular import tabulate
from dmplay.problems.hexworld import HexWorld
from dmplay.problems.predator_prey import PredatorPrey
from dmplay.problems.shared.hexgrid import Hex
from dmplay.registry.problems import load_problem
from dmplay.solvers.mdp import mdp_values
from dmplay.views.toolkit.canvas import format_signed, format_to_width
from dmplay.views.toolkit.hexgrid import ARROWS, NORMAL_SIZE, HexCell, HexSize, draw_map


def draw_hex_world_policies() -> Text:
    """Return figure F.2: both maps with the optimal action and the value of every hex."""
    figure = Text()
    for name in ("hexworld", "hexworld:straight-line"):
        figure.append(f"{name}: optimal actions and values\n", style="bold")
        figure.append_text(_draw_optimal_policy(load_problem(name))).append("\n")
    return figure


def _draw_optimal_policy(problem: Problem) -> Text:
    """Return a map with the optimal action and the value of every hex."""
    assert isinstance(problem, HexWorld)
    q = mdp_values.compute_optimal_q(tabulate(problem), problem.discount)
    exits = dict(problem.rewards)

    def make_cell(hex_: Hex, size: HexSize) -> HexCell:
        """Return the content of a hex: an exit's reward, or the optimal action and the value."""
        if hex_ in exits:
            return HexCell(
                "◆" if exits[hex_] > 0 else "✗", format_signed(exits[hex_]), style="bold"
            )
        values = q[problem.hexes.index(hex_)]
        arrow = ARROWS[select_greedy_actions(values)]
        value = float(values.max())
        return HexCell(arrow, format_to_width(value, 5), style="green" if value > 0 else "yellow")

    return draw_map(problem.hexes, make_cell, NORMAL_SIZE)


def draw_predator_prey_start() -> Text:
    """Return figure F.16: the initial state of predator-prey on the standard map."""
    problem = PredatorPrey()
    p, states = initial_state_distribution(problem)
    return Text("predator P, prey o\n").append_text(
        _draw_agents_on_map(problem, states[int(np.argmax(p))])
    )


def _draw_agents_on_map(problem: PredatorPrey, state: Array) -> Text:
    """Return the map with the glyphs of the predator and the prey."""
    marks = dict(zip((problem.hexes[int(s)] for s in state), "Po", strict=True))

    def make_cell(hex_: Hex, size: HexSize) -> HexCell:
        """Return the content of a hex: the glyph of its agent, if any."""
        mark = marks.get(hex_, "")
        return HexCell(mark, style={"P": "bold red", "o": "bold blue"}.get(mark, ""))

    return draw_map(problem.hexes, make_cell, NORMAL_SIZE)


FIGURES = {
    "F.2": ("hex world and straight-line hex world, an optimal policy", draw_hex_world_policies),
    "F.16": ("the initial state of predator-prey hex world", draw_predator_prey_start),
}
