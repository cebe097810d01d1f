from itertools import product

import numpy as np
import pytest

import dmplay
from dmplay.core import belief
from dmplay.core.policy import Percept
from dmplay.core.session import Session
from dmplay.errors import BadParameter, BadPolicy, UnknownName
from dmplay.game.hints.explanation import explain_action
from dmplay.problems._shared.baby_care import FEED, IGNORE, SING
from dmplay.problems.multicaregiver_crying_baby.agents import BestResponse
from dmplay.problems.multicaregiver_crying_baby.rules import MulticaregiverCryingBaby
from dmplay.registry.agents import load_roster
from tests.support.screens import make_game

PROBLEM = MulticaregiverCryingBaby()
SATED, HUNGRY = 0, 1
CRYING, QUIET = 0, 1


def step_problem(
    state: int, first: int, second: int, u: float
) -> tuple[int, list[float], list[int]]:
    """Return the next state, the rewards and the observations of one turn."""
    outcome = PROBLEM.step(np.array([state]), np.array([[first, second]]), np.array([[u]]))
    return (int(outcome.state[0]), outcome.rewards[0].tolist(), outcome.observations[0].tolist())


def test_either_caregiver_sates_the_hungry_baby() -> None:
    for u in (0.0, 0.5, 0.999999999):
        assert step_problem(HUNGRY, FEED, SING, u) == (SATED, [-12.5, -10.25], [QUIET, QUIET])
        assert step_problem(HUNGRY, IGNORE, FEED, u) == (SATED, [-10.0, -15.0], [QUIET, QUIET])


def test_both_feeding_is_paid_by_both() -> None:
    assert step_problem(SATED, FEED, FEED, 0.5) == (SATED, [-2.5, -5.0], [QUIET, QUIET])


def test_a_sated_baby_left_alone_is_hungry_half_the_time() -> None:
    assert step_problem(SATED, IGNORE, IGNORE, 0.499) == (SATED, [0.0, 0.0], [QUIET, QUIET])
    assert step_problem(SATED, IGNORE, IGNORE, 0.5) == (HUNGRY, [0.0, 0.0], [CRYING, CRYING])
    assert step_problem(SATED, SING, SING, 0.951) == (HUNGRY, [-0.5, -0.25], [QUIET, QUIET])


def test_both_always_hear_the_same() -> None:
    s = np.repeat([SATED, HUNGRY], 9)
    a = np.array(list(product(range(3), repeat=2)) * 2)
    p, outcome = dmplay.enumerate_outcomes(PROBLEM, s, a)
    observations = outcome.observations[p > 0]
    assert (observations[:, 0] == observations[:, 1]).all()


def test_crying_proves_hunger_and_that_neither_caregiver_fed() -> None:
    b = np.array([0.5, 0.5])
    update = belief.update_belief(PROBLEM, b, [IGNORE, None], [CRYING, None])
    np.testing.assert_allclose(update.belief, [0, 1], atol=1e-15)
    # The other feeds in 1 case of 3; otherwise 3/4 of the babies are hungry, and 9/10 of these cry.
    assert update.likelihood == pytest.approx(2 / 3 * 0.75 * 0.9)


def test_beliefs_do_not_use_the_unobserved_action_of_the_partner() -> None:
    session = Session(PROBLEM, dmplay.SeededUniforms(2), [None, None], turn_limit=4)
    session.advance([FEED, IGNORE])
    assert session.view(0).beliefs is not None
    feeder_beliefs, ignorer_beliefs = (session.view(seat).beliefs for seat in range(2))
    assert feeder_beliefs is not None
    assert ignorer_beliefs is not None
    np.testing.assert_allclose(feeder_beliefs[-1], [1, 0], atol=1e-15)
    assert 0 < ignorer_beliefs[-1][HUNGRY] < 1
    assert session.view(1).joint_actions is None
    assert session.view(1).rewards is None


def test_parameters_reproduce_the_reading_of_the_package() -> None:
    package = dmplay.load_problem("multicaregiver-crying-baby", cries_hungry=0.8, cries_sated=0.1)
    b = belief.update_belief(package, np.array([0.5, 0.5]), [IGNORE, IGNORE], [QUIET, QUIET]).belief
    assert b[HUNGRY] == pytest.approx(0.4)
    b = belief.update_belief(PROBLEM, np.array([0.5, 0.5]), [IGNORE, IGNORE], [QUIET, QUIET]).belief
    assert b[HUNGRY] == pytest.approx(0.23076923)


def test_the_partner_feeds_when_the_baby_cries() -> None:
    assert load_roster(PROBLEM, 1).default_partner == "feed-when-crying"
    policy = dmplay.load_agent(PROBLEM, 1, "feed-when-crying")
    chosen = policy.choose((np.array([-1, CRYING, QUIET]),), None, np.zeros((3, 0)))
    assert chosen.tolist() == [IGNORE, FEED, IGNORE]
    assert PROBLEM.kind == "POMG"


def test_the_cheap_feeder_always_feeds_and_the_costly_one_never_does() -> None:
    quiet = [QUIET] * 4  # a fed baby never cries
    for seat, expected, sounds in (
        (0, "feed", quiet),
        (1, "ignore", [CRYING, QUIET, QUIET, CRYING]),
    ):
        policy = dmplay.load_agent(PROBLEM, seat, "best-response")
        memory = policy.initial_memory(np.array([-1]))
        for sound in sounds:
            chosen = policy.choose(memory, None, np.zeros((1, 0)))
            assert PROBLEM.format_action(seat, chosen[0]) == expected
            memory = policy.update_memory(memory, Percept(chosen, np.array([sound]), None, None))


def test_always_feeding_costs_its_effort_and_half_a_hungry_turn() -> None:
    policy = BestResponse(PROBLEM, 0)
    assert policy.action_values(policy.initial_memory(np.array([-1])))[0, 0] == pytest.approx(
        -2.5 / 0.1 - 5
    )


def test_the_best_response_of_each_seat_earns_its_value() -> None:
    for seat in range(2):
        policies = [dmplay.load_agent(PROBLEM, i, "feed-when-crying") for i in range(2)]
        policy = BestResponse(PROBLEM, seat)
        policies[seat] = policy
        (value,) = policy.action_values(policy.initial_memory(np.array([-1]))).max(axis=1)
        returns = dmplay.rollout(PROBLEM, policies, episodes=500, turn_limit=60, seed=2).returns[
            :, seat
        ]
        assert abs(returns.mean() - value) < 4 * returns.std() / np.sqrt(500)


def test_the_best_response_to_a_partner_who_always_feeds_is_to_do_nothing() -> None:
    for seat in range(2):
        policy = BestResponse(PROBLEM, seat, to="feed")
        assert policy.action_values(policy.initial_memory(np.array([-1]))).max() == pytest.approx(
            -5
        )


def test_with_a_partner_who_never_feeds_the_costly_feeder_feeds_every_other_turn() -> None:
    for seat, expected in ((0, -5 - 2.5 / (1 - 0.9)), (1, -(5 + 5) / (1 - 0.9**2))):
        policy = BestResponse(PROBLEM, seat, to="ignore")
        values = policy.action_values(policy.initial_memory(np.array([-1])))
        assert values[0].argmax() == FEED
        assert values.max() == pytest.approx(expected)


def test_an_unknown_partner_raises_an_error_that_lists_the_partners() -> None:
    with pytest.raises(
        UnknownName, match=r"unknown agent 'sleep'; expected one of .*best-response"
    ):
        dmplay.load_agent(PROBLEM, 0, "best-response:to=sleep")


@pytest.mark.parametrize("horizon", [2, 4])
def test_in_a_joint_plan_the_cheap_feeder_feeds_and_the_team_earns_its_optimum(
    horizon: int,
) -> None:
    agents = [dmplay.load_agent(PROBLEM, i, f"joint-plan:horizon={horizon}") for i in range(2)]
    returns = dmplay.rollout(PROBLEM, agents, episodes=500, turn_limit=60, seed=2).returns.sum(
        axis=1
    )
    # In the first turn the baby is hungry half the time; then caregiver1 feeds it for 2.5 a turn.
    assert abs(returns.mean() - (-10 - 25)) < 4 * returns.std() / np.sqrt(500)


def test_both_seats_value_the_same_joint_plan() -> None:
    memory = (np.array([[0.5, 0.5], [0.1, 0.9]]),)
    first, second = (
        dmplay.load_agent(PROBLEM, i, "joint-plan").action_values(memory) for i in range(2)
    )
    assert first is not None
    assert second is not None
    np.testing.assert_allclose(first.max(axis=1), second.max(axis=1))
    # If only the second feeder feeds, its effort replaces that of the first: 16.775 + 5 - 2.5.
    assert first[0] == pytest.approx([-16.775, -19.775, -19.275])
    assert second[0] == pytest.approx([-19.275, -17.025, -16.775])


def test_a_joint_plan_continues_after_an_unexpected_action_of_the_partner() -> None:
    policy = dmplay.load_agent(PROBLEM, 1, "joint-plan")
    # caregiver1 should feed, after which the baby cannot cry
    memory = policy.initial_memory(np.array([-1]))
    percept = Percept(np.array([IGNORE]), np.array([CRYING]), None, None)
    b, _ = policy.update_memory(memory, percept)
    assert b.tolist() == [[0, 1]]


def test_the_horizon_of_a_joint_plan_is_one_to_four_turns() -> None:
    for horizon in (0, 5):
        message = f"got {horizon}, expected a number at least 1 and at most 4"
        with pytest.raises(BadParameter, match=message):
            dmplay.load_agent(PROBLEM, 0, f"joint-plan:horizon={horizon}")


def test_an_infinite_horizon_best_response_requires_a_discount() -> None:
    with pytest.raises(BadPolicy, match="below 1"):
        BestResponse(MulticaregiverCryingBaby(discount=1.0), 0)


def test_a_partner_who_deviates_is_treated_as_random_for_that_turn() -> None:
    policy = BestResponse(PROBLEM, 1)
    memory = policy.initial_memory(np.array([-1]))
    for _ in range(2):  # after the first cry the partner should feed, so that no second cry follows
        percept = Percept(np.array([IGNORE]), np.array([CRYING]), None, None)
        memory = policy.update_memory(memory, percept)
    assert memory[0][0].reshape(3, 2)[1].tolist() == [0, 1]  # hungry and heard crying


def test_the_reason_tells_how_likely_the_baby_is_sated_after_each_action() -> None:
    game = make_game("multicaregiver-crying-baby", "human", "feed-when-crying", turns=2)
    assert explain_action(game.hint_provider, FEED).sentences[0] == (
        "With feed-when-crying, the baby is then sated with probability 1.00 if you feed, 0.25 if "
        "you sing and 0.25 if you ignore."
    )
    game.choose(FEED)
    assert "reasons" not in explain_action(game.hint_provider).data  # no later turn counts
