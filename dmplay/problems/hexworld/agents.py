"""Policies for hex world."""

from dmplay.agents.available_agents import Roster
from dmplay.agents.single_agent_planning import MdpOptimalPolicy
from dmplay.core.problem import Problem


def build_roster(problem: Problem, seat: int) -> Roster:
    """Return the agents of hex world."""
    return Roster({"optimal": MdpOptimalPolicy}, hint_provider="optimal")
