"""Who can play a problem.

Each module of a problem's policies, that for problems from elsewhere and that for any problem have
one function `roster` of the problem and the seat.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from dmplay.policies.kinds import SeatPolicy
from dmplay.policies.valued import MAX_HORIZON

HINT_PROVIDER_ROLE, PARTNER_ROLE = (
    "@adviser",
    "@partner",
)  # names of whoever has that part in a roster


@dataclass(frozen=True)
class Roster:
    """The agents that fit a seat of a problem, by name, and those of them with a part to play."""

    agents: Mapping[str, type[SeatPolicy]]
    hint_provider: str | None = None  # its values and choices serve as hints
    finite_horizon_hint_provider: str | None = (
        None  # advises instead where games are known to have so many turns
    )
    default_partner: str = "random"  # sits where nobody was named, beside a person
    batch_agent: str | None = None  # plays many games at once where the adviser takes long
    simulation_agent: str | None = (
        None  # plays wherever a search simulates; else adviser and partner do
    )

    def hint_provider_for(self, turns: int | None) -> str | None:
        """Who advises in games of so many turns; None for nobody knows how many."""
        return (
            self.finite_horizon_hint_provider
            if self.finite_horizon_hint_provider and turns and turns <= MAX_HORIZON
            else self.hint_provider
        )
