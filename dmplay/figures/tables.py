"""Figures F.14 and F.15, the payoff tables, and the tables F.1 and F.2."""

import re
import sys

import numpy as np
from rich.text import Text

from dmplay.chance import Reals
from dmplay.describe import aligned, summary
from dmplay.dice import Dice
from dmplay.finding.names import problem_names
from dmplay.finding.problems import load
from dmplay.session import Session
from dmplay.tabular import tabulate
from dmplay.views.style import Look, style_of


def _payoff(name: str) -> Text:
    problem = load(name)
    view = Session(problem, Dice(0)).view(0)
    drawn = list(style_of(problem).boards(view, Look()))[1]  # the table without the rounds
    return Text("rewards of agent 1, agent 2; rows are agent 1's actions\n").append_text(drawn)


def prisoners_dilemma() -> Text:
    """The rewards of the prisoner's dilemma."""
    return _payoff("prisoners-dilemma")


def rock_paper_scissors() -> Text:
    """The rewards of rock-paper-scissors."""
    return _payoff("rock-paper-scissors")


def problems() -> Text:
    """The kind and the spaces of every problem."""
    rows = [["problem", "kind", "agents", "states", "actions", "observations", "discount"]]
    for name in sorted(problem_names(), key=_section):
        problem = load(name)
        rows.append([name, problem.kind, *summary(problem).values()])
    text = Text()
    for number, row in enumerate(aligned(rows)):
        text.append(f"{row}\n", style="" if number else "bold")
    return text


def _section(name: str) -> int:
    """The section of the appendix that a problem's module names as its source."""
    told = sys.modules[type(load(name)).__module__].__doc__ or ""
    found = re.search(r"appendix F\.(\d+)", told)
    return int(found[1]) if found else 0


def machine() -> Text:
    """Transitions, observations and rewards of machine replacement."""
    problem = load("machine-replacement")
    tables = tabulate(problem)
    text = Text()
    for a in range(tables.transition.shape[1]):
        text.append(f"{problem.action_name(0, a)}\n", style="bold")
        parts = (tables.transition[:, a], tables.seen[a], tables.rewards[:, a])
        for s in range(len(tables.transition)):
            row = "   ".join(_row(part[s]) for part in parts)
            text.append(f"  {row}\n" if s else f"  {row}   T(s'|s,a)  O(o|a,s')  R(s,a)\n")
    return text


def _row(values: Reals) -> str:
    return " ".join(f"{value:7.4g}" for value in np.atleast_1d(values))


FIGURES = {
    "F.14": ("the rewards of the prisoner's dilemma", prisoners_dilemma),
    "F.15": ("the rewards of rock-paper-scissors", rock_paper_scissors),
    "T.1": ("table F.1, the problems", problems),
    "T.2": ("table F.2, machine replacement", machine),
}
