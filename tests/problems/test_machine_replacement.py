import numpy as np
import pytest

import dmplay
from dmplay.core import belief
from dmplay.core.policy import Percept
from dmplay.core.problem import enumerate_outcomes
from dmplay.core.session import Session
from dmplay.problems.machine_replacement.agents import (
    EXAMINE,
    INTERRUPT,
    MANUFACTURE,
    REPLACE,
    Optimal,
    Qmdp,
    Threshold,
)
from dmplay.problems.machine_replacement.rules import MachineReplacement
from dmplay.solvers.mdp import mdp_values
from tests.support.returns import assert_policy_earns

MACHINE = MachineReplacement()
NONDEFECTIVE, DEFECTIVE = 0, 1


def step_machine(failed: int, action: int, u: float) -> tuple[int, float, int]:
    """Return the failed components, the reward and the observation of one turn."""
    outcome = MACHINE.step(np.array([failed]), np.array([[action]]), np.array([[u]]))
    return int(outcome.state[0]), float(outcome.rewards[0, 0]), int(outcome.observations[0, 0])


def choose_action(policy: Threshold, *b: float) -> int:
    return int(policy.choose((np.array([b]),), None, np.zeros((1, 0)))[0])


@pytest.mark.parametrize("u", [0.0, 0.5, 0.999999999])
def test_the_machine_starts_with_no_failed_component(u: float) -> None:
    assert MACHINE.sample_initial_states(np.array([[u]]))[0] == 0
    np.testing.assert_array_equal(belief.initial_belief(MACHINE), [1, 0, 0])


@pytest.mark.parametrize("u", [0.0, 0.5, 0.999999999])
def test_interrupting_with_two_failures_costs_two_and_a_half_and_repairs_both(u: float) -> None:
    assert step_machine(2, INTERRUPT, u) == (0, -2.5, NONDEFECTIVE)
    assert step_machine(2, REPLACE, u) == (0, -2.0, NONDEFECTIVE)


def test_both_components_fail_at_once_in_one_turn_of_a_hundred() -> None:
    assert step_machine(0, MANUFACTURE, 0.98) == (1, 0.9025, NONDEFECTIVE)
    assert step_machine(0, MANUFACTURE, 0.991) == (2, 0.9025, NONDEFECTIVE)


def test_a_broken_machine_makes_one_good_product_of_four() -> None:
    assert step_machine(2, EXAMINE, 0.2) == (2, 0.0, NONDEFECTIVE)
    assert step_machine(2, EXAMINE, 0.3) == (2, 0.0, DEFECTIVE)


def test_only_an_examination_shows_a_defect() -> None:
    for action in (MANUFACTURE, INTERRUPT, REPLACE):
        p, outcome = enumerate_outcomes(MACHINE, np.arange(3), np.full((3, 1), action))
        assert (outcome.observations[p > 0] == NONDEFECTIVE).all()


def test_a_defect_rules_out_the_sound_machine() -> None:
    update = belief.update_belief(MACHINE, np.array([1.0, 0, 0]), [EXAMINE], [DEFECTIVE])
    assert update.likelihood == pytest.approx(0.18 * 0.5 + 0.01 * 0.75)
    np.testing.assert_allclose(update.belief, [0, 0.09 / 0.0975, 0.0075 / 0.0975])


def test_it_is_a_pomdp_of_three_states_whose_rewards_stay_hidden() -> None:
    assert MACHINE.kind == "POMDP"
    assert [MACHINE.format_state(s) for s in MACHINE.enumerate_states()] == ["0", "1", "2"]
    assert not MACHINE.rewards_observable


def test_the_threshold_repairs_by_the_cheaper_way() -> None:
    policy = Threshold(MACHINE, 0, repair=0.9, examine=0.5)
    assert choose_action(policy, 1, 0, 0) == MANUFACTURE
    assert choose_action(policy, 0.5, 0.5, 0) == EXAMINE
    assert choose_action(policy, 0, 1, 0) == INTERRUPT  # 1.5 against 2
    assert choose_action(policy, 0, 0.5, 0.5) == INTERRUPT  # 2 against 2
    assert choose_action(policy, 0, 0.4, 0.6) == REPLACE


def test_the_threshold_interrupts_after_six_products() -> None:
    # It never examines: it expects 0, 0.2, 0.38, 0.542, 0.6878, 0.81902, 0.937118 failures.
    session = Session(
        MACHINE, dmplay.SeededUniforms(1), [dmplay.load_agent(MACHINE, 0, "threshold")]
    )
    while not session.over:
        session.advance()
    actions = [int(action) for action in session.view(0).actions]
    assert actions == ([MANUFACTURE] * 6 + [INTERRUPT]) * 2 + [MANUFACTURE] * 6


def make_memory(turns_done: int, *b: float) -> tuple[np.ndarray, np.ndarray]:
    return np.array([b]), np.array([turns_done])


def test_the_optimum_counts_its_turns_down_and_starts_again() -> None:
    policy = Optimal(MACHINE, 0)
    memory = policy.initial_memory(np.array([-1]))
    for turns_done in range(25):
        assert memory[1].tolist() == [turns_done % 20]
        expected = policy.values_with_turns_left(memory[0], 20 - turns_done % 20)
        np.testing.assert_array_equal(policy.action_values(memory), expected)
        percept = Percept(np.array([MANUFACTURE]), np.array([NONDEFECTIVE]), None, None)
        memory = policy.update_memory(memory, percept)


def test_the_optimum_does_not_repair_near_the_end() -> None:
    policy = Optimal(MACHINE, 0)
    rows = [make_memory(turns_done, 0, 0, 1) for turns_done in (0, 14, 15, 19)]
    actions = [int(policy.choose(row, None, np.zeros((1, 0)))[0]) for row in rows]
    assert actions == [REPLACE, REPLACE, MANUFACTURE, MANUFACTURE]


def test_rows_with_different_turns_left_are_valued_separately() -> None:
    policy = Optimal(MACHINE, 0)
    b, turns_done = np.array([[0.5, 0.3, 0.2]] * 3), np.array([0, 7, 0])
    q = policy.action_values((b, turns_done))
    np.testing.assert_array_equal(q[0], q[2])
    np.testing.assert_array_equal(q[1], policy.values_with_turns_left(b[:1], 13)[0])


def test_figure_f12_has_a_second_region_of_manufacture() -> None:
    policy = Optimal(MACHINE, 0, horizon=14)
    small_region, between_regions = (0.21017, 0.06209, 0.72774), (0.22, 0.155, 0.625)
    rows = [make_memory(0, *b) for b in (small_region, between_regions)]
    actions = [int(policy.choose(row, None, np.zeros((1, 0)))[0]) for row in rows]
    assert actions == [MANUFACTURE, INTERRUPT]


def test_qmdp_values_are_those_of_the_mdp_if_the_state_is_certain() -> None:
    policy = Qmdp(MACHINE, 0)
    q = policy.values_with_turns_left(np.eye(3), 20)
    np.testing.assert_allclose(
        q.max(axis=1), mdp_values.compute_finite_horizon_values(MACHINE.tables, 1.0, 20)
    )
    last = policy.action_values((np.eye(3), np.full(3, 19)))
    np.testing.assert_allclose(last, MACHINE.tables.rewards[:, :, 0])


def test_the_optimal_agent_earns_its_estimated_value() -> None:
    assert_policy_earns(MACHINE, Optimal(MACHINE, 0), 10.590814, turns=20)
