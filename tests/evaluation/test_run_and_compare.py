"""Tests of `dmplay run` and `dmplay compare`: the returns of agents and their differences on common
random numbers.
"""

import csv
import json
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay.agents.script import Script
from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.core.return_bounds import compute_return_bounds
from dmplay.errors import BadParameter
from dmplay.evaluation.comparison import compare
from dmplay.evaluation.many_games import rollout, run
from dmplay.evaluation.statistics import estimate_mean, explain_doubtful_interval
from dmplay.game.command_line_results import Printout
from dmplay.game.transcript_verification import verify
from dmplay.guide.topics import read_topic
from dmplay.output import evaluation_request
from dmplay.output.evaluation_report import _run_headline, draw_histogram
from dmplay.transcript.reader import read_transcript
from tests.benchmarks import interval_coverage
from tests.support.document_examples import extract_file
from tests.support.programs import run_dmplay
from tests.support.user_problems import Gamble

HEXWORLD = dmplay.load_problem("hexworld")


def run_command(*arguments: str) -> str:
    output = interpret_command(arguments)
    assert isinstance(output, str)
    return output


def test_intervals_contain_the_exact_value_as_often_as_they_claim() -> None:
    case = next(interval_coverage.iter_cases())
    assert case.name == "hexworld"
    single, paired = interval_coverage.measure_coverage(case, runs=20, episodes=50)
    assert 0.9 <= single <= 1.0
    assert 0.9 <= paired <= 1.0


def test_games_are_played_until_the_error_is_small() -> None:
    result = run(
        HEXWORLD, [dmplay.load_agent(HEXWORLD, 0, "optimal")], max_standard_error=0.1, seed=1
    )
    assert result.seat_summaries[0].returns.standard_error <= 0.1
    assert result.episodes == 1600


def test_large_turn_counts_are_printed_in_plain_digits() -> None:
    problem = dmplay.load_problem("hexworld")
    result = run(problem, [dmplay.load_agent(problem, 0, "optimal")], episodes=2)
    for turns, text in ((1.0, "1 turn on"), (4.75, "4.75 turns"), (10_000.0, "10000 turns")):
        assert f" seed 0, {text}" in _run_headline(
            evaluation_request.EvaluationRequest("hexworld"), result._replace(mean_turns=turns)
        )


def test_a_run_reports_each_seat() -> None:
    output = run_command(
        "run", "hexworld", "--agent", "optimal", "--episodes", "100", "--seed", "3"
    )
    title, *lines = output.splitlines()
    assert title.startswith("hexworld: 100 games with seed 3, 4.7 turns on average, 100 % ended")
    assert lines[1].split()[:3] == ["seat", "agent", "return"]
    assert "optimal" in lines[2]
    assert "returns:" in lines


def test_a_run_says_when_its_interval_may_not_hold_the_mean() -> None:
    """A collision costs 1 and happens in about 1 of 2,500 games of the agent."""
    rare = run_command("run", "collision-avoidance", "--agent", "optimal", "--episodes", "2000")
    reason = "an event rarer than 1 in 667 games may be missing; it could move the mean by up to 0."
    assert f"the interval of agent is in doubt: {reason}" in rare
    frequent = run_command("run", "crying-baby", "--agent", "optimal", "--episodes", "2000")
    assert "in doubt" not in frequent


@pytest.mark.parametrize(
    ("name", "agent"),
    [("hexworld", "optimal"), ("hexworld", "random"), ("machine-replacement", "optimal"),
     ("machine-replacement", "random"), ("cart-pole", "random"), ("crying-baby", "optimal")],
)  # fmt: skip
@pytest.mark.parametrize("size", [100, 1000])
def test_an_interval_that_holds_the_mean_as_often_as_it_says_is_rarely_in_doubt(
    name: str, agent: str, size: int
) -> None:
    problem, runs = dmplay.load_problem(name), 200
    returns = dmplay.rollout(
        problem, [dmplay.load_agent(problem, 0, agent)], episodes=runs * size, turn_limit=120
    ).returns[:, 0]
    bounds = compute_return_bounds(problem, 120)
    samples = returns.reshape(runs, size)
    covered = [e.low <= returns.mean() <= e.high for e in map(estimate_mean, samples)]
    assert np.mean(covered) > 0.95 - 4 * (0.95 * 0.05 / runs) ** 0.5
    assert np.mean([bool(explain_doubtful_interval(sample, bounds)) for sample in samples]) <= 0.2


def test_the_bounds_of_the_returns_of_hexworld_are_those_of_its_worst_and_best_games() -> None:
    low, high = compute_return_bounds(dmplay.load_problem("hexworld"), None) or (0.0, 0.0)
    assert (low, high) == pytest.approx((-10.0, 10.0))
    costly = dmplay.load_problem("hexworld", bump_cost=3.0)
    assert costly.return_bounds == pytest.approx((-30.0, 10.0))


def test_a_sweep_has_a_row_for_each_setting() -> None:
    data = json.loads(
        run_command("run", "hexworld", "--set", "slip=0,0.3", "--episodes", "50", "--json")
    )
    assert [row["slip"] for row in data["runs"]] == [0.0, 0.3]
    assert data["runs"][0]["mean_return"] > data["runs"][1]["mean_return"]


def test_settings_are_reported_and_unknown_errors_are_left_empty() -> None:
    options = ("--set", "slip=0.1", "--episodes", "1")
    output = run_command("run", "hexworld", *options)
    assert output.startswith("hexworld slip=0.1: 1 game with seed 0, ")
    assert not re.search(r"\binf\b", output)
    assert ",,,," in run_command("run", "hexworld", *options, "--csv")  # neither error nor interval
    for command in (("run", "hexworld"), ("compare", "hexworld", "optimal", "random")):
        data = json.loads(run_command(*command, *options, "--json"))
        assert data["parameters"] == {"slip": 0.1}
        assert data["schema"] == 1
    for name in ("compare", "tournament"):
        output = run_command(name, "prisoners-dilemma", "grim", "tit-for-tat", "--episodes", "1")
        assert not re.search(r"\binf\b", output)
    assert run_command("compare", "hexworld", "optimal", "random", *options).split()[-1] == "-"
    arguments = ("compare", "prisoners-dilemma", "grim", "always-defect", "--episodes", "2")
    # The difference is certain, although the agents play differently.
    assert run_command(*arguments).split()[-1] == "-"


def test_a_table_for_programs_has_a_row_for_each_seat() -> None:
    arguments = (
        "run",
        "prisoners-dilemma",
        "--agent",
        "grim",
        "--vs",
        "tit-for-tat",
        "--turns",
        "5",
    )
    rows = [*csv.DictReader(run_command(*arguments, "--episodes", "4", "--csv").splitlines())]
    assert [(row["seat"], row["agent"], row["mean return"]) for row in rows] == [
        ("agent1", "grim", "-5.0"),
        ("agent2", "tit-for-tat", "-5.0"),
    ]


def test_agents_are_compared_on_common_random_numbers() -> None:
    arguments = ("compare", "hexworld", "optimal", "random", "--episodes", "200", "--seed", "2")
    data = json.loads(run_command(*arguments, "--json"))
    (pair,) = data["pairs"]
    assert (pair["agent"], pair["against"]) == ("optimal", "random")
    assert 0 < pair["low"] < pair["difference"] < pair["high"]
    first, second = (agent["mean_return"] for agent in data["agents"])
    assert pair["difference"] + pair["luck"] == pytest.approx(first - second)


def test_a_comparison_ends_when_it_is_decided() -> None:
    output = run_command(
        "compare", "hexworld", "optimal", "random", "--decide", "0.05", "--seed", "2"
    )
    assert output.splitlines()[0].startswith("hexworld: 100 games with seed 2, on the same random")
    assert output.endswith("decided: optimal earns more (wrong in at most 5 % of comparisons)")


def test_a_decision_needs_bounds_of_returns_unless_it_is_asymptotic() -> None:
    words = ("compare", "2048", "corner", "random", "--episodes", "600", "--turns", "100")
    with pytest.raises(BadParameter, match="decide: the returns of this problem have no known"):
        run_command(*words, "--decide", "0.05")
    with pytest.raises(BadParameter, match="bounds: two returns differ by "):
        run_command(*words, "--decide", "0.05", "--bounds", "0,100")
    assert run_command(*words, "--decide", "0.05", "--bounds", "0,4000").endswith(
        "decided: corner earns more (wrong in at most 5 % of comparisons)"
    )
    assert run_command(*words, "--decide", "0.05", "--asymptotic").endswith(
        "(asymptotic: wrong in about 5 % of comparisons or fewer if there are many games)"
    )


def test_equal_agents_with_rare_large_losses_are_not_told_apart() -> None:
    game = Gamble()
    policies = [[Script(game, 0, (action,))] for action in (0.0, 1.0)]
    results = [compare(game, policies, decide=0.05, episodes=500, seed=n) for n in range(60)]
    assert sum(bool(result.decided) for result in results) <= 3
    guesses = [
        compare(game, policies, decide=0.05, episodes=500, seed=n, asymptotic=True)
        for n in range(60)
    ]
    assert sum(bool(result.decided) for result in guesses) > 10


def test_an_unknown_control_variate_is_left_blank() -> None:
    arguments = ("compare", "mountain-car", "pump", "random", "--episodes", "2", "--turns", "3")
    lines = run_command(*arguments).splitlines()
    assert lines[-1][lines[-2].index("luck")] == "-"


@pytest.mark.parametrize("scale", [1e-8, 1e-12, 1e8])
def test_a_comparison_follows_the_scale_of_the_rewards(tmp_path: Path, scale: float) -> None:
    pairs = []
    for number, factor in enumerate((1.0, scale)):
        path = tmp_path / f"{number}.mdp"
        path.write_text(
            "discount: 0.9\nvalues: reward\nstates: low high\nactions: stay go\nstart: low\n"
            "T: stay identity\nT: go uniform\n"
            f"R: * : high : * : * {3 * factor!r}\nR: go : * : * : * {-0.1 * factor!r}\n"
        )
        words = ("compare", str(path), "optimal", "random", "--episodes", "200", "--turns", "9")
        (pair,) = json.loads(run_command(*words, "--json"))["pairs"]
        pairs.append((pair, factor))
    (pair, _), (scaled, _) = pairs
    for name in ("difference", "low", "high", "luck"):
        assert scaled[name] / scale == pytest.approx(pair[name], rel=1e-6)


def test_an_agent_is_never_decided_to_be_better_than_itself() -> None:
    optimal = [dmplay.load_agent(HEXWORLD, 0, "optimal")]
    comparison = compare(HEXWORLD, [optimal, optimal], episodes=500, decide=0.05)
    assert comparison.decided is False
    assert comparison.differences[0, 1].advantage.mean == 0.0
    assert len(comparison.returns) == 500


def test_a_sweep_is_drawn_with_its_intervals() -> None:
    output = run_command(
        "run", "hexworld", "--set", "slip=0,0.3", "--episodes", "50", "--seed", "1"
    )
    head, *rows = output[output.index("mean return of agent") :].splitlines()[:3]
    assert head.startswith("mean return of agent, ")
    assert [row.split()[0] for row in rows] == ["slip=0", "slip=0.3"]
    assert rows[0].index("●") > rows[1].index("●")
    ascii_ = run_command("run", "hexworld", "--set", "slip=0,0.3", "--episodes", "50", "--ascii")
    assert ascii_.isascii()


def test_recorded_games_of_a_run_match_its_rows(tmp_path: Path) -> None:
    arguments = [
        "run",
        "hexworld",
        "--agent",
        "random",
        "--turns",
        "9",
        "--episodes",
        "30",
        "--seed",
    ]
    arguments += [
        "4",
        "--record",
        str(tmp_path / "kept"),
        "--every",
        "20",
        "--worst",
        "1",
        "--best",
    ]
    records = json.loads(run_command(*arguments, "2", "--json"))["kept"]
    returns = rollout(
        HEXWORLD, [dmplay.load_agent(HEXWORLD, 0, "random")], episodes=30, turn_limit=9, seed=4
    ).returns
    assert [row["why"] for row in records] == ["worst", "best", "best", "every", "every"]
    numbers = [int(Path(row["kept"]).stem.partition("-")[2]) for row in records]
    assert numbers[-2:] == [0, 20]
    assert [row["return"] for row in records] == returns[numbers, 0].tolist()
    assert returns[numbers[0], 0] == returns.min()
    assert returns[numbers[1], 0] == returns.max()
    for number, row in zip(numbers, records, strict=True):
        assert verify(Path(row["kept"])).is_ok
        end = read_transcript(row["kept"]).end_block
        assert end
        result = end["end"]
        assert isinstance(result, dict)
        assert result["return"]["agent"] == pytest.approx(returns[number, 0])


def test_a_run_with_a_turn_limit_uses_the_plan_for_that_limit(tmp_path: Path) -> None:
    arguments = [
        "run",
        "catch",
        "--agent",
        "optimal",
        "--turns",
        "3",
        "--episodes",
        "2",
        "--record",
    ]
    (row,) = json.loads(run_command(*arguments, str(tmp_path / "a"), "--best", "1", "--json"))[
        "kept"
    ]
    assert read_transcript(row["kept"]).header.seats == {"agent": "optimal:horizon=3"}


def test_an_interrupted_run_reports_the_games_played() -> None:
    def stop(share: float) -> None:
        if share > 0.4:
            raise KeyboardInterrupt

    optimal, other = ([dmplay.load_agent(HEXWORLD, 0, name)] for name in ("optimal", "random"))
    with ThreadPoolExecutor(1) as thread:
        options: dict[str, Any] = {"episodes": 200, "seed": 5, "workers": 4, "executor": thread}
        result = run(HEXWORLD, optimal, progress=stop, **options)
        comparison = compare(HEXWORLD, [optimal, other], progress=stop, **options)
    assert (result.shortfall_reason, comparison.shortfall_reason) == ("interrupted", "interrupted")
    full_rollout = rollout(HEXWORLD, optimal, episodes=200, seed=5)
    assert 0 < result.episodes < 200
    assert np.array_equal(result.rollout.returns, full_rollout.returns[result.episode_numbers])
    assert 0 < len(comparison.returns) < 200


def test_unknown_errors_of_one_game_are_null_in_json() -> None:
    options = ["--episodes", "1", "--json"]
    summary = json.loads(run_command("run", "hexworld", *options), parse_constant=pytest.fail)[
        "runs"
    ][0]
    assert (summary["standard_error"], summary["low"], summary["high"]) == (None, None, None)
    pair = json.loads(
        run_command("compare", "hexworld", "random", "optimal", *options),
        parse_constant=pytest.fail,
    )
    assert pair["pairs"][0]["low"] is None


def test_a_report_that_was_cut_short_says_so() -> None:
    assert evaluation_request.make_evaluation_report("text", "") == Printout("text")
    stopped = evaluation_request.make_evaluation_report("text", "interrupted")
    assert (stopped.text, stopped.exit_code) == ("text", 130)
    assert stopped.stderr_text == "interrupted: the report covers only the games played before"
    assert (
        evaluation_request.make_evaluation_report("text", "games 0 to 9 were lost: why").exit_code
        == 1
    )


def test_a_histogram_shows_where_returns_lie() -> None:
    assert draw_histogram(np.array([0.0, 0.0, 1.0])) == ("█          ▄", 0.0, 1.0)
    assert draw_histogram(np.array([2.0, 2.0])) == ("█           ", 2.0, 2.0)
    assert draw_histogram(np.array([0.0])) == ("█           ", 0.0, 0.0)


def test_a_histogram_of_sums_that_differ_by_rounding_is_one_bar() -> None:
    sums = np.array([0.1 + 0.2 + 0.3, 0.3 + 0.2 + 0.1])
    assert sums[0] != sums[1]
    assert draw_histogram(sums)[0] == "█           "


def test_a_histogram_of_huge_returns_does_not_overflow() -> None:
    assert draw_histogram(np.array([-1.7e308, 1.7e308]))[0] == "█          █"
    assert draw_histogram(np.array([1e200, np.nextafter(1e200, 2e200)]))[0] == "█           "


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "hexworld", "--agent", "human"], "agent: a person cannot play many games"),
        (["run", "hexworld", "--vs", "random"], "--vs: hexworld has only one seat; use --agent"),
        (["run", "hexworld", "--turns", "0"], "--turns: got 0, expected at least 1"),
        (["tournament", "prisoners-dilemma", "grim", "random", "--turns", "-2"],
         "--turns: got -2, expected at least 1"),
        (["run", "hexworld", "--until-se", "0"], "until-se: got 0, expected more than 0"),
        (["run", "hexworld", "--until-se", "1", "--episodes", "5"],
         "episodes and until-se: got both, expected only one"),
        (["run", "hexworld", "--workers", "many"], "--workers: got 'many', expected auto or a"),
        (["run", "hexworld", "--json", "--csv"], "--json and --csv: expected only one of them"),
        (["run", "hexworld", "--executor", "no:thing"], "--executor: got 'no:thing', expected"),
        (["run", "hexworld", "--worst", "1"], "--every, --worst and --best: expected --record DIR"),
        (["run", "hexworld", "--record", "x"], "--record: expected --every N, --worst N or --best"),
        (["run", "hexworld", "--record", ".", "--best", "1"], "--record: . is not empty; name an"),
        (["compare", "hexworld", "optimal"], "got 1 agent, expected at least 2"),
        (["compare", "hexworld", "a", "b"], "unknown agent 'a'"),
        (["compare", "prisoners-dilemma", "grim", "random", "--seat", "agent1=random"],
         "--seat: agent1 is the seat of the compared agents; set another seat"),
        (["compare", "hexworld", "optimal", "random", "search", "--decide", "0.1"],
         "decide: got 3 agents, expected 2"),
        (["compare", "hexworld", "optimal", "random", "--decide", "2"], "decide: got 2, expected"),
        (["compare", "hexworld", "optimal", "random", "--bounds", "0,1"], "expected --decide P"),
        (["compare", "hexworld", "optimal", "random", "--decide", ".1", "--bounds", "1,0"],
         "--bounds: got '1,0', expected two numbers, such as -100,20"),
    ],
)  # fmt: skip
def test_a_run_or_comparison_that_cannot_work_gives_a_clear_error(
    arguments: list[str], message: str
) -> None:
    with pytest.raises((BadParameter, LookupError), match=message.replace("(", r"\(")):
        interpret_command(arguments)


def test_too_few_and_too_many_episodes_are_refused() -> None:
    dilemma = dmplay.load_problem("prisoners-dilemma")
    grim = [dmplay.load_agent(dilemma, seat, "grim") for seat in range(2)]
    message = "^episodes: got 0, expected a whole number, 1 or more$"
    with pytest.raises(BadParameter, match=message):
        run(dilemma, grim, episodes=0)
    with pytest.raises(BadParameter, match=message):
        compare(dilemma, [grim, grim], episodes=0)
    with pytest.raises(BadParameter, match=message):
        dmplay.run_tournament(dilemma, {"one": grim, "other": grim}, episodes=0)
    with pytest.raises(BadParameter, match="expected at most 1000000000"):
        run(dilemma, grim, episodes=10**18)


def test_the_name_of_one_array_to_keep_needs_no_list() -> None:
    named, listed = (
        dmplay.rollout("hexworld", "random", episodes=2, keep=keep)
        for keep in ("returns", ["returns"])
    )
    assert repr(named) == repr(listed)


def test_an_endless_game_is_played_until_its_discount_is_negligible(tmp_path: Path) -> None:
    tiger = tmp_path / "tiger.pomdp"
    tiger.write_text(extract_file(read_topic("files"), "tiger.pomdp").replace("0.95", "0.2"))
    output = run_command("run", str(tiger), "--agent", "optimal", "--episodes", "2")
    assert " 2 games with seed 0, 13 turns on average" in output
    assert "\noptimal:horizon=13: value -1.01744 at the start\n" in output
    short = run_command("run", str(tiger), "--agent", "optimal", "--episodes", "2", "--turns", "1")
    assert "\noptimal:horizon=1: value -1 at the start\n" in short


def test_a_problem_without_agents_is_played_at_random(tmp_path: Path) -> None:
    pendulum = tmp_path / "pendulum.py"
    pendulum.write_text(extract_file(read_topic("problems"), "pendulum.py"))
    assert "\nagent  random  " in run_command(
        "run", f"{pendulum}", "--episodes", "2", "--turns", "2"
    )


@pytest.mark.parametrize("episodes", ["5", "10", "200"])
def test_a_script_as_long_as_the_game_plays_any_number_of_games(
    tmp_path: Path, episodes: str
) -> None:
    arguments = ("run", "prisoners-dilemma", "--agent", "script:defect", "--turns", "1")
    done = run_dmplay(tmp_path, *arguments, "--episodes", episodes)
    assert (done.returncode, done.stderr) == (0, "")


def test_values_in_json_lines_name_the_game_that_they_are_about(tmp_path: Path) -> None:
    done = run_dmplay(tmp_path, "prisoners-dilemma", "--seed", "7", "--json", stdin="values\n")
    (event,) = [event for event in map(json.loads, done.stdout.splitlines()) if "values" in event]
    assert event == {
        "event": "values", "seat": "agent1", "about": "10 turns left, against tit-for-tat",
        "values": {"cooperate": -9.0, "defect": -11.0}, "accuracy": "exact",
    }  # fmt: skip


def test_values_are_numbers_in_json_lines(tmp_path: Path) -> None:
    done = run_dmplay(tmp_path, "hexworld", "--seed", "7", "--json", stdin="values\n")
    (event,) = [event for event in map(json.loads, done.stdout.splitlines()) if "values" in event]
    assert (event["event"], event["seat"]) == ("values", "agent")
    assert {name: round(value, 2) for name, value in event["values"].items()} == {
        "e": 6.27, "ne": 5.47, "nw": 5.35, "w": 5.54, "sw": 6.28, "se": 7.04,
    }  # fmt: skip
