"""Policies for hex world."""

from dmplay.core import Problem
from dmplay.policies._solved import Seeing
from dmplay.policies.roster import Roster


def roster(problem: Problem, seat: int) -> Roster:
    """Who plays hex world."""
    return Roster({"optimal": Seeing}, adviser="optimal")
