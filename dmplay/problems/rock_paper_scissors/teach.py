"""Rules of thumb of rock-paper-scissors, and the games of its puzzles."""

from dmplay.game.rules_of_thumb import REPLY_TO_COUNTS, REPLY_TO_LAST
from dmplay.tutor.puzzle_mining import GameSetup

RULES_OF_THUMB = [REPLY_TO_COUNTS, REPLY_TO_LAST._replace(text="beat the other's last action")]
PUZZLE_GAMES = [GameSetup({"agent2": name}) for name in ("beat-last", "frequency")]
PUZZLE_DAY = 6
