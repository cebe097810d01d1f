"""Mistakes: the choices in a recorded game that lost most, as exercises."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from datetime import date
from pathlib import Path

from dmplay.errors import BadParameter, DmplayError
from dmplay.game.hints.review import ReviewedAction, run_review
from dmplay.game.narration import Narrator
from dmplay.game.playback import Playback
from dmplay.game.position import find_exact_agent
from dmplay.game.saves import list_saves
from dmplay.game.seat_snapshot import SeatSnapshot
from dmplay.game.seats import list_human_seats
from dmplay.game.transcript_verification import verify
from dmplay.registry.agents import HintAgent
from dmplay.tutor.action_question import ActionQuestion, describe_history
from dmplay.tutor.exercise import Exercise
from dmplay.tutor.positions import PositionInGame
from dmplay.tutor.progress import QuestionProgress
from dmplay.tutor.puzzle_mining import describe_situation
from dmplay.tutor.spaced_repetition import load_question_progress
from dmplay.tutor.truth import format_number

MAX_MISTAKES = 5  # asked at a time
MAX_SEARCHED_GAMES = 50  # newest saved games that are searched
NO_MISTAKES = "each choice was best, or lost so little that it counts as right"


def list_mistakes(path: Path, *, trusted: bool = False) -> list[Exercise]:
    """Return the choices of people in a recorded game that lost most, worst first.

    No position occurs twice: those with the same state or belief and best action are one.
    Raise BadParameter if the file does not verify, no person plays in it, or the exact values of
    this game are not known.
    """
    report = verify(path, trusted=trusted, compares_frames=False)
    if not report.is_ok and not report.is_unfinished:
        raise BadParameter(f"{path} does not verify; dmplay verify {path} shows the differences")
    game = Playback(path, trusted=trusted)
    list(game.iter_agent_turns())
    seats = list_human_seats(game.player_names)
    if not seats:
        raise BadParameter(f"{path}: no person plays in this game")
    exercises = [pair for seat in seats for pair in _list_seat_mistakes(game, path, seat)]
    by_position: dict[object, Exercise] = {}
    for _, exercise in sorted(exercises, key=lambda pair: -pair[0]):
        question = exercise.question
        situation = describe_situation(question.position)
        by_position.setdefault((question.seat, situation, question.best_action), exercise)
    return [*by_position.values()]


def _list_seat_mistakes(game: Playback, path: Path, seat: int) -> Iterator[tuple[float, Exercise]]:
    """Yield the discounted regret and the exercise of each choice that does not count as right."""
    question = game.advice_question(seat)
    hint_agent = find_exact_agent(game.session, question)
    if hint_agent is None:
        raise BadParameter(
            f"{path}: the exact values of this game are not known; dmplay review shows estimates"
        )
    for choice in run_review(game.session, [question]):
        if choice.regret:
            exercise = _make_exercise(game, path, hint_agent, choice)
            if choice.chosen not in exercise.question.right_actions:
                yield choice.discounted_regret, exercise


def _make_exercise(
    game: Playback, path: Path, hint_agent: HintAgent, choice: ReviewedAction
) -> Exercise:
    """Return the exercise that puts the player before a choice that lost something."""
    seat, regret = hint_agent.question.seat, choice.regret or 0.0
    session = game.session.copy_at_start()
    session.append_turns(game.session.turns[: choice.turn - 1])
    position = PositionInGame(game.problem_name, session, hint_agent.question, choice.turn - 1)
    question = ActionQuestion(
        position, hint_agent, obvious_action=session.action_labels(seat).index(choice.chosen)
    )
    lost = format_number(choice.discounted_regret, choice.scale)
    discounted = f" ({lost} discounted)" if choice.discount_factor < 1.0 else ""
    history = describe_history(position)
    return Exercise(
        f"{_format_key_prefix(path)}{choice.seat} {choice.turn}",
        f"turn {choice.turn} of {path.name}",
        question,
        (history,) if history else (),
        (
            f"In the game, {choice.chosen} was chosen here. "
            f"It lost {format_number(regret, choice.scale)}{discounted}.",
            _describe_choice_turn(game, seat, choice.turn),
        ),
    )


def _describe_choice_turn(game: Playback, seat: int, turn: int) -> str:
    """Return a turn as the player of a seat saw it."""
    session = game.session.copy_at_start()
    session.append_turns(game.session.turns[:turn])
    return Narrator(session, [seat], reveal=False).describe_turn(SeatSnapshot(session, seat))


def choose_mistakes(paths: Sequence[Path], today: date, *, trusted: bool = False) -> list[Exercise]:
    """Return at most five mistakes to ask: those that are due first, then new ones.

    They are from these games; all are asked again if none is due or new. Without paths they are
    from the MAX_SEARCHED_GAMES newest saved games, newest first. Saved games without exact values
    are left out.
    """
    progress = load_question_progress()
    if paths:
        exercises = [item for path in paths for item in list_mistakes(path, trusted=trusted)]
        chosen = [item for item in exercises if _is_new_or_due(progress.get(item.key), today)]
        return _put_due_first(chosen or exercises, progress)[:MAX_MISTAKES]
    due_keys = [key for key, entry in progress.items() if entry.is_due(today)]
    saves = list_saves()[:MAX_SEARCHED_GAMES]
    chosen = []
    for path in sorted(saves, key=lambda path: not _has_key_of_game(due_keys, path)):
        with suppress(DmplayError):
            exercises = list_mistakes(path, trusted=trusted)
            chosen += [item for item in exercises if _is_new_or_due(progress.get(item.key), today)]
        if len(chosen) >= MAX_MISTAKES:
            break
    return _put_due_first(chosen, progress)[:MAX_MISTAKES]


def _is_new_or_due(entry: QuestionProgress | None, today: date) -> bool:
    """Return whether a question was never asked or is due."""
    return entry is None or entry.is_due(today)


def _put_due_first(
    exercises: Sequence[Exercise], progress: Mapping[str, QuestionProgress]
) -> list[Exercise]:
    """Return the exercises in the same order, but those that were asked before come first."""
    return sorted(exercises, key=lambda item: item.key not in progress)


def _has_key_of_game(keys: Sequence[str], path: Path) -> bool:
    """Return whether one of these keys is that of a mistake in a game."""
    return any(key.startswith(_format_key_prefix(path)) for key in keys)


def _format_key_prefix(path: Path) -> str:
    """Return the beginning of the keys of a game's mistakes in the file of progress."""
    return f"mistake {path.resolve()} "
