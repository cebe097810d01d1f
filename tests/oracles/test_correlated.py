import numpy as np
import pytest

from dmplay.problems.prisoners_dilemma import PrisonersDilemma
from dmplay.problems.rock_paper_scissors import RockPaperScissors
from dmplay.solvers import matrix_game
from tests.oracles import correlated
from tests.oracles.responses import correlated_gains

CHICKEN = np.array([[[6, 6], [2, 7]], [[7, 2], [0, 0]]], float)


def test_rock_paper_scissors_has_no_other_than_the_uniform_one() -> None:
    (only,) = correlated.equilibria(RockPaperScissors().payoffs)
    np.testing.assert_allclose(only, np.full((3, 3), 1 / 9), atol=1e-12)


def test_prisoners_have_no_other_than_to_defect() -> None:
    (only,) = correlated.equilibria(PrisonersDilemma().payoffs)
    assert only.tolist() == [[0, 0], [0, 1]]


def test_chicken_has_five_corners() -> None:
    found = correlated.equilibria(CHICKEN)
    assert len(found) == 5
    welfare = (found[..., None] * CHICKEN).sum(axis=(1, 2, 3))
    best = found[np.argmax(welfare)]  # the well-known one: 1/2 both dare not, 1/4 each dares alone
    np.testing.assert_allclose(best, [[0.5, 0.25], [0.25, 0.0]])
    assert welfare.max() == pytest.approx(10.5)


def test_where_nothing_matters_every_pair_is_a_corner() -> None:
    assert len(correlated.equilibria(np.zeros((2, 3, 2)))) == 6


@pytest.mark.parametrize("seed", range(9))
def test_the_corners_are_in_equilibrium_and_hold_every_nash_equilibrium(seed: int) -> None:
    random = np.random.default_rng(seed)
    payoffs = random.normal(size=(int(random.integers(1, 4)), 3, 2))
    found = correlated.equilibria(payoffs)
    for joint in found:
        assert joint.min() >= 0
        assert joint.sum() == pytest.approx(1)
        assert (correlated_gains(payoffs, joint) <= 1e-9).all()
    equilibria = matrix_game.enumerate_equilibria(payoffs)
    for profile in equilibria:
        joint = np.outer(*profile)
        weights = np.linalg.lstsq(
            np.vstack([found.reshape(len(found), -1).T, np.ones(len(found))]),
            np.append(joint.reshape(-1), 1.0),
            rcond=None,
        )[0]  # no proof that it is inside, but it lies in the same flat
        np.testing.assert_allclose(np.tensordot(weights, found, 1), joint, atol=1e-9)
    for _ in range(20):  # no direction leads to a better joint than the corners do
        direction = random.normal(size=payoffs.shape[:2])
        best = max((direction * joint).sum() for joint in found)
        for profile in equilibria:
            assert (direction * np.outer(*profile)).sum() <= best + 1e-9
