"""Puzzles: positions in which a rule of thumb loses, by number, by day, and by what was missed."""

from datetime import date
from functools import cache, lru_cache
from typing import NamedTuple

from dmplay.errors import BadParameter
from dmplay.game.position import find_exact_agent
from dmplay.game.rules_of_thumb import RuleOfThumb
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.problem_module_exports import find_export
from dmplay.registry.problem_name_kinds import CURRENT_FOLDER
from dmplay.registry.problems import load_problem
from dmplay.tutor.action_question import ActionQuestion, describe_history
from dmplay.tutor.exercise import Exercise
from dmplay.tutor.lesson import PositionText
from dmplay.tutor.positions import open_position
from dmplay.tutor.puzzle_mining import find_rule_belief, mine_candidates
from dmplay.tutor.spaced_repetition import load_question_progress
from dmplay.tutor.truth import format_number

KEY_PREFIX = "puzzle "  # of keys in the file of progress


class Puzzle(NamedTuple):
    """A position, and a rule of thumb that loses there."""

    code: str  # such as "catch:7"
    position: PositionText
    rule: RuleOfThumb
    rule_action: str  # the label of the rule's action
    loss: float  # the best value minus that of the rule's action


def choose_typed_puzzle(code: str, today: date) -> Puzzle:
    """Return the puzzle of a code such as `catch:7`, or the next one of a problem such as `catch`.

    Raise BadParameter if there is none.
    """
    name, number = split_code(code)
    return choose_puzzle(name, today) if number is None else find_puzzle(code)


def find_puzzle(code: str) -> Puzzle:
    """Return the puzzle of a code such as `catch:7`; raise BadParameter if there is none."""
    name, number = split_code(code)
    puzzles = list_puzzles(name)
    if number is None or not 1 <= number <= len(puzzles):
        raise BadParameter(f"puzzle {code}: expected {name}:1 to {name}:{len(puzzles)}")
    return puzzles[number - 1]


def split_code(code: str) -> tuple[str, int | None]:
    """Return the name of the problem and the number of a code; None if it has no number."""
    name, colon, number = code.rpartition(":")
    return (name, int(number)) if colon and number.isdecimal() else (code, None)


def find_puzzle_of_the_day(day: date) -> Puzzle:
    """Return the puzzle of a day, the same for all: a problem a day, then its next puzzle."""
    names = list_puzzle_problems()
    round_number, index = divmod(day.toordinal(), len(names))
    puzzles = list_puzzles(names[index])
    return puzzles[round_number % len(puzzles)]


@cache
def list_puzzle_problems() -> tuple[str, ...]:
    """Return the built-in problems in the order in which the puzzles of the day take turns."""
    places = ((find_export(load_problem(name), "PUZZLE_DAY"), name) for name in problem_names())
    return tuple(name for _, name in sorted(pair for pair in places if pair[0] is not None))


@lru_cache(maxsize=16)
def list_puzzles(name: str) -> tuple[Puzzle, ...]:
    """Return the puzzles of a problem, in the order of their numbers.

    Raise BadParameter if it has none.
    """
    return tuple(
        Puzzle(f"{item.position.problem}:{number}", *item[:3], loss=item.loss)
        for number, item in enumerate(mine_candidates(name), 1)
    )


def choose_puzzle(name: str, today: date) -> Puzzle:
    """Return the puzzle that a player should solve next.

    Of a problem, or of all problems if `name` is empty, it is one that was missed and is due. Else
    it is the puzzle of the day, or the next one that was never asked.
    """
    progress = load_question_progress()
    due_codes = [
        key.removeprefix(KEY_PREFIX)
        for key, entry in progress.items()
        if key.startswith(KEY_PREFIX) and entry.is_due(today)
    ]
    if not name:
        puzzle = find_puzzle_of_the_day(today)
        if _make_progress_key(puzzle) not in progress:
            return puzzle
        own_codes = [code for code in due_codes if split_code(code)[0] in list_puzzle_problems()]
        if own_codes:
            return find_puzzle(own_codes[0])
        name = split_code(puzzle.code)[0]
    puzzles = list_puzzles(name)
    due = [puzzle for puzzle in puzzles if puzzle.code in due_codes]
    new = [puzzle for puzzle in puzzles if _make_progress_key(puzzle) not in progress]
    return [*due, *new, *puzzles][0]


def _make_progress_key(puzzle: Puzzle) -> str:
    """Return the key of a puzzle in the file of progress."""
    return f"{KEY_PREFIX}{puzzle.code}"


def make_exercise(puzzle: Puzzle) -> Exercise:
    """Return the exercise of a puzzle."""
    position = open_position(puzzle.position, CURRENT_FOLDER, trusted=True)
    hint_agent = find_exact_agent(position.session, position.question)
    assert hint_agent is not None  # a puzzle has exact values
    labels = position.session.action_labels(position.seat)
    question = ActionQuestion(position, hint_agent, obvious_action=labels.index(puzzle.rule_action))
    loss, rule = format_number(puzzle.loss, position.problem.reward_scale), puzzle.rule
    learned = [f"Rule of thumb: {rule.text}. Here it says {puzzle.rule_action} and loses {loss}."]
    belief = find_rule_belief(question.position, rule)
    if belief is not None:
        learned.append(f"The rule acts on the belief {question.format_belief(belief)}.")
    introduction = tuple(filter(None, [describe_history(position)]))
    return Exercise(
        _make_progress_key(puzzle), f"puzzle {puzzle.code}", question, introduction, tuple(learned)
    )
