"""Plots of the rewards of a game of two agents, with its equilibria marked.

In a Nash equilibrium, no agent gains by changing its own strategy alone.
"""

from collections.abc import Sequence

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.text import format_count, format_number
from dmplay.draw.axes import Axis
from dmplay.draw.panels import GridPanel, Plot, TablePanel
from dmplay.evaluation.solutions.solution import format_cell, list_probabilities
from dmplay.plots.plotted_problem import PlottedProblem
from dmplay.solvers.games import bimatrix_game, extreme_equilibria, lemke_howson
from dmplay.solvers.games.bimatrix_game import MixedProfile
from dmplay.solvers.methods import is_simple_game

MAX_TABLE_ROWS, MAX_TABLE_COLUMNS = 12, 6  # of a table; larger games are heat maps
PURE_TOLERANCE = 1e-12  # of the probability of an action that is surely played
MAX_LISTED_EQUILIBRIA = 5
PURE_LABEL = "equilibrium in pure strategies"


def plot_payoffs(subject: PlottedProblem) -> Plot:
    """Return the rewards of one round, as a table or as heat maps, with the equilibria."""
    problem = subject.problem
    if len(problem.agents) != 2 or not is_simple_game(problem):
        raise subject.make_error("payoffs", "expected two agents, one state and all actions legal")
    subject.check_no_turns("payoffs", "they are those of one round")
    payoffs = bimatrix_game.build_payoffs(problem)
    profiles, other_equilibria = find_equilibria(payoffs)
    title = f"{subject.title}: rewards of one round"
    notes = [*_describe_equilibria(subject, profiles), *other_equilibria]
    cells = {cell for profile in profiles if (cell := find_pure_cell(profile)) is not None}
    rows, columns = problem.actions[0].labels, problem.actions[1].labels
    is_small = len(rows) <= MAX_TABLE_ROWS and len(columns) <= MAX_TABLE_COLUMNS
    if is_small or 1 in (len(rows), len(columns)):
        texts = [
            [f"{format_number(first)}, {format_number(second)}" for first, second in row]
            for row in payoffs
        ]
        table = TablePanel(
            f"rewards of {problem.agents[0]}, {problem.agents[1]}",
            problem.agents[0],
            problem.agents[1],
            rows,
            columns,
            texts,
            frozenset(cells),
            PURE_LABEL,
        )
        return Plot(title, [table], notes=notes)
    x, y = (
        _make_action_axis(agent, space.labels)
        for agent, space in zip(problem.agents, problem.actions, strict=True)
    )
    marks = [(_action_number(rows, i), _action_number(columns, j)) for i, j in sorted(cells)]
    panels = [
        GridPanel(
            f"reward of {agent}",
            x,
            y,
            payoffs[:, :, seat],
            f"reward of {agent}",
            marks=marks,
            mark_label=PURE_LABEL,
        )
        for seat, agent in enumerate(problem.agents)
    ]
    return Plot(title, panels, columns=2, notes=notes)


def find_equilibria(payoffs: Reals) -> tuple[list[MixedProfile], list[str]]:
    """Return equilibria of payoffs `[A1, A2, 2]`, and at most one note about other equilibria."""
    extreme = extreme_equilibria.find_extreme_equilibria(payoffs)
    if extreme_equilibria.has_mixtures(extreme):
        return extreme, ["there are infinitely many equilibria: the others are mixtures of these"]
    profiles = extreme or bimatrix_game.enumerate_equilibria_if_small(payoffs)
    if profiles:
        return profiles, []
    return [lemke_howson.find_equilibrium(payoffs)], [
        "this is one equilibrium; there may be others"
    ]


def find_pure_cell(profile: MixedProfile) -> tuple[int, int] | None:
    """Return the cell of an equilibrium in pure strategies; None for mixed strategies."""
    i, j = (int(np.argmax(strategy)) for strategy in profile)
    is_pure = min(profile.row_strategy[i], profile.column_strategy[j]) > 1.0 - PURE_TOLERANCE
    return (i, j) if is_pure else None


def _describe_equilibria(subject: PlottedProblem, profiles: Sequence[MixedProfile]) -> list[str]:
    """Return a note for each listed equilibrium, and one for those that are left out."""
    problem = subject.problem
    notes = []
    for profile in profiles[:MAX_LISTED_EQUILIBRIA]:
        strategies = (
            f"{agent}: {format_cell(list_probabilities(problem, seat, profile[seat], 0.0))}"
            for seat, agent in enumerate(problem.agents)
        )
        notes.append(f"Nash equilibrium: {'; '.join(strategies)}")
    if len(profiles) > MAX_LISTED_EQUILIBRIA:
        hidden = format_count(len(profiles) - MAX_LISTED_EQUILIBRIA, "more equilibrium")
        notes.append(f"and {hidden.replace('equilibriums', 'equilibria')}")
    return notes


def _make_action_axis(agent: str, labels: Sequence[str]) -> Axis:
    """Return the axis of an agent's actions: their numbers, or their positions."""
    low, high = _action_number(labels, 0), _action_number(labels, len(labels) - 1)
    noun = "action" if _are_consecutive_numbers(labels) else "action number"
    return Axis(f"{noun} of {agent}", low, high, is_whole=True)


def _action_number(labels: Sequence[str], index: int) -> float:
    """Return an action's number: that of its label if all labels are numbers, else from 1 on."""
    return float(labels[index]) if _are_consecutive_numbers(labels) else index + 1.0


def _are_consecutive_numbers(labels: Sequence[str]) -> bool:
    """Return whether the labels are consecutive whole numbers."""
    if not all(label.isdecimal() for label in labels):
        return False
    numbers = [int(label) for label in labels]
    return numbers == list(range(numbers[0], numbers[0] + len(numbers)))
