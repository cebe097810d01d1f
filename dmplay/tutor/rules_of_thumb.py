"""The names of `dmplay.game.rules_of_thumb`, which older RULES_OF_THUMB import from here."""

from dmplay.game.rules_of_thumb import (
    EXPECT_LIKELIEST,
    REPLY_TO_COUNTS,
    REPLY_TO_LAST,
    TAKE_BEST_REWARD,
    TRUST_LAST_OBSERVATION,
    TRUST_LIKELIEST,
    RuleOfThumb,
    choose_always,
    find_single_best,
    get_last_actions,
    get_last_observation,
)

__all__ = [
    "EXPECT_LIKELIEST",
    "REPLY_TO_COUNTS",
    "REPLY_TO_LAST",
    "TAKE_BEST_REWARD",
    "TRUST_LAST_OBSERVATION",
    "TRUST_LIKELIEST",
    "RuleOfThumb",
    "choose_always",
    "find_single_best",
    "get_last_actions",
    "get_last_observation",
]
