"""What the gallery lists: every problem under its kind, in words."""

from typing import NamedTuple

from dmplay.finding import problems
from dmplay.finding.installed import installed
from dmplay.finding.names import problem_names

KINDS = {  # in the order of the list
    "MDP": "alone, all seen (MDP)",
    "POMDP": "alone, part hidden (POMDP)",
    "simple game": "both at once (simple game)",
    "Markov game": "several, all seen (Markov)",
    "POMG": "several, part hidden (POMG)",
    "Dec-POMDP": "a team, hidden (Dec-POMDP)",
}
INSTALLED = "installed"


class Offer(NamedTuple):
    """A problem in the list, and the heading that it stands under."""

    name: str
    heading: str


def offers() -> list[Offer]:
    """Every problem, by kind; those that are installed last, as they are not imported yet."""
    kinds = {name: problems.load(name).kind for name in problem_names()}
    built_in = [
        Offer(name, heading)
        for kind, heading in KINDS.items()
        for name in problem_names()
        if kinds[name] == kind
    ]
    return [*built_in, *(Offer(name, INSTALLED) for name in sorted(installed()))]
