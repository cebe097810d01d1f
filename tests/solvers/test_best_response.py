import numpy as np
import pytest

import dmplay
from dmplay.errors import TooMuch
from dmplay.problems.predator_prey import PredatorPrey
from dmplay.solvers import best_response, sparse, value_iteration
from dmplay.tabular import Tables, tabulate

CIRCLE = dmplay.load("predator-prey:circle")
UNIFORM = np.full((36, 6), 1 / 6)


@pytest.mark.parametrize("seat", [0, 1])
def test_against_chance_it_is_the_mean_over_the_others_actions(seat: int) -> None:
    both = tabulate(CIRCLE)
    alone = Tables(
        both.transition.reshape(36, 6, 6, 36).mean(axis=2 - seat),
        both.rewards.reshape(36, 6, 6, 2).mean(axis=2 - seat)[:, :, seat : seat + 1],
        None,
    )
    model = best_response.faced(CIRCLE, seat, [UNIFORM, UNIFORM])
    np.testing.assert_allclose(np.add.reduceat(model.p, model.first), 1)
    np.testing.assert_allclose(model.rewards, alone.rewards[:, :, 0])
    wanted = value_iteration.optimal(alone, CIRCLE.discount)
    np.testing.assert_allclose(sparse.optimal(model, CIRCLE.discount), wanted, atol=1e-8)


def test_against_fixed_moves_only_these_are_listed() -> None:
    moves = np.eye(6)[np.random.default_rng(1).integers(0, 6, 36)]
    both, model = tabulate(CIRCLE), best_response.faced(CIRCLE, 0, [UNIFORM, moves])
    assert len(model.p) * 6 == len(best_response.faced(CIRCLE, 0, [UNIFORM, UNIFORM]).p)
    rewards = both.rewards.reshape(36, 6, 6, 2)[np.arange(36), :, moves.argmax(axis=1), 0]
    np.testing.assert_allclose(model.rewards, rewards)


@pytest.mark.parametrize("predators", [2, 3])
def test_a_game_too_large_to_list_is_refused(predators: int) -> None:
    hunt = PredatorPrey(predators=predators)
    many = [np.full((12 ** (predators + 1), 6), 1 / 6)] * (predators + 1)
    with pytest.raises(TooMuch, match=r"^a best response: .* MB, more than 512; try fewer states"):
        best_response.faced(hunt, 0, many)
