"""A problem in one line, as table F.1 of the book has it, and how numbers and rows are put."""

import math
from collections.abc import Sequence
from dataclasses import fields
from decimal import ROUND_CEILING, Context

from dmplay.core import ContinuousStates, Labels, ObservationSpace, Problem, RealVector

VARIES = "varies"
MIN_WHOLE_SCORE = 1000  # a score from which on there is none of its digits behind the point


def depends_on_parameters(problem: Problem, attribute: str) -> bool:
    """Whether a fact depends on the parameters: a property of the class, not an attribute.

    Of what is made of arrays, the states are as many as have names.
    """
    if {one.name for one in fields(problem) if one.repr} <= {"discount"}:
        return False
    home = next(kind for kind in type(problem).__mro__ if attribute in vars(kind))
    if home.__module__ == "dmplay.tabular":
        return depends_on_parameters(problem, "state_names")
    return home is not Problem and isinstance(vars(home)[attribute], property)


def problem_summary(problem: Problem) -> dict[str, str]:
    """A problem's line of table F.1: agents, states, actions, observations, discount."""
    many = len(problem.agents) > 1
    agents = (
        VARIES
        if depends_on_parameters(problem, "agents")
        else str(len(problem.agents))
        if many
        else "-"
    )
    each = " per agent" if many else ""
    observations = problem.observations
    seen = f"{_describe_observation_space(observations[0])}{each}" if observations else "-"
    return {
        "agents": agents,
        "states": VARIES
        if depends_on_parameters(problem, "state_count")
        else _describe_state_count(problem),
        "actions": f"{len(problem.actions[0].labels) or 'in R'}{each}",
        "observations": seen,
        "discount": f"{problem.discount:g}",
    }


def _describe_observation_space(space: ObservationSpace) -> str:
    """How many things can be observed."""
    match space:
        case Labels():
            return str(len(space))
        case RealVector(many):
            return f"in R^{many}" if many > 1 else "in R"
    return "text"


def _describe_state_count(problem: Problem) -> str:
    if isinstance(problem.state_count, ContinuousStates):
        dimensions = problem.state_count.dimensions
        return f"in R^{dimensions}" if dimensions > 1 else "in R"
    if problem.state_count == math.inf:
        return "unbounded"
    return "-" if problem.state_count == 1 else str(problem.state_count)


def escape_newlines(text: str) -> str:
    """A text that holds a name of a file, as one line whatever the name."""
    return text.replace("\n", "\\n")


def score_label(problem: Problem) -> str:
    """What the sum of the rewards is called: a plain one, or one in which later ones count less."""
    return "score" if problem.discount == 1.0 else "score (discounted)"


def format_score(value: float) -> str:
    """A score in few digits: four, or more where all of them are whole."""
    return f"{value:.4g}" if abs(value) < MIN_WHOLE_SCORE else f"{value:.0f}"


def format_upper_bound(bound: float, digits: int = 1) -> str:
    """A bound from above in few digits, rounded up, so that what is told holds too."""
    up = Context(digits, ROUND_CEILING).create_decimal(repr(float(bound)))
    return f"{float(up):.{digits}g}"


def describe_end_reason(reason: str | None) -> str:
    """Why a game ended, in words: `turn limit` for the horizon too."""
    return "turn limit" if reason == "horizon" else reason or "unfinished"


def format_count(number: float, noun: str, form: str = "") -> str:
    """A number of things, written in a form: 1 turn, 2 turns."""
    return append_noun(f"{number:{form}}", noun)


def append_noun(number_text: str, noun: str) -> str:
    """As many things as a number says that is written already: 1 turn, 4.7 turns."""
    return f"{number_text} {noun}{'s' * (number_text != '1')}"


def align_columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of words with each column as wide as its widest."""
    widths = [max(map(_display_width, column)) for column in zip(*rows, strict=True)]
    each = (zip(row, widths, strict=True) for row in rows)
    return [
        "  ".join(w + " " * (width - _display_width(w)) for w, width in row).rstrip()
        for row in each
    ]


def _display_width(word: str) -> int:
    """How many columns of a terminal a word takes."""
    if word.isascii():
        return len(word)
    from unicodedata import combining, east_asian_width  # which few words need

    return sum(0 if combining(c) else 1 + (east_asian_width(c) in "WF") for c in word)
