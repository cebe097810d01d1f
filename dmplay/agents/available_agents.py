"""The agents that can play a seat of a problem, and their roles."""

from collections.abc import Mapping
from dataclasses import dataclass

from dmplay.agents.base import SeatPolicy
from dmplay.agents.horizon import MAX_HORIZON

# names of roles in a roster, used in place of an agent's name
HINT_PROVIDER_ROLE, PARTNER_ROLE = "@adviser", "@partner"


@dataclass(frozen=True)
class Roster:
    """The agents that fit a seat of a problem, by name, and which of them have a special role.

    A role may name an agent of a general method too. A name that none has is an UnknownName when
    the agents of the problem are loaded.
    """

    agents: Mapping[str, type[SeatPolicy]]
    hint_provider: str | None = None  # agent whose values and choices serve as hints
    finite_horizon_hint_provider: str | None = None  # instead, if the number of turns is known
    default_partner: str = "random"  # plays a seat for which no agent was named, beside a person
    batch_agent: str | None = None  # plays many games at once if the hint provider is slow
    # plays in a search's simulations, in place of hint provider and partner
    simulation_agent: str | None = None
    # a simple way to play, which a silver medal is measured by
    rule_of_thumb: str | None = None
    # a careless way to play, which a bronze medal is measured by; not random play if that is absurd
    baseline: str = "random"
    adds_general_agents: bool = True  # the agents of general methods can play this seat too

    def hint_provider_for(self, turns: int | None) -> str | None:
        """Return the name of the hint provider for games of `turns` turns; None if there is none.

        `turns` is None if the number of turns is unknown.
        """
        if turns and turns <= MAX_HORIZON and self.finite_horizon_hint_provider:
            return self.finite_horizon_hint_provider
        return self.hint_provider
