"""Policies for hex world."""

from dmplay.agents.available_agents import Roster
from dmplay.agents.single_agent_planning import MdpOptimalPolicy

AGENTS = Roster({"optimal": MdpOptimalPolicy}, hint_provider="optimal")
