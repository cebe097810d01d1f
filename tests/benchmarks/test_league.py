"""Tests of the league's verdicts: agents that should earn a reference return do so."""

import math
from datetime import date

import pytest

import dmplay
from dmplay.guide.topics import read_topic
from dmplay.registry.builtin_names import problem_names
from tests.benchmarks import league, published_returns
from tests.benchmarks.league import AgentResult, LeagueGame
from tests.benchmarks.published_returns import ReferenceReturn

FAST_PROBLEMS = (
    "hexworld", "cart-pole", "mountain-car", "simple-regulator", "collision-avoidance",
    "machine-replacement", "catch", "predator-prey",
)  # fmt: skip
LEAGUE_ROWS = read_topic("league").splitlines()


def make_result(mean: float, error: float) -> AgentResult:
    return AgentResult("optimal", mean, error, 1000, 0.0)


def test_the_distance_to_the_reference_is_in_standard_errors() -> None:
    reference = ReferenceReturn(10.0, "arithmetic", "optimal")
    assert make_result(9.0, 0.5).standard_errors_apart(reference) == 2
    assert make_result(10.0, 0.0).standard_errors_apart(reference) == 0
    assert make_result(9.0, 0.0).standard_errors_apart(reference) == math.inf


def test_the_verdict_is_about_the_agent_that_should_reach_the_reference() -> None:
    reference = ReferenceReturn(10.0, "arithmetic", "optimal")
    other = make_result(10.0, 1.0)._replace(agent="random")
    assert league.format_verdict(reference, [other, make_result(9.2, 0.5)]) == (
        "optimal reaches it: 1.6 standard errors apart"
    )
    assert "MISSES" in league.format_verdict(reference, [make_result(8.9, 0.5), other])
    assert league.format_verdict(ReferenceReturn(10.0, "a bound"), [make_result(0.0, 1.0)]) == ""


def test_a_problem_without_a_reference_is_measured_too(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(league, "find_reference_return", lambda *arguments: None)
    league.report(10, ["catch"], ["random"])
    output = capsys.readouterr().out
    assert "no reference; add one to tests/benchmarks/published_returns.py" in output
    assert "random" in output


def test_a_line_of_the_page_has_the_reference_the_best_agents_and_a_date() -> None:
    game = LeagueGame(
        "catch", dmplay.load_problem("catch"), (0,), ReferenceReturn(171.18, "optimum", "optimal")
    )
    results = [
        AgentResult(agent, mean, error, 10_000, 1.0)
        for agent, mean, error in [
            ("optimal", 171.2, 0.32), ("greedy", 170.9, 1.0), ("search", 166.9, 3.2),
            ("thompson", 165.7, 0.96), ("always-50", 150.0, 0.0), ("always-100", 120.0, 1.0),
            ("random", 113.2, 0.83),
        ]
    ]  # fmt: skip
    line = league.format_standing(game, results, date(2026, 11, 24))
    assert line == (
        "- `catch`: 171.2 (optimum). **optimal 171.2 ± 0.32**, greedy 170.9 ± 1, "
        "search 166.9 ± 3.2, thompson\n"
        "  165.7 ± 0.96, always-50 150, random 113.2 ± 0.83. Measured 2026-11-24."
    )
    page = "# Standings\n\n- `2048`: 1.\n- `catch`: 0.\n  random 0\n- `hexworld`: 4.\n"
    assert league.replace_standing(page, line) == (
        f"# Standings\n\n- `2048`: 1.\n{line}\n- `hexworld`: 4.\n"
    )
    assert league.replace_standing("# Standings\n", line) == f"# Standings\n{line}\n"


@pytest.mark.parametrize("name", problem_names())
def test_every_problem_has_a_reference_and_a_line_in_the_league(name: str) -> None:
    is_team_only = all(
        len(seats) > 1
        for seats in league.iter_measured_seats(name, len(dmplay.load_problem(name).agents))
    )
    problem = dmplay.load_problem(name)
    assert is_team_only or published_returns.find_reference_return(name, problem, 0), (
        f"add {name} to REFERENCE_RETURNS in tests/benchmarks/published_returns.py"
    )
    assert any(row.startswith((f"- `{name}`:", f"- `{name}, ")) for row in LEAGUE_ROWS), (
        f"add a line for {name} to dmplay/guide/80-league.md; "
        f"`python -m tests.benchmarks league --problem {name}` measures it"
    )


@pytest.mark.parametrize(
    ("name", "agents", "seats"),
    [
        ("hexworld", 1, [(0,)]),
        ("prisoners-dilemma", 2, [(0,)]),
        ("predator-prey", 2, [(0,), (1,)]),
        ("multicaregiver-crying-baby", 2, [(0,), (1,), (0, 1)]),
        ("collaborative-predator-prey", 2, [(0, 1)]),
    ],
)
def test_the_league_measures_every_seat_that_differs_and_every_team(
    name: str, agents: int, seats: list[tuple[int, ...]]
) -> None:
    assert [*league.iter_measured_seats(name, agents)] == seats


def test_the_name_of_a_league_game_contains_the_measured_agent() -> None:
    problem = dmplay.load_problem("multicaregiver-crying-baby")
    reference = ReferenceReturn(0.0, "arithmetic")
    names = [
        str(LeagueGame("m", problem, seats, reference))
        for seats in league.iter_measured_seats("m", 2)
    ]
    assert names == ["m, caregiver1"]
    assert str(LeagueGame("m", problem, (0, 1), reference)) == "m, team"
    assert str(LeagueGame("h", dmplay.load_problem("hexworld"), (0,), reference)) == "h"


@pytest.mark.slow
@pytest.mark.parametrize("name", FAST_PROBLEMS)
def test_the_optimum_is_earned_within_three_standard_errors(name: str) -> None:
    for league_game in league.iter_league_games([name]):
        assert league_game.reference is not None
        result = league.measure_agent(
            league_game, league_game.reference.agent, league.DEFAULT_GAMES // 4
        )
        assert result is not None
        assert result.standard_errors_apart(league_game.reference) <= 3.0
