from itertools import product

import numpy as np
import pytest

import dmplay
from dmplay import belief
from dmplay.core import Percept
from dmplay.errors import BadParameter, BadPolicy
from dmplay.finding.agents import load_roster
from dmplay.policies.multicaregiver_crying_baby import BestResponse
from dmplay.problems._care import FEED, IGNORE, SING
from dmplay.problems.multicaregiver_crying_baby import MulticaregiverCryingBaby
from dmplay.session import Session

CARE = MulticaregiverCryingBaby()
SATED, HUNGRY = 0, 1
CRYING, QUIET = 0, 1


def turn(state: int, first: int, second: int, u: float) -> tuple[int, list[float], list[int]]:
    """The state, the rewards and what both hear after one turn."""
    outcome = CARE.step(np.array([state]), np.array([[first, second]]), np.array([[u]]))
    return (
        int(outcome.state[0]),
        outcome.rewards[0].tolist(),
        outcome.observations[0].tolist(),
    )


def test_either_caregiver_sates_the_hungry_baby() -> None:
    for u in (0.0, 0.5, 0.999999999):
        assert turn(HUNGRY, FEED, SING, u) == (SATED, [-12.5, -10.25], [QUIET, QUIET])
        assert turn(HUNGRY, IGNORE, FEED, u) == (SATED, [-10.0, -15.0], [QUIET, QUIET])


def test_both_feeding_is_paid_by_both() -> None:
    assert turn(SATED, FEED, FEED, 0.5) == (SATED, [-2.5, -5.0], [QUIET, QUIET])


def test_a_sated_baby_left_alone_is_hungry_half_the_time() -> None:
    assert turn(SATED, IGNORE, IGNORE, 0.499) == (SATED, [0.0, 0.0], [QUIET, QUIET])
    assert turn(SATED, IGNORE, IGNORE, 0.5) == (HUNGRY, [0.0, 0.0], [CRYING, CRYING])
    assert turn(SATED, SING, SING, 0.951) == (HUNGRY, [-0.5, -0.25], [QUIET, QUIET])


def test_both_always_hear_the_same() -> None:
    s = np.repeat([SATED, HUNGRY], 9)
    a = np.array(list(product(range(3), repeat=2)) * 2)
    p, outcome = dmplay.enumerate_outcomes(CARE, s, a)
    heard = outcome.observations[p > 0]
    assert (heard[:, 0] == heard[:, 1]).all()


def test_crying_proves_hunger_and_that_nobody_fed() -> None:
    b = np.array([0.5, 0.5])
    alone = belief.update_belief(CARE, b, [IGNORE, None], [CRYING, None])
    np.testing.assert_allclose(alone.belief, [0, 1], atol=1e-15)
    # The other feeds in one case of three; else three quarters are hungry and nine tenths cry.
    assert alone.likelihood == pytest.approx(2 / 3 * 0.75 * 0.9)


def test_a_caregiver_believes_what_it_may_know_of_an_unseen_partner() -> None:
    session = Session(CARE, dmplay.SeededUniforms(2), [None, None], turn_limit=4)
    session.advance([FEED, IGNORE])
    assert session.view(0).beliefs is not None
    fed, waited = (session.view(seat).beliefs for seat in range(2))
    assert fed is not None
    assert waited is not None
    np.testing.assert_allclose(fed[-1], [1, 0], atol=1e-15)
    assert 0 < waited[-1][HUNGRY] < 1
    assert session.view(1).joint_actions is None
    assert session.view(1).rewards is None


def test_the_package_reading_is_a_matter_of_parameters() -> None:
    package = dmplay.load_problem("multicaregiver-crying-baby", cries_hungry=0.8, cries_sated=0.1)
    b = belief.update_belief(package, np.array([0.5, 0.5]), [IGNORE, IGNORE], [QUIET, QUIET]).belief
    assert b[HUNGRY] == pytest.approx(0.4)
    b = belief.update_belief(CARE, np.array([0.5, 0.5]), [IGNORE, IGNORE], [QUIET, QUIET]).belief
    assert b[HUNGRY] == pytest.approx(0.23076923)


def test_the_partner_feeds_when_the_baby_cries() -> None:
    assert load_roster(CARE, 1).default_partner == "feed-when-crying"
    policy = dmplay.load_agent(CARE, 1, "feed-when-crying")
    chosen = policy.choose((np.array([-1, CRYING, QUIET]),), None, np.zeros((3, 0)))
    assert chosen.tolist() == [IGNORE, FEED, IGNORE]
    assert CARE.kind == "POMG"


def test_the_cheap_feeder_best_feeds_always_and_the_dear_one_never() -> None:
    quiet = [QUIET] * 4  # a fed baby never cries
    for seat, wanted, sounds in ((0, "feed", quiet), (1, "ignore", [CRYING, QUIET, QUIET, CRYING])):
        policy = dmplay.load_agent(CARE, seat, "best-response")
        memory = policy.initial_memory(np.array([-1]))
        for heard in sounds:
            chosen = policy.choose(memory, None, np.zeros((1, 0)))
            assert CARE.format_action(seat, chosen[0]) == wanted
            memory = policy.update_memory(memory, Percept(chosen, np.array([heard]), None, None))


def test_feeding_always_is_worth_its_effort_and_one_hungry_turn_of_two() -> None:
    policy = BestResponse(CARE, 0)
    assert policy.action_values(policy.initial_memory(np.array([-1])))[0, 0] == pytest.approx(
        -2.5 / 0.1 - 5
    )


def test_the_best_response_of_each_comes_true() -> None:
    for seat in range(2):
        agents = [dmplay.load_agent(CARE, i, "feed-when-crying") for i in range(2)]
        policy = BestResponse(CARE, seat)
        agents[seat] = policy
        (value,) = policy.action_values(policy.initial_memory(np.array([-1]))).max(axis=1)
        returns = dmplay.rollout(CARE, agents, episodes=500, turn_limit=60, seed=2).returns[:, seat]
        assert abs(returns.mean() - value) < 4 * returns.std() / np.sqrt(500)


def test_a_best_response_to_one_who_always_feeds_is_to_do_nothing() -> None:
    for seat in range(2):
        policy = BestResponse(CARE, seat, to="feed")
        assert policy.action_values(policy.initial_memory(np.array([-1]))).max() == pytest.approx(
            -5
        )


def test_beside_one_who_never_feeds_the_cheap_feeder_does_every_turn_the_dear_every_other() -> None:
    for seat, wanted in ((0, -5 - 2.5 / (1 - 0.9)), (1, -(5 + 5) / (1 - 0.9**2))):
        policy = BestResponse(CARE, seat, to="ignore")
        worth = policy.action_values(policy.initial_memory(np.array([-1])))
        assert worth[0].argmax() == FEED
        assert worth.max() == pytest.approx(wanted)


def test_a_best_response_names_the_partners_it_knows() -> None:
    with pytest.raises(BadParameter, match="got 'sleep', expected one of feed-when-crying, random"):
        dmplay.load_agent(CARE, 0, "best-response:to=sleep")


@pytest.mark.parametrize("horizon", [2, 4])
def test_a_joint_plan_has_the_cheap_feeder_feed_and_earns_the_teams_optimum(horizon: int) -> None:
    agents = [dmplay.load_agent(CARE, i, f"joint-plan:horizon={horizon}") for i in range(2)]
    returns = dmplay.rollout(CARE, agents, episodes=500, turn_limit=60, seed=2).returns.sum(axis=1)
    # The first turn finds a hungry baby half the time; from then on caregiver1 feeds it, 2.5 each.
    assert abs(returns.mean() - (-10 - 25)) < 4 * returns.std() / np.sqrt(500)


def test_both_seats_value_the_same_joint_plan() -> None:
    memory = (np.array([[0.5, 0.5], [0.1, 0.9]]),)
    first, second = (
        dmplay.load_agent(CARE, i, "joint-plan").action_values(memory) for i in range(2)
    )
    assert first is not None
    assert second is not None
    np.testing.assert_allclose(first.max(axis=1), second.max(axis=1))
    # Feeding twice costs the second feeder's effort: 16.775 + 5 - 2.5 where only it fed.
    assert first[0] == pytest.approx([-16.775, -19.775, -19.275])
    assert second[0] == pytest.approx([-19.275, -17.025, -16.775])


def test_a_joint_plan_goes_on_beside_a_partner_who_surprises() -> None:
    policy = dmplay.load_agent(CARE, 1, "joint-plan")
    memory = policy.initial_memory(np.array([-1]))  # caregiver1 should feed: no cry can follow
    turn = Percept(np.array([IGNORE]), np.array([CRYING]), None, None)
    b, _ = policy.update_memory(memory, turn)
    assert b.tolist() == [[0, 1]]


def test_a_joint_plan_is_of_one_to_four_turns() -> None:
    for horizon in (0, 5):
        told = f"got {horizon}, expected a number at least 1 and at most 4"
        with pytest.raises(BadParameter, match=told):
            dmplay.load_agent(CARE, 0, f"joint-plan:horizon={horizon}")


def test_a_best_response_without_end_needs_a_discount() -> None:
    with pytest.raises(BadPolicy, match="below 1"):
        BestResponse(MulticaregiverCryingBaby(discount=1.0), 0)


def test_a_partner_who_surprises_is_taken_to_be_random_for_that_turn() -> None:
    policy = BestResponse(CARE, 1)
    memory = policy.initial_memory(np.array([-1]))
    for _ in range(2):  # after the first cry the partner should have fed: no second one
        turn = Percept(np.array([IGNORE]), np.array([CRYING]), None, None)
        memory = policy.update_memory(memory, turn)
    assert memory[0][0].reshape(2, 3)[:, 1].tolist() == [0, 1]  # hungry and heard crying
