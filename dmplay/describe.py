"""A problem in one line, as table F.1 of the book has it, and how numbers and rows are put."""

import math
from collections.abc import Sequence
from dataclasses import fields
from decimal import ROUND_CEILING, Context

from dmplay.core import Continuous, Labels, Numbers, Problem, Sight

VARIES = "varies"
FEW = 1000  # a score from which on there is none of its digits behind the point


def varies(problem: Problem, fact: str) -> bool:
    """Whether a fact depends on the parameters: a property of the class, not an attribute.

    Of what is made of arrays, the states are as many as have names.
    """
    if {one.name for one in fields(problem) if one.repr} <= {"discount"}:
        return False
    home = next(kind for kind in type(problem).__mro__ if fact in vars(kind))
    if home.__module__ == "dmplay.tabular":
        return varies(problem, "names")
    return home is not Problem and isinstance(vars(home)[fact], property)


def summary(problem: Problem) -> dict[str, str]:
    """A problem's line of table F.1: agents, states, actions, observations, discount."""
    many = len(problem.agents) > 1
    agents = VARIES if varies(problem, "agents") else str(len(problem.agents)) if many else "-"
    each = " per agent" if many else ""
    observations = problem.observations
    seen = f"{_kinds(observations[0])}{each}" if observations else "-"
    return {
        "agents": agents,
        "states": VARIES if varies(problem, "states") else _states(problem),
        "actions": f"{len(problem.actions[0].labels) or 'in R'}{each}",
        "observations": seen,
        "discount": f"{problem.discount:g}",
    }


def _kinds(observed: Sight) -> str:
    """How many things can be observed."""
    match observed:
        case Labels():
            return str(len(observed))
        case Numbers(many):
            return f"in R^{many}" if many > 1 else "in R"
    return "text"


def _states(problem: Problem) -> str:
    if isinstance(problem.states, Continuous):
        dimensions = problem.states.dimensions
        return f"in R^{dimensions}" if dimensions > 1 else "in R"
    if problem.states == math.inf:
        return "unbounded"
    return "-" if problem.states == 1 else str(problem.states)


def one_line(text: str) -> str:
    """A text that holds a name of a file, as one line whatever the name."""
    return text.replace("\n", "\\n")


def score(problem: Problem) -> str:
    """What the sum of the rewards is called: a plain one, or one in which later ones count less."""
    return "score" if problem.discount == 1.0 else "score (discounted)"


def brief(value: float) -> str:
    """A score in few digits: four, or more where all of them are whole."""
    return f"{value:.4g}" if abs(value) < FEW else f"{value:.0f}"


def at_most(bound: float, digits: int = 1) -> str:
    """A bound from above in few digits, rounded up, so that what is told holds too."""
    up = Context(digits, ROUND_CEILING).create_decimal(repr(float(bound)))
    return f"{float(up):.{digits}g}"


def ended(reason: str | None) -> str:
    """Why a game ended, in words: `turn limit` for the horizon too."""
    return "turn limit" if reason == "horizon" else reason or "unfinished"


def counted(number: float, noun: str, form: str = "") -> str:
    """A number of things, written in a form: 1 turn, 2 turns."""
    return several(f"{number:{form}}", noun)


def several(told: str, noun: str) -> str:
    """As many things as a number says that is written already: 1 turn, 4.7 turns."""
    return f"{told} {noun}{'s' * (told != '1')}"


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of words with each column as wide as its widest."""
    widths = [max(map(_wide, column)) for column in zip(*rows, strict=True)]
    each = (zip(row, widths, strict=True) for row in rows)
    return ["  ".join(w + " " * (width - _wide(w)) for w, width in row).rstrip() for row in each]


def _wide(word: str) -> int:
    """How many columns of a terminal a word takes."""
    if word.isascii():
        return len(word)
    from unicodedata import combining, east_asian_width  # which few words need

    return sum(0 if combining(c) else 1 + (east_asian_width(c) in "WF") for c in word)
