"""Rules of thumb of the crying baby."""

from dmplay.game.position import Position
from dmplay.game.rules_of_thumb import (
    TAKE_BEST_REWARD,
    TRUST_LAST_OBSERVATION,
    TRUST_LIKELIEST,
    RuleOfThumb,
    get_last_observation,
)


def _feed_when_crying(position: Position) -> int | None:
    """Choose to feed if the last observation is crying, and to ignore if it is quiet."""
    sound = get_last_observation(position)
    if sound is None:
        return None
    return position.labels.index("feed" if sound == "crying" else "ignore")


FEED_WHEN_CRYING = RuleOfThumb(
    "feed the baby after crying, and ignore it after quiet", _feed_when_crying
)
RULES_OF_THUMB = [FEED_WHEN_CRYING, TAKE_BEST_REWARD, TRUST_LIKELIEST, TRUST_LAST_OBSERVATION]
PUZZLE_DAY = 1
