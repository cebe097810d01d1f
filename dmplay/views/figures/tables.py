"""Figures F.14 and F.15, the payoff tables, and tables F.1 and F.2."""

import re
import sys

import numpy as np
from rich.text import Text

from dmplay.core.arrays import Reals
from dmplay.core.problem_summary import problem_summary
from dmplay.core.session import Session
from dmplay.core.tabular import tabulate
from dmplay.core.text import align_columns
from dmplay.core.uniforms import SeededUniforms
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.problems import load_problem
from dmplay.views.protocol import DrawOptions, load_view_module


def _draw_payoff_table(name: str) -> Text:
    """Return the payoff table of a two-agent problem."""
    problem = load_problem(name)
    view = Session(problem, SeededUniforms(0)).view(0)
    table = list(load_view_module(problem).iter_boards(view, DrawOptions()))[
        1
    ]  # the table without the rounds
    return Text("rewards of agent 1, agent 2; rows are agent 1's actions\n").append_text(table)


def draw_prisoners_dilemma() -> Text:
    """Return figure F.14: the rewards of the prisoner's dilemma."""
    return _draw_payoff_table("prisoners-dilemma")


def draw_rock_paper_scissors() -> Text:
    """Return figure F.15: the rewards of rock-paper-scissors."""
    return _draw_payoff_table("rock-paper-scissors")


def draw_problem_table() -> Text:
    """Return table F.1: the kind and the spaces of every problem of the appendix, in its order."""
    rows = [["problem", "kind", "agents", "states", "actions", "observations", "discount"]]
    names = filter(_find_appendix_section_number, problem_names())
    for name in sorted(names, key=_find_appendix_section_number):
        problem = load_problem(name)
        rows.append([name, problem.kind, *problem_summary(problem).values()])
    text = Text()
    for number, row in enumerate(align_columns(rows)):
        text.append(f"{row}\n", style="" if number else "bold")
    return text


def _find_appendix_section_number(name: str) -> int:
    """Return the section of appendix F named in the docstring of a problem's module.

    It is 0 for a problem that is not from the appendix.
    """
    docstring = sys.modules[type(load_problem(name)).__module__].__doc__ or ""
    section = re.search(r"appendix F\.(\d+)", docstring)
    return int(section[1]) if section else 0


def draw_machine_tables() -> Text:
    """Return table F.2: transitions, observations and rewards of machine replacement."""
    problem = load_problem("machine-replacement")
    tables = tabulate(problem)
    text = Text()
    for a in range(tables.transition.shape[1]):
        text.append(f"{problem.format_action(0, a)}\n", style="bold")
        parts = (tables.transition[:, a], tables.observation_model[a], tables.rewards[:, a])
        for s in range(len(tables.transition)):
            row = "   ".join(_format_row(part[s]) for part in parts)
            text.append(f"  {row}\n" if s else f"  {row}   T(s'|s,a)  O(o|a,s')  R(s,a)\n")
    return text


def _format_row(values: Reals) -> str:
    """Return a number or a row of numbers in columns of 7 characters."""
    return " ".join(f"{value:7.4g}" for value in np.atleast_1d(values))


FIGURES = {
    "F.14": ("the rewards of the prisoner's dilemma", draw_prisoners_dilemma),
    "F.15": ("the rewards of rock-paper-scissors", draw_rock_paper_scissors),
    "T.1": ("table F.1, the problems", draw_problem_table),
    "T.2": ("table F.2, machine replacement", draw_machine_tables),
}
