"""Puzzles and mistakes as JSON, for course pages and other programs."""

from collections.abc import Sequence
from pathlib import Path

from dmplay.core.text import format_json_report
from dmplay.tutor import mistakes, puzzles
from dmplay.tutor.exercise import Exercise
from dmplay.tutor.progress import current_day


def report_puzzle(code: str, *, with_solution: bool) -> str:
    """Return a puzzle as JSON; its solution only if `with_solution`."""
    puzzle = puzzles.choose_typed_puzzle(code, current_day())
    exercise = puzzles.make_exercise(puzzle)
    position = puzzle.position
    data = {
        "puzzle": puzzle.code,
        **_describe_exercise(exercise),
        "position": {
            "problem": position.problem,
            "seed": position.seed,
            "turns": position.turns,
            "seats": dict(position.seats),
            "after": list(position.after),
        },
    }
    if with_solution:
        rule = {"text": puzzle.rule.text, "action": puzzle.rule_action, "loss": puzzle.loss}
        data["solution"] = {**_describe_solution(exercise), "rule": rule}
    return format_json_report(data)


def report_mistakes(paths: Sequence[Path], *, trusted: bool) -> str:
    """Return the mistakes in games as JSON, with their solutions."""
    exercises = mistakes.choose_mistakes(paths, current_day(), trusted=trusted)
    rows = [
        {
            "mistake": exercise.title,
            **_describe_exercise(exercise),
            "solution": _describe_solution(exercise),
        }
        for exercise in exercises
    ]
    return format_json_report({"mistakes": rows})


def _describe_exercise(exercise: Exercise) -> dict[str, object]:
    """Return the text and the legal actions of an exercise as data."""
    question = exercise.question
    situation = question.describe_situation() if question.shows_board else []
    return {
        "text": [*question.describe_game(), *exercise.introduction, *situation, question.prompt()],
        "actions": question.legal_labels,
    }


def _describe_solution(exercise: Exercise) -> dict[str, object]:
    """Return the right actions, the values and the explanation of an exercise as data."""
    question = exercise.question
    return {
        "best": question.best_actions,
        "right": question.right_actions,
        "values": {
            label: float(value)
            for label, value in zip(question.labels, question.values, strict=True)
            if label in question.legal_labels
        },
        "explanation": [
            question.describe_right_actions(),
            *question.describe_solution(),
            *exercise.learned,
        ],
    }
