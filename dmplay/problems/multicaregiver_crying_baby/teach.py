"""Rules of thumb of a baby with several caregivers, and the games of its puzzles."""

from dmplay.problems.crying_baby.teach import FEED_WHEN_CRYING
from dmplay.tutor.puzzle_mining import GameSetup

RULES_OF_THUMB = [FEED_WHEN_CRYING]
PUZZLE_GAMES = [GameSetup({"caregiver2": "random"})]
PUZZLE_DAY = 7
