"""The league's verdicts: agents that should earn a known number do."""

import math

import pytest

import dmplay
from tests.benchmarks import league
from tests.benchmarks.known import Known
from tests.benchmarks.league import Standing, Table

QUICK = (
    "hexworld", "cart-pole", "mountain-car", "simple-regulator", "collision-avoidance",
    "machine-replacement", "catch", "predator-prey",
)  # fmt: skip


def standing(mean: float, error: float) -> Standing:
    return Standing("optimal", mean, error, 1000, 0.0)


def test_a_mean_is_as_many_standard_errors_apart_as_it_is() -> None:
    known = Known(10.0, "arithmetic", "optimal")
    assert standing(9.0, 0.5).apart(known) == 2
    assert standing(10.0, 0.0).apart(known) == 0
    assert standing(9.0, 0.0).apart(known) == math.inf


def test_the_verdict_is_on_the_agent_that_should_reach_the_number() -> None:
    known = Known(10.0, "arithmetic", "optimal")
    other = standing(10.0, 1.0)._replace(agent="random")
    assert league.verdict(known, [other, standing(9.2, 0.5)]) == (
        "optimal reaches it: 1.6 standard errors apart"
    )
    assert "MISSES" in league.verdict(known, [standing(8.9, 0.5), other])
    assert league.verdict(Known(10.0, "a bound"), [standing(0.0, 1.0)]) == ""


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
    assert [*league.measured(name, agents)] == seats


def test_a_game_of_the_league_is_named_for_who_is_measured() -> None:
    problem, known = dmplay.load_problem("multicaregiver-crying-baby"), Known(0.0, "arithmetic")
    named = [str(Table("m", problem, seats, known)) for seats in league.measured("m", 2)]
    assert named == ["m, caregiver1"]
    assert str(Table("m", problem, (0, 1), known)) == "m, team"
    assert str(Table("h", dmplay.load_problem("hexworld"), (0,), known)) == "h"


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK)
def test_the_optimum_is_earned_within_three_standard_errors(name: str) -> None:
    for table in league.tables([name]):
        found = league.standing(table, table.known.agent, league.GAMES // 4)
        assert found is not None
        assert found.apart(table.known) <= 3.0
