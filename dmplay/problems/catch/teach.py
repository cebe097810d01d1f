"""Rules of thumb of catch."""

from dmplay.game.position import Position
from dmplay.game.rules_of_thumb import (
    TAKE_BEST_REWARD,
    TRUST_LAST_OBSERVATION,
    TRUST_LIKELIEST,
    RuleOfThumb,
    get_last_observation,
)


def _repeat_success(position: Position) -> int | None:
    """Repeat the last action if the ball was caught, which is the last observation."""
    is_caught = get_last_observation(position) == "caught"
    return int(position.view.actions[-1]) if is_caught else None


RULES_OF_THUMB = [
    RuleOfThumb("throw the farthest, as it pays most", lambda _: "100"),
    RuleOfThumb("repeat the last throw if it was caught", _repeat_success),
    TAKE_BEST_REWARD,
    TRUST_LIKELIEST,
    TRUST_LAST_OBSERVATION,
]
PUZZLE_DAY = 2
