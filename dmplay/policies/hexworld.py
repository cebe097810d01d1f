"""Policies for hex world."""

from dmplay.policies._solved import Seeing

POLICIES = {"optimal": Seeing}
HINT = "optimal"
