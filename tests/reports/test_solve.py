"""Solutions: the numbers of the book's cases, their method, and their cache."""

import json
import re
from functools import cache
from pathlib import Path

import pytest

import dmplay
from dmplay.budget import report_progress_to
from dmplay.cli.errands import interpret_command
from dmplay.errors import BadParameter
from dmplay.solutions import played, teams
from dmplay.solutions.every import solve_problem
from dmplay.solutions.solution import Solution
from tests.support.blocks import TIGER
from tests.support.cases import every_problem, small
from tests.support.programs import run


def test_the_line_is_solved_by_value_iteration() -> None:
    found = solve_problem(dmplay.load_problem("hexworld:straight-line"))
    assert found.method == "value iteration"
    assert "after 34 sweeps" in found.result
    assert found.rows[5] == {"state": "(5,0)", "value": pytest.approx(8.219178), "best": "e"}
    assert found.rows[7]["value"] == 0


def test_without_slips_and_discount_every_hex_is_worth_the_best_exit() -> None:
    found = solve_problem(dmplay.load_problem("hexworld", slip=0.0, discount=1.0))
    assert "policy iteration" not in found.result
    exits = {"(0,1)": 5.0, "(2,0)": -10.0, "over": 0.0}
    assert all(row["value"] == exits.get(str(row["state"]), 10.0) for row in found.rows)


def test_the_crying_baby_has_two_vectors_without_end() -> None:
    found = solve_problem(dmplay.load_problem("crying-baby"))
    assert [row["first"] for row in found.rows] == ["feed", "ignore"]
    assert found.rows[1]["at sated"] == pytest.approx(-16.305483)


def test_the_machine_has_thirteen_vectors_for_twenty_turns() -> None:
    assert len(solve_problem(dmplay.load_problem("machine-replacement")).rows) == 13


def test_ten_throws_begin_at_fifty_metres() -> None:
    found = solve_problem(dmplay.load_problem("catch"))
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
    found = solve_problem(dmplay.load_problem(name))
    assert [row["agent1"] for row in found.rows] == [first]


@pytest.fixture
def few_games(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is simulated is simulated in a few games, what is planned and bounded is small."""
    monkeypatch.setattr(played, "DEFAULT_EPISODES", 10)
    monkeypatch.setattr(teams, "MAX_SIMULATED_EPISODES", 10)
    limits = (("HUNT_PLAN_NODES", 1), ("MAX_SIMULATED_TURNS", 20), ("INFORMED_BOUND_WORK", 0))
    for name, less in limits:
        monkeypatch.setattr(teams, name, less)


@pytest.mark.slow
@pytest.mark.usefixtures("few_games")
def test_one_planner_of_the_hunt_is_worth_what_the_cases_say() -> None:
    found = solve_problem(dmplay.load_problem("collaborative-predator-prey"))
    assert "mean 21.0506 over 1728 states" in found.result


def test_the_regulator_is_solved_in_closed_form() -> None:
    assert "U(s) = -(1 s^2 + 0.09)" in solve_problem(dmplay.load_problem("simple-regulator")).result
    undiscounted = solve_problem(dmplay.load_problem("simple-regulator:undiscounted"))
    assert "20 turns" in undiscounted.method


def test_the_pole_is_held_by_the_gain_of_a_settled_riccati_equation() -> None:
    found = solve_problem(dmplay.load_problem("cart-pole"))
    assert [row["of"] for row in found.rows] == ["x", "v", "theta", "omega"]
    residual = float(found.result.split()[1])
    assert residual < 1e-10
    left = re.search(r"at most (\S+) of a deviation", found.result)
    assert left
    assert 0.9 < float(left[1]) < 1


def test_the_car_takes_106_turns_from_the_valley() -> None:
    found = solve_problem(dmplay.load_problem("mountain-car"))
    assert "181 x 141 points" in found.result
    valley = found.rows[0]
    assert valley["start"] == "-0.5 0.0"
    assert valley["turns driven"] == 106
    assert valley["value"] == pytest.approx(-106, abs=1.5)


def test_the_hunt_of_one_against_one_is_solved_to_a_gap_of_nothing() -> None:
    problem = dmplay.load_problem("predator-prey:triangle")
    found = solve_problem(problem)
    assert len(found.rows) == 9
    assert found.method.startswith("equilibrium")
    assert "after 4 rounds" in found.result
    caught = found.rows[0]
    assert caught["state"] == "(0,1) (0,1)"
    # Everything is near everything: whoever sees the other flee may as well go anywhere.
    assert caught["value prey"] == pytest.approx(-50 * (float(str(caught["value predator"])) + 10))


def test_joint_plans_of_caregivers_earn_what_one_planner_does() -> None:
    found = solve_problem(dmplay.load_problem("multicaregiver-crying-baby"))
    for row in found.rows:
        assert row["value"] == pytest.approx(row["one planner"])
        assert float(str(row["value"])) <= float(str(row["one who sees"])) + 1e-9
    assert found.rows[-1]["value"] == pytest.approx(-16.775)
    assert found.rows[-1]["plans"] == "42 x 42"
    assert "at most -35 without end" in found.result


@cache
def watched_solution(name: str) -> tuple[Solution, list[float]]:
    """What is found of a small problem, and the shares of the work that were told on the way."""
    shares: list[float] = []
    with report_progress_to(shares.append):
        return solve_problem(small(name)), shares


@pytest.mark.usefixtures("few_games", "coarse")
def test_no_team_that_does_not_see_earns_what_the_planner_does() -> None:
    found, _ = watched_solution("collaborative-predator-prey:triangle")
    assert found.rows[0]["team"] == "one planner who sees all"
    assert {row["team"] for row in found.rows[1:]} == {
        "reactive", "random", "qmdp", "sweep", "joint-plan:nodes=1",
        "one planner who senses for both",
    }  # fmt: skip
    known = {row["team"]: str(row["evidence"]) for row in found.rows}
    assert known["qmdp"].startswith("10 games of 20 turns, +- ")


@pytest.mark.usefixtures("few_games")
def test_what_has_no_exact_solution_is_simulated_and_says_so() -> None:
    found = solve_problem(dmplay.load_problem("predator-prey:triangle", predators=2))
    assert "no exact solution" in found.method
    assert [row["seat"] for row in found.rows] == ["predator1", "predator2", "prey1"]


@pytest.mark.usefixtures("few_games", "coarse")
@every_problem
def test_a_solution_tells_how_far_it_is_and_never_goes_back(name: str) -> None:
    found, shares = watched_solution(name)
    assert found.rows
    assert all(row.keys() == found.rows[0].keys() for row in found.rows)
    assert shares == sorted(shares)
    assert not shares or (shares[0] >= 0 and shares[-1] <= 1)


def test_a_solution_is_printed_kept_and_told_as_data(tmp_path: Path) -> None:
    cache = str(tmp_path / "cache")
    words = ["solve", "hexworld", "--set", "slip=0.1"]
    first = run(tmp_path, *words, XDG_CACHE_HOME=cache)
    assert first.stdout.startswith("hexworld slip=0.1: value iteration\n")
    (kept,) = (tmp_path / "cache" / "dmplay" / "solve").iterdir()
    kept.write_text(kept.read_text().replace("value iteration", "from the cache"))
    assert run(tmp_path, *words, XDG_CACHE_HOME=cache).stdout.startswith(
        "hexworld slip=0.1: from the cache"
    )
    kept.write_text("torn")
    data = run(tmp_path, *words, "--json", XDG_CACHE_HOME=cache).stdout
    assert json.loads(data)["method"] == "value iteration"
    assert json.loads(data)["parameters"] == {"slip": 0.1}
    other = run(tmp_path, "solve", "hexworld", "--json", XDG_CACHE_HOME=cache).stdout
    assert json.loads(other)["rows"] != json.loads(data)["rows"]


def test_a_problem_from_elsewhere_is_solved_as_it_stands_now(tmp_path: Path) -> None:
    code = tmp_path / "tiger.py"
    code.write_text(TIGER)
    before = run(tmp_path, "solve", "./tiger.py:Tiger").stdout
    assert "./tiger.py:Tiger: alpha vectors, 10 turns\n" in before
    code.write_text(TIGER.replace("-100", "-10"))
    assert run(tmp_path, "solve", "./tiger.py:Tiger").stdout != before


def test_what_is_simulated_is_as_many_games_and_turns_as_wished(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    words = ["solve", "2048", "--episodes", "8", "--turns", "5"]
    told = str(interpret_command([*words, "--json"]))
    assert json.loads(told)["result"] == "8 games of seed 1, 5 turns each"
    assert told == interpret_command([*words, "--json", "--workers", "auto"])
    once = str(interpret_command(["solve", "2048", "--episodes", "2", "--turns", "1", "--json"]))
    assert json.loads(once)["result"] == "2 games of seed 1, 1 turn each"
    for one in ("episodes", "workers"):
        told = f"--{one}: nothing is simulated here; the method is value iteration"
        with pytest.raises(BadParameter, match=told):
            interpret_command(["solve", "hexworld", f"--{one}", "8"])
    told = "--turns: nothing is played or planned to a last turn here; the method is support"
    with pytest.raises(BadParameter, match=told):
        interpret_command(["solve", "prisoners-dilemma", "--turns", "8"])


def test_a_hidden_game_of_some_turns_is_solved_for_these_whatever_its_end_counts(
    tmp_path: Path,
) -> None:
    six = tmp_path / "six.pomdp"
    six.write_text(
        "discount: 0.8\nvalues: reward\nstates: 6\nactions: 2\nobservations: 2\n"
        "T: *\nuniform\nO: *\nuniform\nR: 0 : * : * : * 10\n"
    )
    told = str(interpret_command(["solve", str(six), "--turns", "11"]))
    assert ": point-based, 11 turns\nvalue 45.705 at the start" in told
    ran = str(
        interpret_command(
            ["run", str(six), "--agent", "optimal", "--turns", "11", "--episodes", "2"]
        )
    )
    assert "agent  optimal  45.705 ± 0  " in ran
    assert "\noptimal: value 49.9957 to 50.0000 at the start of a game without end\n" in ran
