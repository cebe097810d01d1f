"""The line that a player may share: a finished game in short, and the command that plays it."""

from math import ceil

from dmplay.core.text import format_reward
from dmplay.game.game import Game
from dmplay.game.hints.review import ReviewedAction
from dmplay.transcript.format import NATURAL_END_REASONS

MAX_MARKS = 60  # marks of a line; in longer games a mark is about several turns
# for a choice that is not judged, is right, lost little, much (?!) and very much (??)
MARKS, ASCII_MARKS = "·▁▃▅█", "~.-?#"
NOT_JUDGED, RIGHT, LOST_LITTLE, LOST_MUCH, LOST_VERY_MUCH = range(5)


def format_share_line(game: Game, *, ascii_only: bool) -> str:
    """Return problem, seed, score, medal, marks of all turns, and the command of a finished game.

    '' unless a person played it to its end, and its verdict is known.
    """
    verdict, request = game.verdict, game.request
    is_finished = game.session.end_reason in NATURAL_END_REASONS
    if not (verdict.has_facts and is_finished and request and game.human_seats):
        return ""
    score = format_reward(game.session.seat_return(game.human_seats[0]))
    parts = [f"{game.problem_name} seed {game.seed}", f"score {score}"]
    medal = verdict.earned_medal
    parts += [f"{medal.name} medal"] if medal and medal.name else []
    parts += [f"with {' and '.join(verdict.standing.aids)}"] if verdict.standing.aids else []
    parts += [_format_marks(game, ASCII_MARKS if ascii_only else MARKS)] if verdict.moves else []
    return f"{', '.join(parts)}: {request.format_command(game.problem_name, game.seed)}"


def _format_marks(game: Game, marks: str) -> str:
    """Return a mark for each turn, or for the worst of each few turns."""
    turn_count, costly = len(game.session.turns), game.verdict.marks
    levels = [NOT_JUDGED] * turn_count
    for move in game.verdict.moves:
        level = max(levels[move.turn - 1], _rate_choice(move, costly.get(move.turn, "")))
        levels[move.turn - 1] = level
    size = ceil(turn_count / MAX_MARKS)
    groups = [levels[first : first + size] for first in range(0, turn_count, size)]
    text = "".join(marks[max(group)] for group in groups)
    return text if size == 1 else f"{text} ({size} turns each)"


def _rate_choice(move: ReviewedAction, mark: str) -> int:
    """Return the index of the mark of a choice."""
    if mark:
        return LOST_VERY_MUCH if mark == "??" else LOST_MUCH
    if move.is_too_close or move.regret is None:
        return NOT_JUDGED
    return LOST_LITTLE if move.is_mistake else RIGHT
