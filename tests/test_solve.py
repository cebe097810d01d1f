"""Solutions: the numbers of the book's cases, their method, and their cache."""

import json
from pathlib import Path

import pytest

import dmplay
from dmplay.shell import solving
from tests.test_cli import run


def test_the_line_is_solved_by_value_iteration() -> None:
    found = solving.solve(dmplay.load("hexworld:straight-line"))
    assert found.method == "value iteration"
    assert "after 34 sweeps" in found.result
    assert found.rows[5] == {"state": "(5,0)", "value": pytest.approx(8.219178), "best": "e"}
    assert found.rows[7]["value"] == 0


def test_the_crying_baby_has_two_vectors_without_end() -> None:
    found = solving.solve(dmplay.load("crying-baby"))
    assert [row["first"] for row in found.rows] == ["feed", "ignore"]
    assert found.rows[1]["at sated"] == pytest.approx(-16.305483)


def test_the_machine_has_thirteen_vectors_for_twenty_turns() -> None:
    assert len(solving.solve(dmplay.load("machine-replacement")).rows) == 13


def test_ten_throws_begin_at_fifty_metres() -> None:
    found = solving.solve(dmplay.load("catch"))
    assert [row["first"] for row in found.rows if row["best"]] == ["50"]


@pytest.mark.parametrize(
    ("name", "first"),
    [
        ("prisoners-dilemma", "defect"),
        ("rock-paper-scissors", "rock 0.3333 paper 0.3333 scissors 0.3333"),
        ("travelers-dilemma", "2"),
    ],
)
def test_a_simple_game_has_its_only_equilibrium(name: str, first: str) -> None:
    found = solving.solve(dmplay.load(name))
    assert [row["agent1"] for row in found.rows] == [first]


def test_one_planner_of_the_hunt_is_worth_what_the_cases_say() -> None:
    found = solving.solve(dmplay.load("collaborative-predator-prey"))
    assert "mean 21.0506 over 1728 states" in found.result


def test_the_regulator_is_solved_in_closed_form() -> None:
    assert "U(s) = -(1 s^2 + 0.09)" in solving.solve(dmplay.load("simple-regulator")).result
    undiscounted = solving.solve(dmplay.load("simple-regulator:undiscounted"))
    assert "20 turns" in undiscounted.method


def test_what_has_no_exact_solution_is_simulated_and_says_so() -> None:
    found = solving.solve(dmplay.load("cart-pole"))
    assert "no exact solution" in found.method
    assert found.rows[0]["mean return"] == 500


def test_a_solution_is_printed_kept_and_told_as_data(tmp_path: Path) -> None:
    cache = str(tmp_path / "cache")
    words = ["solve", "hexworld", "--set", "slip=0.1"]
    first = run(tmp_path, *words, XDG_CACHE_HOME=cache)
    assert first.stdout.startswith("hexworld: value iteration\n")
    (kept,) = (tmp_path / "cache" / "dmplay" / "solve").iterdir()
    kept.write_text(kept.read_text().replace("value iteration", "from the cache"))
    assert run(tmp_path, *words, XDG_CACHE_HOME=cache).stdout.startswith("hexworld: from the cache")
    kept.write_text("torn")
    data = run(tmp_path, *words, "--json", XDG_CACHE_HOME=cache).stdout
    assert json.loads(data)["method"] == "value iteration"
    other = run(tmp_path, "solve", "hexworld", "--json", XDG_CACHE_HOME=cache).stdout
    assert json.loads(other)["rows"] != json.loads(data)["rows"]
