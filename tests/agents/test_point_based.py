"""Tests of the point-based policy: its bounds, its work limit and its turn limit."""

import numpy as np
import pytest

import dmplay
from dmplay.agents import point_based
from dmplay.agents.base import AdviceQuestion
from dmplay.agents.point_based import PointBasedPolicy, format_bounds, suggest_closer_bounds
from dmplay.core.work_budget import limit_total_work
from dmplay.errors import BadParameter
from dmplay.formats.file_problems import FileProblem
from dmplay.solvers.pomdp import point_based as solver
from dmplay.solvers.pomdp.point_based import PointBasedBounds
from tests.support.literature_pomdps import UnhashableProblem, make_hallway
from tests.support.user_problems import Vault

HALLWAY_MAP = (" + ", "***")


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (18.94, 19.31, "value 18.94 to 19.31 at the start"),
        (-6.254, -2.08, "value -6.3 to -2.0 at the start"),
        (1234.0, 1834.0, "value 1230 to 1840 at the start"),
        (19.37136, 19.37136, "value 19.3714 at the start"),
        (0.0, 0.00123, "value 0.0000 to 0.0013 at the start"),
    ],
)
def test_bounds_are_rounded_outwards_to_the_digits_that_differ(
    low: float, high: float, expected: str
) -> None:
    assert (
        format_bounds(PointBasedBounds(low, high, np.zeros(1), np.zeros(1), (), 1, False))
        == expected
    )


def test_a_work_limit_gives_looser_bounds_and_without_it_the_gap_is_reached() -> None:
    agent = PointBasedPolicy(make_hallway(HALLWAY_MAP), 0, gap=0.5)
    with limit_total_work(2e7):
        limited = agent.bounds
        assert agent.bounds is limited
        assert agent.values_basis(AdviceQuestion()).method.startswith("point-based, value ")
    complete = agent.bounds
    assert complete.is_gap_closed
    assert complete.lower_bound >= limited.lower_bound
    assert complete.upper_bound - complete.lower_bound <= 0.5 * complete.upper_bound
    with limit_total_work(2e7):
        assert agent.bounds is complete
    assert not agent.values_basis(AdviceQuestion()).method


def test_more_work_tightens_bounds_and_is_suggested_while_it_helps(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(solver, "DEFAULT_WORK_LIMIT", 4e7)
    coarse, fine = (
        PointBasedPolicy(make_hallway(HALLWAY_MAP), 0, gap=0.0, work=work) for work in (1.0, 5.0)
    )
    assert (
        fine.bounds.upper_bound - fine.bounds.lower_bound
        < coarse.bounds.upper_bound - coarse.bounds.lower_bound
    )
    assert suggest_closer_bounds(coarse.bounds, 1.0, "work=") == "; for closer bounds: work=10"
    assert suggest_closer_bounds(fine.bounds, 30.0, "work=").endswith(": work=100")
    assert not suggest_closer_bounds(fine.bounds, 100.0, "work=")
    assert not suggest_closer_bounds(fine.bounds._replace(is_gap_closed=True), 1.0, "work=")
    memory_full = fine.bounds._replace(is_memory_full=True)
    assert suggest_closer_bounds(memory_full, 1.0, "work=") == "; memory allows no closer bounds"
    for work in (0.001, 1000.0):
        with pytest.raises(BadParameter, match=r"^work: got .*, expected a number at least 0\.01"):
            PointBasedPolicy(make_hallway(HALLWAY_MAP), 0, work=work)


def test_a_problem_that_is_not_hashable_is_solved_each_time() -> None:
    listing = UnhashableProblem(0.5, model=make_hallway(HALLWAY_MAP).model)
    agent = PointBasedPolicy(listing, 0, gap=0.5)
    assert agent.bounds is not agent.bounds
    assert listing not in [cached.problem for cached in point_based._bounds_cache]


def test_only_legal_actions_are_chosen() -> None:
    agent = PointBasedPolicy(Vault(), 0, horizon=3)
    result = dmplay.rollout(Vault(), [agent], episodes=100, turn_limit=3, seed=1)
    error = result.returns.std() / 10
    assert abs(result.returns.mean() - agent.bounds.lower_bound) <= 2 * error


def test_a_short_turn_limit_is_planned_and_a_long_one_is_treated_as_infinite() -> None:
    problem = make_hallway(HALLWAY_MAP)
    short, long = (
        PointBasedPolicy(problem, 0).adapt_to_game(AdviceQuestion(0, turns)).game_turns
        for turns in (10, 60)
    )
    assert problem.discount**60 < point_based.MAX_IGNORED_END_WEIGHT
    assert (short, long) == (10, None)
    discounted = FileProblem(0.1, model=problem.model)
    assert PointBasedPolicy(discounted, 0).adapt_to_game(AdviceQuestion(0, 4)).game_turns == 4


def test_a_horizon_with_negligible_last_rewards_is_treated_as_infinite() -> None:
    baby = dmplay.load_problem("crying-baby")
    assert [PointBasedPolicy(baby, 0, horizon=turns).game_turns for turns in (200, 300)] == [
        200,
        None,
    ]
