import numpy as np
import pytest

import dmplay
from dmplay.core.tabular import Tables, tabulate
from dmplay.errors import BudgetExceeded
from dmplay.problems.predator_prey.rules import PredatorPrey
from dmplay.solvers.games import induced_mdp
from dmplay.solvers.mdp import mdp_values, sparse_mdp

CIRCLE_PROBLEM = dmplay.load_problem("predator-prey:circle")
UNIFORM_POLICY = np.full((36, 6), 1 / 6)


@pytest.mark.parametrize("seat", [0, 1])
def test_the_model_against_a_uniform_policy_averages_over_its_actions(seat: int) -> None:
    joint_tables = tabulate(CIRCLE_PROBLEM)
    expected_tables = Tables(
        joint_tables.transition.reshape(36, 6, 6, 36).mean(axis=2 - seat),
        joint_tables.rewards.reshape(36, 6, 6, 2).mean(axis=2 - seat)[:, :, seat : seat + 1],
        None,
    )
    model = induced_mdp.build_induced_mdp(CIRCLE_PROBLEM, seat, [UNIFORM_POLICY, UNIFORM_POLICY])
    np.testing.assert_allclose(np.add.reduceat(model.probabilities, model.outcome_starts), 1)
    np.testing.assert_allclose(model.rewards, expected_tables.rewards[:, :, 0])
    expected = mdp_values.compute_optimal_q(expected_tables, CIRCLE_PROBLEM.discount)
    np.testing.assert_allclose(
        sparse_mdp.compute_optimal_q(model, CIRCLE_PROBLEM.discount), expected, atol=1e-8
    )


def test_the_model_against_a_deterministic_policy_lists_only_its_actions() -> None:
    policy = np.eye(6)[np.random.default_rng(1).integers(0, 6, 36)]
    joint_tables = tabulate(CIRCLE_PROBLEM)
    model = induced_mdp.build_induced_mdp(CIRCLE_PROBLEM, 0, [UNIFORM_POLICY, policy])
    assert len(model.probabilities) * 6 == len(
        induced_mdp.build_induced_mdp(
            CIRCLE_PROBLEM, 0, [UNIFORM_POLICY, UNIFORM_POLICY]
        ).probabilities
    )
    rewards = joint_tables.rewards.reshape(36, 6, 6, 2)[np.arange(36), :, policy.argmax(axis=1), 0]
    np.testing.assert_allclose(model.rewards, rewards)


@pytest.mark.parametrize("predators", [2, 3])
def test_a_game_too_large_to_list_is_rejected(predators: int) -> None:
    hunt = PredatorPrey(predators=predators)
    policies = [np.full((12 ** (predators + 1), 6), 1 / 6)] * (predators + 1)
    with pytest.raises(
        BudgetExceeded,
        match=r"^best response: .* MB, more than the limit of 512 MB; try fewer states",
    ):
        induced_mdp.build_induced_mdp(hunt, 0, policies)
