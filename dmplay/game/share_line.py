"""The line that a player may share: a finished game in short, and the command that plays it."""

from math import ceil

from dmplay.core.action_values import Accuracy
from dmplay.core.text import format_reward
from dmplay.draw.canvas import ASCII_TRANSLATION
from dmplay.game.game import Game
from dmplay.game.hints.review import ReviewedAction
from dmplay.game.verdict import Verdict
from dmplay.transcript.format import NATURAL_END_REASONS

MAX_MARKS = 60  # marks of a line; in longer games a mark is about several turns
# for a choice that is not judged, is right, lost little, much (?!) and very much (??)
LOSS_MARKS = "·▁▃▅█"


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
    parts += [_format_marks(game, ascii_only=ascii_only)] if verdict.moves else []
    return f"{', '.join(parts)}: {request.format_command(game.problem_name, game.seed)}"


def mark_losses(verdict: Verdict, turn_count: int) -> str:
    """Return a mark for each turn, by the choice in it that lost most."""
    marks = [LOSS_MARKS[0]] * turn_count
    for move in verdict.moves:
        index, mark = move.turn - 1, _mark_choice(move, verdict.marks.get(move.turn, ""))
        marks[index] = max(marks[index], mark, key=LOSS_MARKS.index)
    return "".join(marks)


def _mark_choice(move: ReviewedAction, log_mark: str) -> str:
    """Return the mark of a choice in a turn that has this mark in the log, or ''."""
    not_judged, right, lost_little, lost_much, lost_very_much = [*LOSS_MARKS]
    if log_mark:
        return lost_very_much if log_mark == "??" else lost_much
    if move.lost_something:
        return lost_little
    is_rating = move.basis.accuracy is Accuracy.RATING
    is_known = (move.regret is not None or is_rating) and not move.is_too_close
    return right if is_known else not_judged


def _format_marks(game: Game, *, ascii_only: bool) -> str:
    """Return a mark for each turn, or for the worst of each few turns."""
    marks = mark_losses(game.verdict, len(game.session.turns))
    size = ceil(len(marks) / MAX_MARKS)
    groups = [marks[first : first + size] for first in range(0, len(marks), size)]
    text = "".join(max(group, key=LOSS_MARKS.index) for group in groups)
    text = text.translate(ASCII_TRANSLATION) if ascii_only else text
    return text if size == 1 else f"{text} ({size} turns each)"
