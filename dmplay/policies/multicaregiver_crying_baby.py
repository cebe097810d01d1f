"""Policies for the two caregivers: those of one."""

from dmplay.policies.crying_baby import FeedWhenCrying

POLICIES = {"feed-when-crying": FeedWhenCrying}
PARTNER = "feed-when-crying"
HINT = "feed-when-crying"
