"""Tests of solutions: the values of known cases, the methods and the cache."""

import json
import re
from functools import cache
from hashlib import sha256
from pathlib import Path

import pytest

import dmplay
from dmplay.agents.base import AdviceQuestion
from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.core.text import format_value
from dmplay.core.work_budget import report_progress_to
from dmplay.errors import BadParameter
from dmplay.evaluation.solutions import simulated_returns
from dmplay.evaluation.solutions.options import SolveOptions, use_solve_options
from dmplay.evaluation.solutions.solution import Solution
from dmplay.evaluation.solutions.solve import solve_problem
from dmplay.problems.collaborative_predator_prey import solution as hunting_teams
from dmplay.registry.agents import find_hint_provider
from tests.support.document_examples import TIGER_SOURCE
from tests.support.problem_cases import every_problem, load_small_problem
from tests.support.programs import run_dmplay


def test_the_straight_line_is_solved_by_value_iteration() -> None:
    line_solution = solve_problem(dmplay.load_problem("hexworld:straight-line"))
    assert line_solution.method == "value iteration"
    assert "after 34 sweeps" in line_solution.result
    assert line_solution.rows[5] == {
        "state": "(5,0)",
        "value": pytest.approx(8.219178),
        "best": "e",
    }
    assert line_solution.rows[7]["value"] == 0


def test_without_slips_and_discount_every_hex_is_worth_the_best_exit() -> None:
    hex_solution = solve_problem(dmplay.load_problem("hexworld", slip=0.0, discount=1.0))
    assert "policy iteration" not in hex_solution.result
    exits = {"(0,1)": 5.0, "(2,0)": -10.0, "over": 0.0}
    assert all(row["value"] == exits.get(str(row["state"]), 10.0) for row in hex_solution.rows)


def test_the_infinite_crying_baby_has_two_alpha_vectors() -> None:
    baby_solution = solve_problem(dmplay.load_problem("crying-baby"))
    assert [row["first"] for row in baby_solution.rows] == ["feed", "ignore"]
    assert baby_solution.rows[1]["at sated"] == pytest.approx(-16.305483)


def test_twenty_turns_of_the_crying_baby_are_not_an_endless_game() -> None:
    # 20 is also the number of turns that the problem has by default.
    values = {}
    for turns in (19, 20, 21):
        with use_solve_options(SolveOptions(turns=turns)):
            baby_solution = solve_problem(dmplay.load_problem("crying-baby"))
        assert baby_solution.method == f"alpha vectors, {turns} turns"
        values[turns] = baby_solution.result
    assert values == {
        19: "2 vectors; value -22.1103 at the start",
        20: "2 vectors; value -22.3668 at the start",
        21: "2 vectors; value -22.5976 at the start",
    }


def test_the_machine_has_thirteen_alpha_vectors_for_twenty_turns() -> None:
    assert len(solve_problem(dmplay.load_problem("machine-replacement")).rows) == 13


def test_the_best_first_throw_of_ten_is_at_fifty_metres() -> None:
    catch_solution = solve_problem(dmplay.load_problem("catch"))
    assert [row["first"] for row in catch_solution.rows if row["best"]] == ["50"]


def solve_catch(turns: int, work: float | None = None, **parameters: float) -> Solution:
    with use_solve_options(SolveOptions(turns=turns, work=work)):
        return solve_problem(dmplay.load_problem("catch", **parameters))


@pytest.mark.parametrize(
    ("turns", "value"),
    [(1, "25"), (9, "160.679"), (10, "171.179"), (11, "180.645"), (20, "233.109")],
)
def test_catch_is_solved_for_the_throws_asked_for(turns: int, value: str) -> None:
    span = "1 turn" if turns == 1 else f"{turns} turns"
    assert solve_catch(turns).result == f"value {value} at the start, {span} left"


def test_catch_of_many_throws_is_solved_between_two_bounds() -> None:
    # A longer game is worth more than 20 throws, and less than throws without end.
    catch_solution = solve_catch(30, work=0.05)
    assert catch_solution.method == "point-based, 30 turns"
    low, high = (
        float(number) for number in re.findall(r"value (\S+) to (\S+) at", catch_solution.result)[0]
    )
    assert 233.109 < low <= high < 280


def test_throws_that_the_discount_makes_endless_are_solved_without_end() -> None:
    assert solve_catch(5000, work=0.01).method == "point-based, infinite horizon"


@pytest.mark.parametrize(("discount", "where"), [(1.0, " without a discount"), (0.99, "")])
def test_too_many_throws_are_refused_in_one_line(discount: float, where: str) -> None:
    text = f"^turns: got 2000, expected at most 1000{where}$"
    with pytest.raises(BadParameter, match=text):
        solve_catch(2000, discount=discount)


@pytest.mark.parametrize(
    ("name", "strategy"),
    [
        ("prisoners-dilemma", "defect"),
        ("rock-paper-scissors", "rock 0.3333 paper 0.3333 scissors 0.3333"),
        ("travelers-dilemma", "2"),
    ],
)
def test_a_simple_game_has_its_only_equilibrium(name: str, strategy: str) -> None:
    game_solution = solve_problem(dmplay.load_problem(name))
    assert [row["agent1"] for row in game_solution.rows] == [strategy]


@pytest.fixture
def few_games(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reduce the number of simulated games and the size of plans and bounds."""
    monkeypatch.setattr(simulated_returns, "DEFAULT_EPISODES", 10)
    limits = {"MAX_SIMULATED_EPISODES": 10, "MAX_SIMULATED_TURNS": 20}
    for name, value in (limits | {"PLAN_NODES": 1, "INFORMED_BOUND_WORK": 0}).items():
        monkeypatch.setattr(hunting_teams, name, value)


@pytest.mark.slow
@pytest.mark.usefixtures("few_games")
def test_the_central_planner_of_the_hunt_has_the_known_value() -> None:
    hunt_solution = solve_problem(dmplay.load_problem("collaborative-predator-prey"))
    assert "mean 21.0506 over 1728 states" in hunt_solution.result


def test_the_regulator_is_solved_in_closed_form() -> None:
    assert "U(s) = -(1 s^2 + 0.09)" in solve_problem(dmplay.load_problem("simple-regulator")).result
    undiscounted = solve_problem(dmplay.load_problem("simple-regulator:undiscounted"))
    assert "20 turns" in undiscounted.method


def test_the_pole_is_solved_by_the_gain_of_a_converged_riccati_equation() -> None:
    pole_solution = solve_problem(dmplay.load_problem("cart-pole"))
    assert [row["of"] for row in pole_solution.rows] == ["x", "v", "theta", "omega"]
    residual = float(pole_solution.result.split()[1])
    assert residual < 1e-10
    match = re.search(r"spectral radius (\S+);", pole_solution.result)
    assert match
    assert 0.9 < float(match[1]) < 1


def test_the_car_takes_106_turns_from_the_valley() -> None:
    car_solution = solve_problem(dmplay.load_problem("mountain-car"))
    assert "181 x 141 points" in car_solution.result
    valley = car_solution.rows[0]
    assert valley["start"] == "-0.5 0.0"
    assert valley["turns driven"] == 106
    assert valley["value"] == pytest.approx(-106, abs=1.5)


def test_the_hunt_of_one_predator_and_one_prey_is_solved_exactly() -> None:
    problem = dmplay.load_problem("predator-prey:triangle")
    hunt_solution = solve_problem(problem)
    assert len(hunt_solution.rows) == 9
    assert hunt_solution.method.startswith("equilibrium")
    assert "after 4 rounds" in hunt_solution.result
    caught = hunt_solution.rows[0]
    assert caught["state"] == "(0,1) (0,1)"
    # All hexes are adjacent, so a player that sees the other flee may move to any hex.
    assert caught["value prey"] == pytest.approx(-50 * (float(str(caught["value predator"])) + 10))


def test_joint_plans_of_caregivers_earn_the_value_of_a_central_planner() -> None:
    team_solution = solve_problem(dmplay.load_problem("multicaregiver-crying-baby"))
    for row in team_solution.rows:
        assert row["value"] == pytest.approx(row["one planner"])
        assert float(str(row["value"])) <= float(str(row["one who sees"])) + 1e-9
    assert team_solution.rows[-1]["value"] == pytest.approx(-16.775)
    assert team_solution.rows[-1]["plans"] == "42 x 42"
    assert "infinite horizon: at most -35" in team_solution.result


@cache
def solve_with_progress(name: str) -> tuple[Solution, list[float]]:
    """Solve a small problem; return the solution and the reported shares of the work."""
    shares: list[float] = []
    with report_progress_to(shares.append):
        return solve_problem(load_small_problem(name)), shares


@pytest.mark.usefixtures("few_games", "coarse")
def test_the_hunt_solution_compares_teams_with_a_central_planner() -> None:
    hunt_solution, _ = solve_with_progress("collaborative-predator-prey:triangle")
    assert hunt_solution.rows[0]["team"] == "one planner who sees all"
    assert {row["team"] for row in hunt_solution.rows[1:]} == {
        "reactive", "random", "qmdp", "sweep", "joint-plan:nodes=1",
        "one planner who senses for both",
    }  # fmt: skip
    accuracies = {row["team"]: str(row["evidence"]) for row in hunt_solution.rows}
    assert accuracies["qmdp"].startswith("10 games of up to 20 turns, standard error ")


TIE = """EFG 2 R "Tie" {{ "one" "two" }}
p "" 1 1 "" {{ "keep" "give" }} 0
t "" 1 "keep" {{ 1 1 }}
p "" 2 1 "" {{ "kind" "mean" }} 0
t "" 2 "kind" {{ 2 {kind} }}
t "" 3 "mean" {{ 0 1 }}
"""


@pytest.mark.extra("openspiel")
@pytest.mark.parametrize(("kind", "is_tie"), [(1, True), (3, False)])
def test_a_value_that_rests_on_an_indifferent_player_says_so(
    tmp_path: Path, kind: int, is_tie: bool
) -> None:
    file = tmp_path / "tie.efg"
    file.write_text(TIE.format(kind=kind))
    problem = dmplay.load_problem(str(file))
    note = " if player-1 at a tie chooses the first best action, on which others depend"
    assert solve_problem(problem).result.endswith(", exact" + note * is_tie)
    agent = find_hint_provider(problem, AdviceQuestion(0, None, ("human", "human")))
    assert agent is not None
    first = "first " * is_tie
    assert agent.basis.players == f"if the other agents take their {first}best actions"


def test_a_value_is_printed_without_the_rounding_error_of_its_scale() -> None:
    assert format_value(5.55112e-17, 1.0) == "0"
    assert format_value(-5.55112e-17, 1.0) == "0"
    assert format_value(2.5e-9, 1e-9) == "2.5e-09"
    assert format_value(1e-3, 1.0) == "0.001"


@pytest.mark.usefixtures("few_games")
def test_a_problem_without_an_exact_solution_is_simulated() -> None:
    hunt_solution = solve_problem(dmplay.load_problem("predator-prey:triangle", predators=2))
    assert hunt_solution.method == (
        "not a solution, but a simulation of the agent best-response, "
        "because dmplay has no exact solution for it"
    )
    pair = simulated_returns.solve_by_simulation(
        dmplay.load_problem("predator-prey"), ["chase", "flee"]
    )
    assert "a simulation of the agents chase and flee, because" in pair.method
    assert [row["seat"] for row in hunt_solution.rows] == ["predator1", "predator2", "prey1"]


@pytest.mark.usefixtures("few_games", "coarse")
@every_problem
def test_the_progress_of_a_solution_never_decreases(name: str) -> None:
    problem_solution, shares = solve_with_progress(name)
    assert problem_solution.rows
    assert all(row.keys() == problem_solution.rows[0].keys() for row in problem_solution.rows)
    assert shares == sorted(shares)
    assert not shares or (shares[0] >= 0 and shares[-1] <= 1)


def test_a_solution_is_printed_cached_and_exported_as_json(tmp_path: Path) -> None:
    cache_folder = str(tmp_path / "cache")
    arguments = ["solve", "hexworld", "--set", "slip=0.1"]
    first = run_dmplay(tmp_path, *arguments, XDG_CACHE_HOME=cache_folder)
    assert first.stdout.startswith("hexworld slip=0.1: value iteration\n")
    (cache_file,) = (tmp_path / "cache" / "dmplay" / "solve").iterdir()
    _, text = cache_file.read_text().replace("value iteration", "from the cache").split("\n")
    cache_file.write_text(f"{sha256(text.encode()).hexdigest()}\n{text}")
    assert run_dmplay(tmp_path, *arguments, XDG_CACHE_HOME=cache_folder).stdout.startswith(
        "hexworld slip=0.1: from the cache"
    )
    cache_file.write_text(cache_file.read_text().replace("from the cache", "changed"))
    data = run_dmplay(tmp_path, *arguments, "--json", XDG_CACHE_HOME=cache_folder).stdout
    assert json.loads(data)["method"] == "value iteration"
    assert json.loads(data)["parameters"] == {"slip": 0.1}
    other = run_dmplay(tmp_path, "solve", "hexworld", "--json", XDG_CACHE_HOME=cache_folder).stdout
    assert json.loads(other)["rows"] != json.loads(data)["rows"]


def test_a_user_defined_problem_is_solved_again_after_a_change(tmp_path: Path) -> None:
    code = tmp_path / "tiger.py"
    code.write_text(TIGER_SOURCE)
    before = run_dmplay(tmp_path, "solve", "./tiger.py:Tiger").stdout
    assert "./tiger.py:Tiger: alpha vectors, 10 turns\n" in before
    code.write_text(TIGER_SOURCE.replace("-100", "-10"))
    assert run_dmplay(tmp_path, "solve", "./tiger.py:Tiger").stdout != before


def test_a_simulated_solution_has_the_requested_games_and_turns(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    arguments = ["solve", "2048", "--episodes", "8", "--turns", "5"]
    text = str(interpret_command([*arguments, "--json"]))
    assert json.loads(text)["result"] == "8 games with seed 1, 5 turns on average"
    assert text == interpret_command([*arguments, "--json", "--workers", "auto"])
    single = str(interpret_command(["solve", "2048", "--episodes", "2", "--turns", "1", "--json"]))
    assert json.loads(single)["result"] == "2 games with seed 1, 1 turn on average"
    for option in ("episodes", "workers"):
        text = f"{option}: has no effect, because this solution simulates no games; "
        text += "the method is value iteration"
        with pytest.raises(BadParameter, match=text):
            interpret_command(["solve", "hexworld", f"--{option}", "8"])
    text = "turns: has no effect, because this solution takes no turn limit; the method is support"
    with pytest.raises(BadParameter, match=text):
        interpret_command(["solve", "prisoners-dilemma", "--turns", "8"])


@pytest.mark.usefixtures("few_games", "coarse")
def test_a_team_is_solved_without_end_and_takes_no_number_of_turns(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with pytest.raises(BadParameter, match=r"the method is .*who sees all, infinite horizon"):
        interpret_command(["solve", "collaborative-predator-prey:triangle", "--turns", "2"])


def test_a_pomdp_with_a_turn_limit_is_solved_for_that_limit(tmp_path: Path) -> None:
    problem_path = tmp_path / "six.pomdp"
    problem_path.write_text(
        "discount: 0.8\nvalues: reward\nstates: 6\nactions: 2\nobservations: 2\n"
        "T: *\nuniform\nO: *\nuniform\nR: 0 : * : * : * 10\n"
    )
    solve_output = str(interpret_command(["solve", str(problem_path), "--turns", "11"]))
    assert ": point-based, 11 turns\nvalue 45.705 at the start" in solve_output
    run_output = str(
        interpret_command(
            ["run", str(problem_path), "--agent", "optimal", "--turns", "11", "--episodes", "2"]
        )
    )
    assert "agent  optimal  45.705 ± 0  " in run_output
    assert "\noptimal: value 49.9957 to 50.0000 at the start, infinite horizon\n" in run_output
