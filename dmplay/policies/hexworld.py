"""Policies for hex world."""

from dmplay.core import Problem
from dmplay.policies._solved import MdpOptimalPolicy
from dmplay.policies.roster import Roster


def build_roster(problem: Problem, seat: int) -> Roster:
    """Return the agents of hex world."""
    return Roster({"optimal": MdpOptimalPolicy}, hint_provider="optimal")
