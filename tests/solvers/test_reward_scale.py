"""Tests that solutions follow the scale of the rewards."""

import re
from pathlib import Path

import pytest

from dmplay.agents.base import AdviceQuestion
from dmplay.core.session import Session
from dmplay.core.text import format_number
from dmplay.core.uniforms import SeededUniforms
from dmplay.evaluation.solutions.solve import solve
from dmplay.game.hints.hint_provider import HintProvider, choose_decimals, format_fixed
from dmplay.registry.problems import load_problem
from tests.fuzz.reward_scales import KINDS, find_difference
from tests.support.programs import run_dmplay

SMALL_MDP = """
discount: 0.95
values: reward
states: s good bad
actions: try rest
start: s
T: try : s
0 0.6 0.4
T: rest : s
1 0 0
T: * : good
1 0 0
T: * : bad
1 0 0
R: try : s : good : * 2e-9
R: try : s : bad : * -1e-9
R: rest : s : * : * 1e-10
R: * : bad : * : * -1e-9
"""
SMALL_POMDP = """
discount: 0.95
values: reward
states: a b
actions: x y
observations: p q
T: *
identity
O: x
0.9 0.1
0.1 0.9
O: y
uniform
R: x : * : * : * -1e-11
R: y : a : * : * 1e-8
R: y : b : * : * -1e-8
"""
SMALL_TREE = """EFG 2 R "x" { "A" "B" }
p "" 1 1 "" { "l" "r" } 0
p "" 2 1 "" { "u" "v" } 0
t "" 1 "" { 2e-10 1e-10 }
t "" 2 "" { 5e-10 5e-11 }
p "" 2 2 "" { "u" "v" } 0
t "" 3 "" { 3e-10 -1e-10 }
t "" 4 "" { 1e-10 4e-10 }
"""


def write_file(folder: Path, suffix: str, text: str) -> str:
    path = folder / f"small.{suffix}"
    path.write_text(text)
    return str(path)


def test_values_of_an_mdp_with_small_rewards_are_exact(tmp_path: Path) -> None:
    solution = solve(load_problem(write_file(tmp_path, "mdp", SMALL_MDP)))
    assert [row["value"] for row in solution.rows] == pytest.approx(
        [4.3076923e-09, 4.0923077e-09, 3.0923077e-09], rel=1e-6
    )
    assert solution.rows[0]["best"] == "try"


def test_values_of_a_pomdp_with_small_rewards_are_exact(tmp_path: Path) -> None:
    solution = solve(load_problem(write_file(tmp_path, "pomdp", SMALL_POMDP)))
    assert "value 8.69194e-08 at the start" in solution.result


def test_values_of_a_game_tree_with_small_payoffs_are_exact(tmp_path: Path) -> None:
    pytest.importorskip("pyspiel")
    solution = solve(load_problem(write_file(tmp_path, "efg", SMALL_TREE)))
    assert solution.result.startswith("value 2e-10 for player-0, 1e-10 for player-1")
    assert solution.rows[0]["best"] == "l"


def test_hints_show_small_values(tmp_path: Path) -> None:
    problem = load_problem(write_file(tmp_path, "mdp", SMALL_MDP))
    provider = HintProvider(Session(problem, SeededUniforms(1), [None]), AdviceQuestion(0, None))
    assert "values: try 4.31e-09, rest 4.19e-09" in provider.create_hint()
    assert provider.current_hint is not None
    assert provider.current_hint.regrets == pytest.approx([0.0, 1.153846e-10], rel=1e-5)


@pytest.mark.parametrize(
    ("values", "texts"),
    [
        ([4.3e-9, 0.0], ["4.3e-09", "0"]),
        ([0.5, 0.5000001], ["0.500000", "0.500000"]),
        ([-1.25, 3.0], ["-1.25", "3.00"]),
        ([0.00002, 0.00003], ["0.000020", "0.000030"]),
    ],
)
def test_a_number_that_decimals_would_hide_has_an_exponent(
    values: list[float], texts: list[str]
) -> None:
    decimals = choose_decimals(values, scale=1e-9)
    assert [format_fixed(value, decimals) for value in values] == texts


@pytest.mark.parametrize("kind", KINDS)
def test_solutions_of_random_problems_follow_the_scale(kind: str, tmp_path: Path) -> None:
    if kind == "efg":
        pytest.importorskip("pyspiel")
    differences = [find_difference(number, tmp_path, kind) for number in range(40)]
    assert not any(differences), differences


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (1250100.0, 6, "1250100"),
        (-1250100.4, 6, "-1250100.4"),
        (3239993.5198515593, 6, "3239993.52"),
        (9999.996, 6, "10000"),
        (1000000001.5, 6, "1000000001.5"),
        (1250100.44, 5, "1250100"),
        (12345.678, 6, "12345.68"),
        (3.1e-9, 6, "3.1e-09"),
        (123456.0, 4, "123456"),
        (1e20, 6, "1e+20"),
        (0.5, 6, "0.5"),
    ],
)
def test_large_numbers_have_no_exponent_and_small_ones_do(
    value: float, digits: int, text: str
) -> None:
    assert format_number(value, digits) == text


@pytest.mark.parametrize(
    "command",
    [
        "run FILE --agent random --episodes 30 --turns 4",
        "compare FILE optimal random --episodes 30 --turns 4",
        "plot returns FILE --agent random --episodes 30 --turns 4",
        "plot values FILE",
        "solve FILE",
        "solve FILE --turns 4",
        "watch value-iteration FILE --iterations 3",
        "play FILE --seed 2 --turns 3",
    ],
)
def test_no_report_prints_large_rewards_with_an_exponent(tmp_path: Path, command: str) -> None:
    text = SMALL_MDP.replace("2e-9", "1250100").replace("-1e-9", "-1250100.5")
    path = write_file(tmp_path, "mdp", text.replace("1e-10", "1250000"))
    typed_lines = "hint\nwhy\nwhatif try\ntry\nhelp\nreview\nundo\nrest\nrest\nrest\n"
    words = command.replace("FILE", path).split()
    output = run_dmplay(tmp_path, *words, stdin=typed_lines).stdout
    assert re.search(r"[0-9]{7}", output)
    assert not re.search(r"[0-9]e\+[0-9]", output), output


def test_a_discount_near_1_gets_no_false_word_about_convergence(tmp_path: Path) -> None:
    text = SMALL_MDP.replace("0.95", "0.999999").replace("1e-10", "4")
    solution = solve(load_problem(write_file(tmp_path, "mdp", text)))
    assert solution.method == "policy iteration"
    assert solution.result == "exact" or solution.result.startswith("error at most ")
    assert solution.rows[0]["value"] == pytest.approx(4e6, rel=1e-9)


def test_all_equal_arms_are_marked_as_best(tmp_path: Path) -> None:
    text = (
        "discount: 0.9\nvalues: reward\nstates: a b c d e\nactions: x y z\nobservations: p q\n"
        "T: *\nidentity\nO: *\nuniform\nR: * : a : * : * 1\nR: * : c : * : * 2\n"
    )
    solution = solve(load_problem(write_file(tmp_path, "pomdp", text)))
    assert [row["best"] for row in solution.rows] == ["*", "*", "*"]
    assert "the bounds of 3 actions overlap" in solution.result
