"""Tests of puzzles: their values, their rules of thumb, their replies, and users' problems."""

from collections import Counter
from datetime import date, timedelta
from functools import cache
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from dmplay.core.policy import Policy
from dmplay.core.problem import enumerate_outcomes
from dmplay.errors import BadParameter, UnknownName
from dmplay.formats import writer
from dmplay.tutor.exercise import ExerciseRun
from dmplay.tutor.puzzles import (
    PUZZLE_PROBLEMS,
    Puzzle,
    choose_puzzle,
    find_puzzle,
    find_puzzle_of_the_day,
    list_puzzles,
    make_exercise,
)
from dmplay.tutor.repetition import load_question_progress, save_answer
from tests.oracles.exhaustive_values import ExhaustiveValues
from tests.support.literature_pomdps import make_tiger

TODAY = date(2026, 11, 28)
# The most turns left for which all actions, replies and events are tried; 12 for other problems.
EXHAUSTIVE_TURNS = {
    "catch": 2,
    "crying-baby": 4,
    "multicaregiver-crying-baby": 3,
    "predator-prey": 2,
    "rock-paper-scissors": 6,
    "travelers-dilemma": 6,
}

MAX_CHECKED = 4  # puzzles of a problem that are compared


@pytest.fixture(autouse=True)
def _state_in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the progress of a test in its own folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


@cache
def exhaustive_values(
    name: str, seats: tuple[tuple[str, str], ...], policies: tuple[Policy | None, ...]
) -> ExhaustiveValues:
    """Return the values by trying everything, shared by the puzzles of a game."""
    question = make_exercise(list_puzzles(name)[0]).question
    seat = policies.index(None)
    return ExhaustiveValues(question.problem, seat, policies)


def assert_exact(name: str, puzzle: Puzzle) -> bool:
    """Compare the values of a puzzle with those by trying everything, if that is possible."""
    question = make_exercise(puzzle).question
    session = question.position.session
    turns_left = question.valued_position.turns_left
    if turns_left is None or turns_left > EXHAUSTIVE_TURNS.get(name, 12):
        return False
    policies = tuple(seated and seated.policy for seated in session.seated_policies)
    oracle = exhaustive_values(name, tuple(puzzle.position.seats.items()), policies)
    expected = oracle.compute_values(session)
    for label, value in expected.items():
        assert question.values[question.labels.index(label)] == pytest.approx(value, abs=1e-6)
    best = max(expected.values())
    assert question.right_actions[0] in [a for a, v in expected.items() if v > best - 1e-6]
    assert puzzle.loss == pytest.approx(best - expected[puzzle.rule_action], abs=1e-6)
    return True


def test_there_are_a_hundred_puzzles_of_nine_problems() -> None:
    counts = Counter({name: len(list_puzzles(name)) for name in PUZZLE_PROBLEMS})
    assert len(counts) == 9
    assert counts.total() >= 100
    assert min(counts.values()) >= 3


@pytest.mark.parametrize("name", [name for name in PUZZLE_PROBLEMS if "machine" not in name])
def test_the_values_are_those_of_trying_everything(name: str) -> None:
    checked = (puzzle for puzzle in list_puzzles(name) if assert_exact(name, puzzle))
    assert len([*islice(checked, MAX_CHECKED)]) >= 1


def test_without_a_turn_limit_the_values_are_those_of_value_iteration() -> None:
    puzzle = next(p for p in list_puzzles("hexworld") if p.position.turns is None)
    question = make_exercise(puzzle).question
    problem = question.problem
    states = problem.enumerate_states()
    pairs = np.array([(s, a) for s in states for a in range(6)])
    p, outcome = enumerate_outcomes(problem, pairs[:, 0], pairs[:, 1:])
    q = np.zeros((len(states), 6))
    for _ in range(400):
        later = np.where(problem.terminal(outcome.state), 0.0, q.max(axis=1)[outcome.state])
        q = (p * (outcome.rewards[:, :, 0] + 0.9 * later)).sum(axis=1).reshape(q.shape)
    np.testing.assert_allclose(question.values, q[int(question.position.session.state)])


@pytest.mark.parametrize("name", PUZZLE_PROBLEMS)
def test_the_outcomes_of_every_action_add_up_to_its_value(name: str) -> None:
    for puzzle in list_puzzles(name):
        position = make_exercise(puzzle).question.valued_position
        for action in np.flatnonzero(position.legal_actions_mask).tolist():
            outcomes = position.list_outcomes(action)
            assert sum(item.probability for item in outcomes) == pytest.approx(1.0)
            assert position.sum_outcomes(outcomes) == pytest.approx(position.values[action])


@pytest.mark.parametrize("name", PUZZLE_PROBLEMS)
def test_the_action_of_the_rule_is_legal_and_wrong_and_gets_a_reason(name: str) -> None:
    for puzzle in list_puzzles(name):
        run = ExerciseRun(make_exercise(puzzle))
        right = run.exercise.question.right_actions
        assert puzzle.rule_action not in right
        reply = run.check_answer(puzzle.rule_action)
        assert not reply.finishes_step
        assert reply.lines[0].startswith(f"not yet. {puzzle.rule_action} is worth ")
        assert all(line.startswith("  with probability ") for line in reply.lines[1:-1])
        text = " ".join(reply.lines)
        assert puzzle.rule not in text
        assert "belief" not in text
        for answer in right:
            assert ExerciseRun(run.exercise).check_answer(answer).finishes_step


@pytest.mark.parametrize("name", PUZZLE_PROBLEMS)
def test_no_puzzle_occurs_twice(name: str) -> None:
    listed = list_puzzles(name)
    assert [puzzle.code for puzzle in listed] == [
        f"{name}:{number}" for number in range(1, len(listed) + 1)
    ]
    assert len({str((puzzle.position, puzzle.rule_action)) for puzzle in listed}) == len(listed)


def test_a_code_names_the_same_puzzle_again() -> None:
    first = find_puzzle("hexworld:2")
    list_puzzles.cache_clear()
    assert find_puzzle("hexworld:2") == first


def test_west_of_the_hex_that_costs_10_the_straight_way_slips_onto_it() -> None:
    puzzle = next(p for p in list_puzzles("hexworld") if p.rule_action == "w" and p.loss > 1.2)
    run = ExerciseRun(make_exercise(puzzle))
    assert run.check_answer("w").lines == (
        "not yet. w is worth 1.87, 1.488 less than the best action:",
        "  with probability 0.7 to (1,1): reward 0, then worth 4.308",
        "  with probability 0.15 to (2,0): reward 0, then worth -10",
        "  with probability 0.15 to (1,2): reward 0, then worth 3.747",
        "Try again, or type show for the solution.",
    )
    reply = run.check_answer("nw")
    assert reply.finishes_step
    assert reply.lines[0] == "right. nw is worth 3.358."
    assert reply.lines[-1] == (
        "Rule of thumb: walk straight to the nearest good exit. Here it says w and loses 1.488."
    )


def test_the_belief_is_part_of_the_solution_only() -> None:
    exercise = make_exercise(find_puzzle("crying-baby:1"))
    assert not exercise.question.shows_board
    assert exercise.introduction[0].startswith("So far: turn 1: ")
    assert not any("belief" in line for line in exercise.introduction)
    assert exercise.question.describe_solution()[0].startswith("Your belief over the hidden states")


def test_the_solution_is_shown_only_after_a_try() -> None:
    run = ExerciseRun(make_exercise(find_puzzle("hexworld:1")))
    with pytest.raises(BadParameter, match="at least one try"):
        run.show_solution()
    run.check_answer(find_puzzle("hexworld:1").rule_action)
    assert run.show_solution().finishes_step


def test_other_names_of_actions_are_answers_and_others_are_refused() -> None:
    question = make_exercise(find_puzzle("hexworld:1")).question
    assert question.labels[question.parse_answer("NW")] == "nw"
    with pytest.raises(UnknownName, match="unknown action 'northish'"):
        question.parse_answer("northish")


def test_the_puzzle_of_the_day_changes_each_day_and_visits_every_problem() -> None:
    days = [TODAY + timedelta(number) for number in range(len(PUZZLE_PROBLEMS))]
    codes = [find_puzzle_of_the_day(day).code for day in days]
    assert {code.partition(":")[0] for code in codes} == {*PUZZLE_PROBLEMS}
    assert find_puzzle_of_the_day(TODAY) == find_puzzle_of_the_day(TODAY)
    later = find_puzzle_of_the_day(TODAY + timedelta(len(PUZZLE_PROBLEMS)))
    assert later.code != codes[0]


def test_a_missed_puzzle_comes_first_when_it_is_due() -> None:
    missed = find_puzzle("hexworld:3")
    save_answer(f"puzzle {missed.code}", is_right=False, today=TODAY)
    assert choose_puzzle("hexworld", TODAY).code == "hexworld:1"
    assert choose_puzzle("hexworld", TODAY + timedelta(1)) == missed


def test_a_solved_puzzle_is_followed_by_the_next_one() -> None:
    first = choose_puzzle("hexworld", TODAY)
    run = ExerciseRun(make_exercise(first))
    run.check_answer(run.exercise.question.right_actions[0])
    assert load_question_progress()["puzzle hexworld:1"].is_learned
    assert choose_puzzle("hexworld", TODAY).code == "hexworld:2"


def test_a_problem_file_of_a_user_has_puzzles(tmp_path: Path) -> None:
    path = tmp_path / "tiger.pomdp"
    path.write_text(
        "\n".join(writer.iter_problem_lines(make_tiger(), ".pomdp", "")), encoding="utf-8"
    )
    listed = list_puzzles(str(path))
    oracle = ExhaustiveValues(make_exercise(listed[0]).question.problem, 0, [None])
    checked = 0
    for puzzle in listed:
        question = make_exercise(puzzle).question
        turns_left = question.valued_position.turns_left
        if turns_left is not None and turns_left <= 4:
            expected = oracle.compute_values(question.position.session)
            np.testing.assert_allclose(question.values, [*expected.values()], atol=1e-6)
            checked += 1
    assert checked >= 2


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("catch:99", "puzzle catch:99: expected catch:1 to catch:24"),
        ("catch:0", "puzzle catch:0: expected catch:1 to catch:24"),
        ("ctach:1", "unknown problem 'ctach'; did you mean catch"),
        ("cart-pole:1", "no agent knows the exact value of each action"),
        ("hexworld:straight-line:1", "no rule of thumb loses in it"),
    ],
)
def test_a_code_without_a_puzzle_is_refused_in_one_line(code: str, message: str) -> None:
    with pytest.raises((BadParameter, UnknownName), match=message) as error:
        find_puzzle(code)
    assert "\n" not in str(error.value)
