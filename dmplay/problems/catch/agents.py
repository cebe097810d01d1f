"""The agents of catch, which act on the belief over proficiencies."""

from dmplay.agents.available_agents import Roster
from dmplay.problems._shared.constant_state_agents import Greedy, Optimal, ThompsonSampling

AGENTS = Roster(
    {"greedy": Greedy, "optimal": Optimal, "thompson": ThompsonSampling},
    hint_provider="optimal",
    rule_of_thumb="greedy",
)
