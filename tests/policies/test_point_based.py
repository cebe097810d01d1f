import numpy as np
import pytest

import dmplay
from dmplay.budget import limit_total_work
from dmplay.errors import BadParameter
from dmplay.files.problem import FileProblem
from dmplay.policies import point_based
from dmplay.policies.point_based import PointBasedPolicy, format_bounds, suggest_more_work
from dmplay.solvers import point_based as solver
from dmplay.solvers.point_based import PointBasedBounds
from tests.support.brought import Vault
from tests.support.hidden import Listing, hallway

ROOMS = (" + ", "***")


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        (18.94, 19.31, "value 18.94 to 19.31 at the start"),
        (-6.254, -2.08, "value -6.3 to -2.0 at the start"),
        (1234.0, 1834.0, "value 1230 to 1840 at the start"),
        (19.37136, 19.37136, "value 19.3714 at the start"),
        (0.0, 0.00123, "value 0.0000 to 0.0013 at the start"),
    ],
)
def test_bounds_are_told_outwards_in_as_many_digits_as_differ(
    low: float, high: float, words: str
) -> None:
    assert (
        format_bounds(PointBasedBounds(low, high, np.zeros(1), np.zeros(1), (), 1, False)) == words
    )


def test_who_is_in_a_hurry_has_less_and_who_is_not_the_whole() -> None:
    agent = PointBasedPolicy(hallway(ROOMS), 0, gap=0.5)
    with limit_total_work(2e7):
        hurried = agent.bounds
        assert agent.bounds is hurried
        assert agent.hint_basis.startswith("point-based, value ")
    whole = agent.bounds
    assert whole.is_gap_closed
    assert whole.lower_bound >= hurried.lower_bound
    assert whole.upper_bound - whole.lower_bound <= 0.5 * whole.upper_bound
    with limit_total_work(2e7):
        assert agent.bounds is whole
    assert not agent.hint_basis


def test_more_work_brings_bounds_closer_and_is_asked_for_as_long_as_it_helps(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(solver, "DEFAULT_WORK_LIMIT", 4e7)
    some, more = (PointBasedPolicy(hallway(ROOMS), 0, gap=0.0, work=work) for work in (1.0, 5.0))
    assert (
        more.bounds.upper_bound - more.bounds.lower_bound
        < some.bounds.upper_bound - some.bounds.lower_bound
    )
    assert (
        suggest_more_work(some.bounds, 1.0, "--work ")
        == "; more work brings them closer: --work 10"
    )
    assert suggest_more_work(more.bounds, 30.0, "work=").endswith(": work=100")
    assert not suggest_more_work(more.bounds, 100.0, "work=")
    assert not suggest_more_work(more.bounds._replace(is_gap_closed=True), 1.0, "work=")
    full = more.bounds._replace(is_memory_full=True)
    assert suggest_more_work(full, 1.0, "work=") == "; they are as close as memory allows"
    for work in (0.001, 1000.0):
        with pytest.raises(BadParameter, match=r"^work: got .*, expected a number at least 0\.01"):
            PointBasedPolicy(hallway(ROOMS), 0, work=work)


def test_what_cannot_be_told_from_others_is_solved_each_time() -> None:
    listing = Listing(0.5, model=hallway(ROOMS).model)
    agent = PointBasedPolicy(listing, 0, gap=0.5)
    assert agent.bounds is not agent.bounds
    assert listing not in [asked.problem for asked in point_based._bounds_cache]


def test_only_what_is_legal_is_chosen() -> None:
    agent = PointBasedPolicy(Vault(), 0, horizon=3)
    played = dmplay.rollout(Vault(), [agent], episodes=100, turn_limit=3, seed=1)
    error = played.returns.std() / 10
    assert abs(played.returns.mean() - agent.bounds.lower_bound) <= 2 * error


def test_some_turns_are_planned_to_their_end_whatever_comes_of_it() -> None:
    problem = hallway(ROOMS)
    short, long = (
        PointBasedPolicy(problem, 0).adapt_to_game(turns, []).planned_turns for turns in (10, 60)
    )
    assert problem.discount**60 < point_based.MAX_IGNORED_END_WEIGHT
    assert (short, long) == (10, None)
    hasty = FileProblem(0.1, model=problem.model)
    assert PointBasedPolicy(hasty, 0).adapt_to_game(4, []).planned_turns == 4


def test_turns_after_which_nothing_weighs_are_planned_as_if_there_were_no_end() -> None:
    baby = dmplay.load_problem("crying-baby")
    assert [PointBasedPolicy(baby, 0, horizon=turns).planned_turns for turns in (200, 300)] == [
        200,
        None,
    ]
