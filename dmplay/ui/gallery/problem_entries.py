"""The entries of the gallery's list: every problem under the heading of its kind."""

import math
import re
import sys
from collections.abc import Sequence
from typing import NamedTuple

from dmplay.core.problem import Problem
from dmplay.registry import problems
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.entry_points import entry_point_targets
from dmplay.tutor.lesson_list import LessonOutline

KIND_HEADINGS = {  # in the order of the list
    "MDP": "Alone, all in view (MDP)",
    "POMDP": "Alone, partly seen (POMDP)",
    "simple game": "Trust or outwit (simple game)",
    "Markov game": "Others, in view (Markov game)",
    "POMG": "Others, partly seen (POMG)",
    "Dec-POMDP": "Team, partly seen (Dec-POMDP)",
}
INSTALLED_HEADING = "installed"
SOURCE_PATTERN = re.compile(r"Source: appendix F\.(\d+)")


class ProblemEntry(NamedTuple):
    """A problem in the list, and the heading above it; or the first game, which is a lesson."""

    name: str
    heading: str
    lesson: LessonOutline | None = None


def list_problem_entries() -> list[ProblemEntry]:
    """Return the built-in problems by kind, then the installed ones, which are not imported yet.

    Those of a kind are in the order of the book, which begins with the easiest.
    """
    built_in = {name: problems.load_problem(name) for name in problem_names()}
    kinds = [*KIND_HEADINGS]
    names = sorted(
        built_in, key=lambda name: (kinds.index(built_in[name].kind), _find_section(built_in[name]))
    )
    return [
        *(ProblemEntry(name, KIND_HEADINGS[built_in[name].kind]) for name in names),
        *(ProblemEntry(name, INSTALLED_HEADING) for name in sorted(entry_point_targets())),
    ]


def find_next_problem(entries: Sequence[ProblemEntry], name: str) -> str:
    """Return the problem after this one in the list; '' after the last, or if it is not in it."""
    names = [entry.name for entry in entries if not entry.lesson]
    position = names.index(name) + 1 if name in names else len(names)
    return "".join(names[position : position + 1])


def _find_section(problem: Problem) -> float:
    """Return the number of a problem's section in appendix F, infinity for one of another place."""
    match = SOURCE_PATTERN.search(sys.modules[type(problem).__module__].__doc__ or "")
    return int(match[1]) if match else math.inf
