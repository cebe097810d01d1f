"""Figures F.1 and F.2 of the book: a move in hex world, and the values of both maps."""

from dataclasses import replace

from dmplay.core.hexgrid import DIRECTIONS, find_hex_map, hex_neighbours
from dmplay.core.tabular import tabulate
from dmplay.draw.panels import HexPanel, Plot, PlottedHex
from dmplay.game.plot_kinds import Figure
from dmplay.plots.plotted_problem import PlottedProblem, load_plotted_problem
from dmplay.plots.state_values import build_hex_value_panel

from .rules import HexWorld

CHOSEN_DIRECTION = DIRECTIONS.index("e")  # the example in figure F.1


def _draw_move_chances(subject: PlottedProblem) -> Plot:
    """Return figure F.1: the probability of each result of one move of hex world."""
    problem = subject.problem
    assert isinstance(problem, HexWorld)
    hexes = ((0, 0), *hex_neighbours((0, 0)))
    tables = tabulate(replace(problem, hexes=hexes, rewards=()))
    chances = tables.transition[0, CHOSEN_DIRECTION, : len(hexes)]
    cells = [PlottedHex((0, 0), text="start", directions=(CHOSEN_DIRECTION,))]
    ends = zip(hexes[1:], chances[1:].tolist(), strict=True)
    cells += [PlottedHex(hex_, p, text=f"{p:.3g}") for hex_, p in ends]
    title = f"{subject.title}: where a move to {DIRECTIONS[CHOSEN_DIRECTION].upper()} ends"
    notes = ["a move against the border ends where it began"]
    return Plot(title, [HexPanel("", cells, "probability")], notes=notes)


def _draw_hex_world_policies(subject: PlottedProblem) -> Plot:
    """Return figure F.2: both maps with the optimal actions and the value of every hex."""
    line = load_plotted_problem("hexworld:straight-line", subject.settings, subject.turns)
    panels = [
        build_hex_value_panel(part, hex_map, title)
        for part, title in ((subject, "standard map"), (line, "straight line"))
        if (hex_map := find_hex_map(part.problem))
    ]
    title = f"{subject.title}: values and best actions, {subject.horizon_text}"
    return Plot(title, panels)


FIGURES = {
    "F.1": Figure("results of a move in hex world", _draw_move_chances),
    "F.2": Figure(
        "optimal values and actions of both hex worlds", _draw_hex_world_policies, has_turns=True
    ),
}
