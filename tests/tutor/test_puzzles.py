"""Tests of puzzles: their values, their rules of thumb, their replies, and users' problems."""

import re
from dataclasses import replace
from datetime import date, timedelta
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from dmplay.errors import BadParameter, DmplayError, UnknownName
from dmplay.formats import writer
from dmplay.registry.problem_module_exports import find_export
from dmplay.registry.problems import load_problem
from dmplay.tutor.exercise import ExerciseRun
from dmplay.tutor.puzzles import (
    choose_puzzle,
    find_puzzle,
    find_puzzle_of_the_day,
    list_puzzle_problems,
    list_puzzles,
    make_exercise,
)
from dmplay.tutor.spaced_repetition import load_question_progress, save_first_answer
from tests.oracles.exhaustive_values import ExhaustiveValues
from tests.support.literature_pomdps import make_tiger
from tests.support.programs import run_dmplay

TODAY = date(2026, 11, 28)


@pytest.fixture(autouse=True)
def _state_in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the progress of a test in its own folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


@pytest.mark.parametrize("name", list_puzzle_problems())
def test_the_outcomes_of_every_action_add_up_to_its_value(name: str) -> None:
    for puzzle in list_puzzles(name):
        position = make_exercise(puzzle).question.position
        for action in position.legal_actions:
            parts = position.break_down(action)
            assert parts is not None
            assert parts.adds_up
            assert sum(item.probability for item in parts.outcomes) == pytest.approx(1.0)


@pytest.mark.parametrize("name", list_puzzle_problems())
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
        assert puzzle.rule.text not in text
        assert "belief" not in text
        for answer in right:
            assert ExerciseRun(run.exercise).check_answer(answer).finishes_step


@pytest.mark.parametrize("name", list_puzzle_problems())
def test_the_codes_count_from_1(name: str) -> None:
    listed = list_puzzles(name)
    assert [puzzle.code for puzzle in listed] == [
        f"{name}:{number}" for number in range(1, len(listed) + 1)
    ]


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
        "  with probability 0.15 to (1,2): reward 0, then worth 3.747",
        "  with probability 0.15 to (2,0): reward 0, then worth -10",
        "Try again, or type show for the solution.",
    )
    reply = run.check_answer("nw")
    assert reply.finishes_step
    assert reply.lines[0] == "right."
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
    days = [TODAY + timedelta(number) for number in range(len(list_puzzle_problems()))]
    codes = [find_puzzle_of_the_day(day).code for day in days]
    assert {code.partition(":")[0] for code in codes} == {*list_puzzle_problems()}
    assert find_puzzle_of_the_day(TODAY) == find_puzzle_of_the_day(TODAY)
    later = find_puzzle_of_the_day(TODAY + timedelta(len(list_puzzle_problems())))
    assert later.code != codes[0]


def test_a_missed_puzzle_comes_first_when_it_is_due() -> None:
    missed = find_puzzle("hexworld:3")
    save_first_answer(f"puzzle {missed.code}", is_right=False, today=TODAY)
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
        turns_left = question.position.turns_left
        if turns_left is not None and turns_left <= 4:
            expected = oracle.compute_values(question.game.session)
            np.testing.assert_allclose(question.values, [*expected.values()], atol=1e-6)
            checked += 1
    assert checked >= 2


@pytest.mark.parametrize(("p", "has_puzzle"), [("0.6", True), ("0.5", False)])
def test_two_equally_likely_outcomes_are_no_likeliest_one(
    tmp_path: Path, p: str, *, has_puzzle: bool
) -> None:
    path = tmp_path / "ladder.mdp"
    fall_probability = str(1 - float(p))
    path.write_text(
        "discount: 0.9\nvalues: reward\nstates: ground top fallen\nactions: stay jump\n"
        "start: ground\nT: stay identity\nT: jump : top : top 1\nT: jump : fallen : fallen 1\n"
        f"T: jump : ground : top {p}\nT: jump : ground : fallen {fall_probability}\n"
        "R: * : ground : * : * 3\nR: * : top : * : * 4\n"
    )
    if not has_puzzle:
        with pytest.raises(BadParameter, match="no rule of thumb loses in it"):
            list_puzzles(str(path))
        return
    (puzzle, *_) = list_puzzles(str(path))
    assert puzzle.rule.text.startswith("look only at the likeliest outcome of each action")
    assert puzzle.rule_action == "jump"


def test_a_payoff_table_of_a_user_has_puzzles_against_named_agents(tmp_path: Path) -> None:
    path = tmp_path / "chicken.nfg"
    path.write_text(
        'NFG 1 R "chicken" { "row" "column" } { { "swerve" "dare" } { "swerve" "dare" } } ""\n'
        "3 3 5 1 1 5 0 0\n"
    )
    listed = list_puzzles(str(path))
    assert len(listed) >= 3
    for puzzle in listed:
        question = make_exercise(puzzle).question
        seated = question.game.session.seated_policies
        policies = [item.policy if item else None for item in seated]
        values = ExhaustiveValues(question.problem, 0, policies)
        expected = values.compute_values(question.game.session)
        np.testing.assert_allclose(question.values, [*expected.values()], atol=1e-9)
        text = " ".join(question.describe_game())
        assert "dare against swerve pays 5 to you and 1 to column." in text
        assert "column is the agent " in text
        is_classical = "cooperates" in text
        assert is_classical == ("You cooperate with swerve, and column with swerve." in text)


@pytest.mark.parametrize("is_folder", [False, True])
@pytest.mark.parametrize("stem", ["crying_baby", "prisoners_dilemma"])
def test_a_file_or_folder_of_a_user_has_its_own_rules_of_thumb_and_puzzle_games(
    stem: str, tmp_path: Path, *, is_folder: bool
) -> None:
    folder = Path(find_spec(f"dmplay.problems.{stem}").submodule_search_locations[0])  # type: ignore
    parts = {part: (folder / part).read_text() for part in ("rules.py", "teach.py")}
    for part, text in parts.items() if is_folder else [("all.py", "".join(parts.values()))]:
        (tmp_path / part).write_text(text)
    name = f"{tmp_path}/" if is_folder else f"{tmp_path}/all.py"
    listed, expected_ones = list_puzzles(name), list_puzzles(stem.replace("_", "-"))
    assert len(listed) == len(expected_ones)
    for puzzle, expected in zip(listed, expected_ones, strict=True):
        position = replace(puzzle.position, problem=expected.position.problem)
        assert position == expected.position
        assert (puzzle.rule.text, puzzle.rule_action) == (expected.rule.text, expected.rule_action)
        assert puzzle.loss == pytest.approx(expected.loss)
    text = " ".join(make_exercise(listed[0]).question.describe_game())
    assert ("cooperate against defect pays -4 to you" in text) == (stem == "prisoners_dilemma")


RULE = 'RuleOfThumb("jump", lambda position: {})'


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (f"RULES_OF_THUMB = {RULE}", "RULES_OF_THUMB: got .* expected a list of RuleOfThumb"),
        ("RULES_OF_THUMB = ['jump']", "RULES_OF_THUMB: got .'jump'., expected a list of RuleOf"),
        ("PUZZLE_GAMES = 3", "PUZZLE_GAMES: got 3, expected a list of GameSetup"),
        (
            f"RULES_OF_THUMB = [{RULE}]".format(9),
            "rule of thumb 'jump': got 9, expected None, the name of an action, or 0 to 2",
        ),
        ("RULES_OF_THUMB = [RuleOfThumb('sit', lambda _: 'sit')]", "unknown action 'sit'"),
        ("RULES_OF_THUMB = []", "no rule of thumb loses in it"),
    ],
)
def test_invalid_rules_of_thumb_and_puzzle_games_are_refused(
    line: str, message: str, tmp_path: Path
) -> None:
    folder = Path(find_spec("dmplay.problems.crying_baby").submodule_search_locations[0])  # type: ignore
    imports = "from dmplay import RuleOfThumb\n"
    file = tmp_path / "own.py"
    file.write_text(f"{(folder / 'rules.py').read_text()}{imports}{line}\n")
    with pytest.raises(DmplayError, match=message):
        list_puzzles(str(file))
    result = run_dmplay(tmp_path, "check", "./own.py")
    assert result.returncode == 2 * ("no rule" not in message)
    assert bool(re.search(message, result.stdout)) == ("no rule" not in message)


def test_the_places_of_the_problems_in_the_puzzles_of_the_day_count_from_0() -> None:
    names = list_puzzle_problems()
    places = [find_export(load_problem(name), "PUZZLE_DAY") for name in names]
    assert places == [*range(len(names))]


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
