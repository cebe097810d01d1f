"""`dmplay run` and `dmplay compare`: what agents earn, and who is ahead, on the same dice."""

import csv
import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay.cli.errands import interpret_command
from dmplay.errors import BadParameter
from dmplay.finding.topics import read_topic
from dmplay.game.checking import verify_file
from dmplay.game.errand import Printout
from dmplay.measure.comparing import compare
from dmplay.measure.running import run
from dmplay.reports import match
from dmplay.reports.measuring import _run_headline, draw_histogram
from dmplay.rollouts import rollout
from dmplay.transcript.reading import read_transcript
from tests.benchmarks import honest
from tests.support.blocks import file

HEX = dmplay.load_problem("hexworld")


def ran(*words: str) -> str:
    told = interpret_command(words)
    assert isinstance(told, str)
    return told


def test_intervals_hold_the_exact_value_as_often_as_they_say() -> None:
    case = next(honest.cases())
    assert case.name == "hexworld"
    single, paired = honest.held(case, runs=20, episodes=50)
    assert 0.9 <= single <= 1.0
    assert 0.9 <= paired <= 1.0


def test_games_are_played_until_the_error_is_small() -> None:
    found = run(HEX, [dmplay.load_agent(HEX, 0, "optimal")], max_standard_error=0.1, seed=1)
    assert found.seat_summaries[0].returns.standard_error <= 0.1
    assert found.episodes == 1600


def test_many_turns_are_told_in_plain_digits() -> None:
    problem = dmplay.load_problem("hexworld")
    few = run(problem, [dmplay.load_agent(problem, 0, "optimal")], episodes=2)
    for turns, words in ((1.0, "1 turn each"), (4.75, "4.75 turns"), (10_000.0, "10000 turns")):
        assert f" seed 0, {words}" in _run_headline(
            match.EvaluationRequest("hexworld"), few._replace(mean_turns=turns)
        )


def test_the_run_of_a_problem_tells_each_seat() -> None:
    told = ran("run", "hexworld", "--agent", "optimal", "--episodes", "100", "--seed", "3")
    first, *rest = told.splitlines()
    assert first.startswith("hexworld: 100 games of seed 3, 4.7 turns each, 100 % of them to an")
    assert rest[1].split()[:3] == ["seat", "agent", "return"]
    assert "optimal" in rest[2]
    assert "returns:" in rest


def test_a_sweep_has_a_row_for_each_setting() -> None:
    told = json.loads(ran("run", "hexworld", "--set", "slip=0,0.3", "--episodes", "50", "--json"))
    assert [row["slip"] for row in told["runs"]] == [0.0, 0.3]
    assert told["runs"][0]["mean return"] > told["runs"][1]["mean return"]


def test_what_was_set_is_told_and_what_one_game_cannot_tell_is_not() -> None:
    words = ("--set", "slip=0.1", "--episodes", "1")
    told = ran("run", "hexworld", *words)
    assert told.startswith("hexworld slip=0.1: 1 game of seed 0, ")
    assert "inf" not in told
    assert ",,,," in ran("run", "hexworld", *words, "--csv")  # neither error nor interval
    for command in (("run", "hexworld"), ("compare", "hexworld", "optimal", "random")):
        data = json.loads(ran(*command, *words, "--json"))
        assert data["parameters"] == {"slip": 0.1}
    for name in ("compare", "tournament"):
        told = ran(name, "prisoners-dilemma", "grim", "tit-for-tat", "--episodes", "1")
        assert "inf" not in told
    assert ran("compare", "hexworld", "optimal", "random", *words).split()[-1] == "-"
    both = ("compare", "prisoners-dilemma", "grim", "always-defect", "--episodes", "2")
    assert ran(*both).split()[-1] == "-"  # as sure as can be, but not the same play


def test_a_table_for_programs_has_a_row_for_each_seat() -> None:
    words = ("run", "prisoners-dilemma", "--agent", "grim", "--vs", "tit-for-tat", "--turns", "5")
    rows = [*csv.DictReader(ran(*words, "--episodes", "4", "--csv").splitlines())]
    assert [(row["seat"], row["agent"], row["mean return"]) for row in rows] == [
        ("agent1", "grim", "-5.0"),
        ("agent2", "tit-for-tat", "-5.0"),
    ]


def test_agents_are_compared_on_the_same_dice() -> None:
    words = ("compare", "hexworld", "optimal", "random", "--episodes", "200", "--seed", "2")
    told = json.loads(ran(*words, "--json"))
    (pair,) = told["pairs"]
    assert (pair["agent"], pair["against"]) == ("optimal", "random")
    assert 0 < pair["low"] < pair["difference"] < pair["high"]
    one, other = (agent["mean return"] for agent in told["agents"])
    assert pair["difference"] + pair["luck"] == pytest.approx(one - other)


def test_a_comparison_ends_when_it_is_decided() -> None:
    told = ran("compare", "hexworld", "optimal", "random", "--decide", "0.05", "--seed", "2")
    assert told.splitlines()[0].startswith("hexworld: 100 games of seed 2, on the same dice")
    assert told.endswith("decided: optimal earns more (wrong in at most 5 % of comparisons)")


def test_luck_that_nobody_can_tell_is_left_open() -> None:
    words = ("compare", "mountain-car", "pump", "random", "--episodes", "2", "--turns", "3")
    told = ran(*words).splitlines()
    assert told[-1][told[-2].index("by luck")] == "-"


def test_an_agent_is_never_decided_to_be_better_than_itself() -> None:
    optimal = [dmplay.load_agent(HEX, 0, "optimal")]
    found = compare(HEX, [optimal, optimal], episodes=500, decide=0.05)
    assert found.decided is False
    assert found.differences[0, 1].advantage.mean == 0.0
    assert len(found.returns) == 500


def test_a_sweep_is_drawn_with_its_intervals() -> None:
    told = ran("run", "hexworld", "--set", "slip=0,0.3", "--episodes", "50", "--seed", "1")
    head, *rows = told[told.index("mean return of agent") :].splitlines()[:3]
    assert head.startswith("mean return of agent, ")
    assert [row.split()[0] for row in rows] == ["slip=0", "slip=0.3"]
    assert rows[0].index("●") > rows[1].index("●")
    ascii_ = ran("run", "hexworld", "--set", "slip=0,0.3", "--episodes", "50", "--ascii")
    assert ascii_.isascii()


def test_games_of_a_run_are_kept_and_are_those_of_its_rows(tmp_path: Path) -> None:
    words = ["run", "hexworld", "--agent", "random", "--turns", "9", "--episodes", "30", "--seed"]
    words += ["4", "--record", str(tmp_path / "kept"), "--every", "20", "--worst", "1", "--best"]
    kept = json.loads(ran(*words, "2", "--json"))["kept"]
    returns = rollout(
        HEX, [dmplay.load_agent(HEX, 0, "random")], episodes=30, turn_limit=9, seed=4
    ).returns
    assert [row["why"] for row in kept] == ["worst", "best", "best", "every", "every"]
    numbers = [int(Path(row["kept"]).stem.partition("-")[2]) for row in kept]
    assert numbers[-2:] == [0, 20]
    assert [row["return"] for row in kept] == returns[numbers, 0].tolist()
    assert returns[numbers[0], 0] == returns.min()
    assert returns[numbers[1], 0] == returns.max()
    for number, row in zip(numbers, kept, strict=True):
        assert verify_file(Path(row["kept"])).is_ok
        end = read_transcript(row["kept"]).end_block
        assert end
        told = end["end"]
        assert isinstance(told, dict)
        assert told["return"]["agent"] == pytest.approx(returns[number, 0])


def test_a_run_of_so_many_turns_is_played_as_a_game_of_so_many(tmp_path: Path) -> None:
    words = ["run", "catch", "--agent", "optimal", "--turns", "3", "--episodes", "2", "--record"]
    (row,) = json.loads(ran(*words, str(tmp_path / "a"), "--best", "1", "--json"))["kept"]
    assert read_transcript(row["kept"]).header.seats == {"agent": "optimal:horizon=3"}


def test_an_interruption_tells_what_was_played() -> None:
    def stop(share: float) -> None:
        if share > 0.4:
            raise KeyboardInterrupt

    optimal, other = ([dmplay.load_agent(HEX, 0, name)] for name in ("optimal", "random"))
    with ThreadPoolExecutor(1) as thread:
        many: dict[str, Any] = {"episodes": 200, "seed": 5, "workers": 4, "executor": thread}
        found = run(HEX, optimal, progress=stop, **many)
        both = compare(HEX, [optimal, other], progress=stop, **many)
    assert (found.shortfall_reason, both.shortfall_reason) == ("interrupted", "interrupted")
    whole = rollout(HEX, optimal, episodes=200, seed=5)
    assert 0 < found.episodes < 200
    assert np.array_equal(found.rollout.returns, whole.returns[found.episode_numbers])
    assert 0 < len(both.returns) < 200


def test_what_one_game_leaves_open_is_null_in_json() -> None:
    once = ["--episodes", "1", "--json"]
    known = json.loads(ran("run", "hexworld", *once), parse_constant=pytest.fail)["runs"][0]
    assert (known["standard error"], known["low"], known["high"]) == (None, None, None)
    pair = json.loads(
        ran("compare", "hexworld", "random", "optimal", *once), parse_constant=pytest.fail
    )
    assert pair["pairs"][0]["low"] is None


def test_a_report_that_was_cut_short_says_so() -> None:
    assert match.make_report("text", "") == Printout("text")
    stopped = match.make_report("text", "interrupted")
    assert (stopped.text, stopped.exit_code) == ("text", 130)
    assert stopped.stderr_text == "interrupted: this is what was played by then"
    assert match.make_report("text", "games 0 to 9 were lost: why").exit_code == 1


def test_a_histogram_shows_where_returns_lie() -> None:
    assert draw_histogram(np.array([0.0, 0.0, 1.0])) == ("█          ▄", 0.0, 1.0)
    assert draw_histogram(np.array([2.0, 2.0])) == ("█           ", 2.0, 2.0)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["run", "hexworld", "--agent", "human"], "agent: a person cannot play so many games"),
        (["run", "hexworld", "--vs", "random"], "--vs: hexworld has one seat only; use --agent"),
        (["run", "hexworld", "--turns", "0"], "--turns: got 0, expected at least 1"),
        (
            ["tournament", "prisoners-dilemma", "grim", "random", "--turns", "-2"],
            "--turns: got -2, expected at least 1",
        ),
        (["run", "hexworld", "--until-se", "0"], "until-se: got 0, expected more than 0"),
        (
            ["run", "hexworld", "--until-se", "1", "--episodes", "5"],
            "episodes and until-se: expected one of them",
        ),
        (["run", "hexworld", "--workers", "many"], "--workers: got 'many', expected auto or a"),
        (["run", "hexworld", "--json", "--csv"], "--json and --csv: expected one of them"),
        (["run", "hexworld", "--executor", "no:thing"], "--executor: got 'no:thing', expected"),
        (["run", "hexworld", "--worst", "1"], "--every, --worst and --best: expected --record DIR"),
        (["run", "hexworld", "--record", "x"], "--record: expected --every N, --worst N or --best"),
        (["run", "hexworld", "--record", ".", "--best", "1"], "--record: . is not empty; name an"),
        (["compare", "hexworld", "optimal"], "got 1 agent, expected two or more to compare"),
        (["compare", "hexworld", "a", "b"], "unknown agent 'a'"),
        (
            ["compare", "prisoners-dilemma", "grim", "random", "--seat", "agent1=random"],
            "--seat: agent1 is the seat of those who are compared",
        ),
        (
            ["compare", "hexworld", "optimal", "random", "search", "--decide", "0.1"],
            "decide: got 3 agents, expected two",
        ),
        (["compare", "hexworld", "optimal", "random", "--decide", "2"], "decide: got 2, expected"),
    ],
)
def test_what_cannot_be_measured_is_one_line(words: list[str], told: str) -> None:
    with pytest.raises((BadParameter, LookupError), match=told.replace("(", r"\(")):
        interpret_command(words)


def test_of_no_games_there_is_nothing_to_measure() -> None:
    dilemma = dmplay.load_problem("prisoners-dilemma")
    grim = [dmplay.load_agent(dilemma, seat, "grim") for seat in range(2)]
    wanted = "^episodes: got 0, expected a whole number, 1 or more$"
    with pytest.raises(BadParameter, match=wanted):
        run(dilemma, grim, episodes=0)
    with pytest.raises(BadParameter, match=wanted):
        compare(dilemma, [grim, grim], episodes=0)
    with pytest.raises(BadParameter, match=wanted):
        dmplay.run_tournament(dilemma, {"one": grim, "other": grim}, episodes=0)


def test_a_game_without_end_is_played_as_long_as_it_counts_and_its_value_is_told(
    tmp_path: Path,
) -> None:
    tiger = tmp_path / "tiger.pomdp"
    tiger.write_text(file(read_topic("files"), "tiger.pomdp").replace("0.95", "0.2"))
    told = ran("run", str(tiger), "--agent", "optimal", "--episodes", "2")
    assert " 2 games of seed 0, 13 turns each" in told
    assert "\noptimal:horizon=13: value -1.01744 at the start\n" in told
    short = ran("run", str(tiger), "--agent", "optimal", "--episodes", "2", "--turns", "1")
    assert "\noptimal:horizon=1: value -1 at the start\n" in short


def test_where_no_agent_knows_a_problem_chance_plays_it(tmp_path: Path) -> None:
    pendulum = tmp_path / "pendulum.py"
    pendulum.write_text(file(read_topic("problems"), "pendulum.py"))
    assert "\nagent  random  " in ran("run", f"{pendulum}", "--episodes", "2", "--turns", "2")
