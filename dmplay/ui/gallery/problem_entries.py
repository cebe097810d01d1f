"""The entries of the gallery's list: every problem under the heading of its kind."""

from typing import NamedTuple

from dmplay.registry import problems
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.entry_points import entry_point_targets

KIND_HEADINGS = {  # in the order of the list
    "MDP": "MDP: 1 agent, visible state",
    "POMDP": "POMDP: 1 agent, hidden state",
    "simple game": "simple game: payoff table",
    "Markov game": "Markov game: visible state",
    "POMG": "POMG: game, hidden state",
    "Dec-POMDP": "Dec-POMDP: team, hidden state",
}
INSTALLED_HEADING = "installed"


class ProblemEntry(NamedTuple):
    """A problem in the list, and the heading above it."""

    name: str
    heading: str


def list_problem_entries() -> list[ProblemEntry]:
    """Return the built-in problems by kind, then the installed ones, which are not imported yet."""
    kinds = {name: problems.load_problem(name).kind for name in problem_names()}
    built_in = [
        ProblemEntry(name, heading)
        for kind, heading in KIND_HEADINGS.items()
        for name in problem_names()
        if kinds[name] == kind
    ]
    return [
        *built_in,
        *(ProblemEntry(name, INSTALLED_HEADING) for name in sorted(entry_point_targets())),
    ]
