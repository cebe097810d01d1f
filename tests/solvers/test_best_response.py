import numpy as np
import pytest

import dmplay
from dmplay.errors import BudgetExceeded
from dmplay.problems.predator_prey import PredatorPrey
from dmplay.solvers import best_response, sparse, value_iteration
from dmplay.tabular import Tables, tabulate

CIRCLE = dmplay.load_problem("predator-prey:circle")
UNIFORM = np.full((36, 6), 1 / 6)


@pytest.mark.parametrize("seat", [0, 1])
def test_against_chance_it_is_the_mean_over_the_others_actions(seat: int) -> None:
    both = tabulate(CIRCLE)
    alone = Tables(
        both.transition.reshape(36, 6, 6, 36).mean(axis=2 - seat),
        both.rewards.reshape(36, 6, 6, 2).mean(axis=2 - seat)[:, :, seat : seat + 1],
        None,
    )
    model = best_response.build_induced_mdp(CIRCLE, seat, [UNIFORM, UNIFORM])
    np.testing.assert_allclose(np.add.reduceat(model.probabilities, model.outcome_starts), 1)
    np.testing.assert_allclose(model.rewards, alone.rewards[:, :, 0])
    wanted = value_iteration.compute_optimal_q(alone, CIRCLE.discount)
    np.testing.assert_allclose(sparse.compute_optimal_q(model, CIRCLE.discount), wanted, atol=1e-8)


def test_against_fixed_moves_only_these_are_listed() -> None:
    moves = np.eye(6)[np.random.default_rng(1).integers(0, 6, 36)]
    both, model = tabulate(CIRCLE), best_response.build_induced_mdp(CIRCLE, 0, [UNIFORM, moves])
    assert len(model.probabilities) * 6 == len(
        best_response.build_induced_mdp(CIRCLE, 0, [UNIFORM, UNIFORM]).probabilities
    )
    rewards = both.rewards.reshape(36, 6, 6, 2)[np.arange(36), :, moves.argmax(axis=1), 0]
    np.testing.assert_allclose(model.rewards, rewards)


@pytest.mark.parametrize("predators", [2, 3])
def test_a_game_too_large_to_list_is_refused(predators: int) -> None:
    hunt = PredatorPrey(predators=predators)
    many = [np.full((12 ** (predators + 1), 6), 1 / 6)] * (predators + 1)
    with pytest.raises(
        BudgetExceeded, match=r"^a best response: .* MB, more than 512; try fewer states"
    ):
        best_response.build_induced_mdp(hunt, 0, many)
