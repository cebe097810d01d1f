import numpy as np
import pytest

import dmplay
from dmplay.agents.single_agent_planning import (
    FastInformedBound,
    PomdpOptimalPolicy,
    Qmdp,
    RecedingHorizonPolicy,
)
from dmplay.core.policy import Percept
from dmplay.core.tabular import tabulate
from dmplay.errors import BadParameter, BadPolicy
from dmplay.evaluation.many_games import rollout
from dmplay.problems.crying_baby.rules import CryingBaby
from dmplay.registry.agents import load_roster
from dmplay.solvers.mdp import mdp_values
from dmplay.solvers.pomdp import exact_pomdp
from tests.support.belief_trees import compute_exact_return

BABY = CryingBaby()
FEED, SING, IGNORE = range(3)
CRYING, QUIET = 0, 1
SWITCH_BELIEF = 1645 / 5832  # belief in hunger above which feeding is better than ignoring


def make_beliefs(*hungry: float) -> tuple[np.ndarray]:
    return (np.array([[1 - b, b] for b in hungry]),)


def choose_actions(
    policy: PomdpOptimalPolicy | RecedingHorizonPolicy | Qmdp, *hungry: float
) -> list[int]:
    actions: list[int] = policy.choose(
        make_beliefs(*hungry), None, np.zeros((len(hungry), 0))
    ).tolist()
    return actions


def test_the_optimal_caregiver_feeds_above_the_switch_and_never_sings() -> None:
    policy = PomdpOptimalPolicy(BABY, 0)
    assert (
        choose_actions(policy, 0, 0.2, SWITCH_BELIEF - 1e-6, SWITCH_BELIEF + 1e-6, 0.5, 1)
        == [IGNORE] * 3 + [FEED] * 3
    )
    assert SING not in choose_actions(policy, *np.linspace(0, 1, 101))


def test_the_optimal_values_are_those_of_the_infinite_horizon() -> None:
    (q,) = PomdpOptimalPolicy(BABY, 0).action_values(make_beliefs(0.2))
    np.testing.assert_allclose(q, [-21.674934966510314, -20.76015771901436, -20.69461911882182])


def test_a_tie_goes_to_the_first_action() -> None:
    assert choose_actions(PomdpOptimalPolicy(BABY, 0), SWITCH_BELIEF) == [FEED]


def test_a_plan_of_one_turn_never_feeds() -> None:
    assert choose_actions(RecedingHorizonPolicy(BABY, 0, horizon=1), 0, 0.5, 1) == [IGNORE] * 3
    assert choose_actions(RecedingHorizonPolicy(BABY, 0), 0, 0.5, 1) == [IGNORE, FEED, FEED]


def test_an_undiscounted_plan_sings() -> None:
    assert choose_actions(RecedingHorizonPolicy(CryingBaby(discount=1.0), 0, horizon=4), 0.21) == [
        SING
    ]


def test_values_for_ten_turns_match_figure_f10() -> None:
    sated, hungry = (
        RecedingHorizonPolicy(BABY, 0, horizon=10).action_values(make_beliefs(0, 1)).max(axis=1)
    )
    assert sated == pytest.approx(-9.6857, abs=5e-5)
    assert hungry == pytest.approx(-23.0552, abs=5e-5)


def test_qmdp_gives_no_value_to_information() -> None:
    q = Qmdp(BABY, 0).action_values(make_beliefs(0, 0.5, 1))
    np.testing.assert_allclose(q[:, SING], q[:, IGNORE] - 0.5)
    np.testing.assert_allclose(q[1], (q[0] + q[2]) / 2)
    np.testing.assert_allclose(q[[0, 2]], mdp_values.compute_optimal_q(BABY.tables, BABY.discount))


def test_an_undiscounted_infinite_game_has_no_optimum() -> None:
    baby = CryingBaby(discount=1.0)
    for policy in (PomdpOptimalPolicy(baby, 0), Qmdp(baby, 0)):
        with pytest.raises(BadPolicy, match="below 1"):
            policy.action_values(make_beliefs(0.5))
    assert load_roster(baby, 0).hint_provider == "plan"
    assert load_roster(BABY, 0).hint_provider == "optimal"


def test_a_plan_of_zero_turns_is_rejected() -> None:
    with pytest.raises(BadParameter, match="horizon: got 0, expected a number at least 1"):
        dmplay.load_agent(BABY, 0, "plan:horizon=0")


def test_a_cry_after_ignoring_a_sated_baby_leads_to_feeding() -> None:
    policy = PomdpOptimalPolicy(BABY, 0)
    percept = Percept(np.array([IGNORE]), np.array([CRYING]), None, None)
    memory = policy.update_memory(make_beliefs(0.0), percept)
    assert memory[0][0, 1] == pytest.approx(8 / 17)  # 0.1 * 0.8 against 0.9 * 0.1
    assert policy.choose(memory, None, np.zeros((1, 0))) == FEED


def test_the_optimal_caregiver_earns_its_estimated_value() -> None:
    policy = dmplay.load_agent(BABY, 0, "optimal")
    returns = rollout(BABY, [policy], episodes=1000, turn_limit=150, seed=8).returns[:, 0]
    (value,) = PomdpOptimalPolicy(BABY, 0).action_values(make_beliefs(0.5)).max(axis=1)
    assert abs(returns.mean() - value) < 4 * returns.std() / np.sqrt(1000)


def test_qmdp_earns_less_than_the_optimum_if_the_baby_seldom_cries() -> None:
    baby = dmplay.load_problem("crying-baby:seldom-cries")
    stages = exact_pomdp.solve_finite_horizon(tabulate(baby), baby.discount, 20)
    optimum = exact_pomdp.compute_action_values(stages[-1], make_beliefs(0.5)[0]).max()
    assert optimum == pytest.approx(-23.3521, abs=1e-3)  # with the turns left in mind
    returns = [
        compute_exact_return(baby, policy, np.array([0.5, 0.5]), 20)
        for policy in (Qmdp(baby, 0), FastInformedBound(baby, 0), PomdpOptimalPolicy(baby, 0))
    ]
    assert returns == pytest.approx([-28.2504, -23.5645, -23.5645], abs=1e-3)


def test_only_qmdp_never_sings_to_a_baby_that_seldom_cries() -> None:
    baby = dmplay.load_problem("crying-baby:seldom-cries")
    beliefs = make_beliefs(*np.linspace(0, 1, 101))
    no_uniforms = np.zeros((101, 0))
    assert SING not in Qmdp(baby, 0).choose(beliefs, None, no_uniforms)
    for policy in (FastInformedBound(baby, 0), PomdpOptimalPolicy(baby, 0)):
        assert SING in policy.choose(beliefs, None, no_uniforms)
