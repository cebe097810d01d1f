import numpy as np
import pytest

from dmplay.problems.prisoners_dilemma.rules import PrisonersDilemma
from dmplay.problems.rock_paper_scissors.rules import RockPaperScissors
from dmplay.solvers.games import bimatrix_game
from tests.oracles import correlated_equilibria
from tests.oracles.best_responses import compute_correlated_gains

CHICKEN_PAYOFFS = np.array([[[6, 6], [2, 7]], [[7, 2], [0, 0]]], float)


def test_rock_paper_scissors_has_only_the_uniform_equilibrium() -> None:
    (equilibrium,) = correlated_equilibria.list_corner_equilibria(RockPaperScissors().payoffs)
    np.testing.assert_allclose(equilibrium, np.full((3, 3), 1 / 9), atol=1e-12)


def test_the_prisoners_dilemma_has_only_mutual_defection() -> None:
    (equilibrium,) = correlated_equilibria.list_corner_equilibria(PrisonersDilemma().payoffs)
    assert equilibrium.tolist() == [[0, 0], [0, 1]]


def test_chicken_has_five_corner_equilibria() -> None:
    corners = correlated_equilibria.list_corner_equilibria(CHICKEN_PAYOFFS)
    assert len(corners) == 5
    welfare = (corners[..., None] * CHICKEN_PAYOFFS).sum(axis=(1, 2, 3))
    # the best one: both swerve with probability 1/2, each dares alone with 1/4
    best = corners[np.argmax(welfare)]
    np.testing.assert_allclose(best, [[0.5, 0.25], [0.25, 0.0]])
    assert welfare.max() == pytest.approx(10.5)


def test_with_equal_payoffs_every_action_pair_is_a_corner() -> None:
    assert len(correlated_equilibria.list_corner_equilibria(np.zeros((2, 3, 2)))) == 6


@pytest.mark.parametrize("seed", range(9))
def test_the_corners_are_equilibria_and_span_every_nash_equilibrium(seed: int) -> None:
    random = np.random.default_rng(seed)
    payoffs = random.normal(size=(int(random.integers(1, 4)), 3, 2))
    corners = correlated_equilibria.list_corner_equilibria(payoffs)
    for joint in corners:
        assert joint.min() >= 0
        assert joint.sum() == pytest.approx(1)
        assert (compute_correlated_gains(payoffs, joint) <= 1e-9).all()
    equilibria = bimatrix_game.enumerate_equilibria(payoffs)
    for profile in equilibria:
        joint = np.outer(*profile)
        weights = np.linalg.lstsq(
            np.vstack([corners.reshape(len(corners), -1).T, np.ones(len(corners))]),
            np.append(joint.reshape(-1), 1.0),
            rcond=None,
        )[0]  # shows that the joint lies in the affine hull of the corners, not that it is inside
        np.testing.assert_allclose(np.tensordot(weights, corners, 1), joint, atol=1e-9)
    for _ in range(20):  # no direction has a better joint distribution than the corners
        direction = random.normal(size=payoffs.shape[:2])
        best = max((direction * joint).sum() for joint in corners)
        for profile in equilibria:
            assert (direction * np.outer(*profile)).sum() <= best + 1e-9
