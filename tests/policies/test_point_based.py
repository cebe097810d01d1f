import numpy as np
import pytest

import dmplay
from dmplay.budget import within
from dmplay.errors import BadParameter
from dmplay.files.problem import FromFile
from dmplay.policies import point_based
from dmplay.policies.point_based import PointBased, closer, told
from dmplay.solvers import point_based as solver
from dmplay.solvers.point_based import Bounds
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
    assert told(Bounds(low, high, np.zeros(1), np.zeros(1), (), 1, False)) == words


def test_who_is_in_a_hurry_has_less_and_who_is_not_the_whole() -> None:
    agent = PointBased(hallway(ROOMS), 0, gap=0.5)
    with within(2e7):
        hurried = agent.bounds
        assert agent.bounds is hurried
        assert agent.basis.startswith("point-based, value ")
    whole = agent.bounds
    assert whole.close
    assert whole.at_least >= hurried.at_least
    assert whole.at_most - whole.at_least <= 0.5 * whole.at_most
    with within(2e7):
        assert agent.bounds is whole
    assert not agent.basis


def test_more_work_brings_bounds_closer_and_is_asked_for_as_long_as_it_helps(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(solver, "WORK", 4e7)
    some, more = (PointBased(hallway(ROOMS), 0, gap=0.0, work=work) for work in (1.0, 5.0))
    assert more.bounds.at_most - more.bounds.at_least < some.bounds.at_most - some.bounds.at_least
    assert closer(some.bounds, 1.0, "--work ") == "; more work brings them closer: --work 10"
    assert closer(more.bounds, 30.0, "work=").endswith(": work=100")
    assert not closer(more.bounds, 100.0, "work=")
    assert not closer(more.bounds._replace(close=True), 1.0, "work=")
    full = more.bounds._replace(full=True)
    assert closer(full, 1.0, "work=") == "; they are as close as memory allows"
    for work in (0.001, 1000.0):
        with pytest.raises(BadParameter, match=r"^work: got .*, expected a number at least 0\.01"):
            PointBased(hallway(ROOMS), 0, work=work)


def test_what_cannot_be_told_from_others_is_solved_each_time() -> None:
    listing = Listing(0.5, model=hallway(ROOMS).model)
    agent = PointBased(listing, 0, gap=0.5)
    assert agent.bounds is not agent.bounds
    assert listing not in [asked.problem for asked in point_based._kept]


def test_only_what_is_legal_is_chosen() -> None:
    agent = PointBased(Vault(), 0, horizon=3)
    played = dmplay.rollout(Vault(), [agent], episodes=100, turns=3, seed=1)
    error = played.returns.std() / 10
    assert abs(played.returns.mean() - agent.bounds.at_least) <= 2 * error


def test_some_turns_are_planned_to_their_end_whatever_comes_of_it() -> None:
    problem = hallway(ROOMS)
    short, long = (PointBased(problem, 0).in_game(turns, []).turns for turns in (10, 60))
    assert problem.discount**60 < point_based.UNSEEN
    assert (short, long) == (10, None)
    hasty = FromFile(0.1, model=problem.model)
    assert PointBased(hasty, 0).in_game(4, []).turns == 4


def test_turns_after_which_nothing_weighs_are_planned_as_if_there_were_no_end() -> None:
    baby = dmplay.load("crying-baby")
    assert [PointBased(baby, 0, horizon=turns).turns for turns in (200, 300)] == [200, None]
