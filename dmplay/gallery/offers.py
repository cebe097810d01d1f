"""What the gallery lists: every problem under its kind, in words."""

from typing import NamedTuple

from dmplay.finding import problems
from dmplay.finding.installed import entry_point_targets
from dmplay.finding.names import problem_names

KIND_HEADINGS = {  # in the order of the list
    "MDP": "alone, all seen (MDP)",
    "POMDP": "alone, part hidden (POMDP)",
    "simple game": "both at once (simple game)",
    "Markov game": "several, all seen (Markov)",
    "POMG": "several, part hidden (POMG)",
    "Dec-POMDP": "a team, hidden (Dec-POMDP)",
}
INSTALLED_HEADING = "installed"


class ProblemEntry(NamedTuple):
    """A problem in the list, and the heading that it stands under."""

    name: str
    heading: str


def list_problem_entries() -> list[ProblemEntry]:
    """Every problem, by kind; those that are installed last, as they are not imported yet."""
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
