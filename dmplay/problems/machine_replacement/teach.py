"""Rules of thumb of machine replacement."""

from dmplay.game.rules_of_thumb import (
    TAKE_BEST_REWARD,
    TRUST_LAST_OBSERVATION,
    TRUST_LIKELIEST,
    RuleOfThumb,
)

RULES_OF_THUMB = [
    RuleOfThumb("manufacture, as it earns most", lambda _: "manufacture"),
    TAKE_BEST_REWARD,
    TRUST_LIKELIEST,
    TRUST_LAST_OBSERVATION,
]
PUZZLE_DAY = 3
