"""Who can play a problem.

Each module of a problem's policies, that for problems from elsewhere and that for any problem have
one function `roster` of the problem and the seat.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from dmplay.policies.kinds import Seated
from dmplay.policies.valued import LONGEST

ADVISER, PARTNER = "@adviser", "@partner"  # names of whoever has that part in a roster


@dataclass(frozen=True)
class Roster:
    """The agents that fit a seat of a problem, by name, and those of them with a part to play."""

    agents: Mapping[str, type[Seated]]
    adviser: str | None = None  # its values and choices serve as hints
    planner: str | None = None  # advises instead where games are known to have so many turns
    partner: str = "random"  # sits where nobody was named, beside a person
    quick: str | None = None  # plays many games at once where the adviser takes long
    simulated: str | None = None  # plays wherever a search simulates; else adviser and partner do

    def advises(self, turns: int | None) -> str | None:
        """Who advises in games of so many turns; None for nobody knows how many."""
        return self.planner if self.planner and turns and turns <= LONGEST else self.adviser
