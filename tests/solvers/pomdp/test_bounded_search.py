import numpy as np
import pytest

import dmplay
from dmplay.core.arrays import Reals
from dmplay.core.tabular import Tables, tabulate
from dmplay.errors import BadParameter
from dmplay.problems.catch.rules import Catch
from dmplay.solvers.pomdp import exact_pomdp
from dmplay.solvers.pomdp.bounded_search import BoundedSearch

UNIFORM_BELIEF = np.full((1, 4), 0.25)


def make_random_pomdp(seed: int) -> Tables:
    """A random POMDP of two or three states, three actions and two observations."""
    rng = np.random.default_rng(seed)
    states = int(rng.integers(2, 4))
    observation = rng.dirichlet(np.ones(2), (3, states))
    if seed % 2:
        observation = np.round(observation)  # some observations become impossible
    return Tables(
        rng.dirichlet(np.full(states, 0.3), (states, 3)),
        rng.normal(size=(states, 3, 1)),
        observation,
    )


def compute_q_by_histories(catch: Catch, b: Reals, turns: int) -> Reals:
    """Return Q `[A]` by trying every throw after every history."""
    q = b @ (catch.success_probabilities * np.arange(10, 101, 10))
    if turns > 1:
        for a in range(10):
            for probabilities in (
                catch.success_probabilities[:, a],
                1 - catch.success_probabilities[:, a],
            ):
                p = b @ probabilities
                q[a] += (
                    catch.discount
                    * p
                    * compute_q_by_histories(catch, b * probabilities / p, turns - 1).max()
                )
    return np.asarray(q)


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_throw_values_match_an_enumeration_of_histories(turns: int) -> None:
    catch = Catch()
    b = np.array([0.1, 0.2, 0.3, 0.4])
    q = BoundedSearch(tabulate(catch), catch.discount).compute_action_values(b[None], turns)[0]
    np.testing.assert_allclose(q, compute_q_by_histories(catch, b, turns), atol=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_search_values_match_the_alpha_vectors(seed: int) -> None:
    model, discount = make_random_pomdp(seed), (0.9, 1.0)[seed % 2]
    states = len(model.transition)
    b = np.random.default_rng(seed).dirichlet(np.ones(states), 20)
    b = np.vstack([b, np.eye(states)])
    search = BoundedSearch(model, discount, grid_resolution=4)
    for turns, stage in enumerate(exact_pomdp.solve_finite_horizon(model, discount, 4), 1):
        expected = exact_pomdp.compute_action_values(stage, b)
        np.testing.assert_allclose(search.compute_action_values(b, turns), expected, atol=2e-9)


def test_the_value_lies_between_its_bounds() -> None:
    search = BoundedSearch(tabulate(Catch()), 0.9)
    b = np.random.default_rng(0).dirichlet(np.ones(4), 20)
    value = search.compute_action_values(b, 6).max(axis=1)
    lower, upper = search._bound_values(b, 6)
    assert (lower <= value + 1e-9).all()
    assert (value <= upper + 1e-9).all()
    assert (upper - lower).max() < 1.0


def test_a_row_does_not_depend_on_the_others() -> None:
    search = BoundedSearch(tabulate(Catch()), 0.9)
    b = np.random.default_rng(3).dirichlet(np.ones(4), 12)
    together = search.compute_action_values(b, 5)
    for row in range(len(b)):
        assert (search.compute_action_values(b[row : row + 1], 5) == together[row]).all()


def test_a_finer_grid_gives_the_same_values() -> None:
    tables = tabulate(Catch())
    coarse, fine = (BoundedSearch(tables, 0.9, steps) for steps in (5, 9))
    np.testing.assert_allclose(
        coarse.compute_action_values(UNIFORM_BELIEF, 7),
        fine.compute_action_values(UNIFORM_BELIEF, 7),
        atol=2e-9,
    )


def test_the_value_of_ten_throws_from_a_uniform_belief() -> None:
    (q,) = BoundedSearch(tabulate(Catch()), 0.9).compute_action_values(UNIFORM_BELIEF, 10)
    assert q.max() == pytest.approx(171.17905657411524, abs=1e-8)
    assert np.argmax(q) == 4  # 50 metres


def test_a_fully_observable_problem_is_rejected() -> None:
    with pytest.raises(BadParameter, match="one with observations"):
        BoundedSearch(tabulate(dmplay.load_problem("hexworld")), 0.9).compute_action_values(
            np.eye(25)[:1], 3
        )


def test_scaling_rewards_by_a_million_scales_the_values() -> None:
    catch = tabulate(dmplay.load_problem("catch"))
    scaled_catch = catch._replace(rewards=1e6 * catch.rewards)
    b = np.random.default_rng(1).dirichlet(np.ones(4), 5)
    plain_values, scaled_values = (
        BoundedSearch(model, 0.9).compute_action_values(b, 4) for model in (catch, scaled_catch)
    )
    np.testing.assert_allclose(scaled_values, 1e6 * plain_values)
