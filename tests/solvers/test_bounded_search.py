import numpy as np
import pytest

import dmplay
from dmplay.chance import Reals
from dmplay.errors import BadParameter
from dmplay.problems.catch import Catch
from dmplay.solvers import alpha_vectors
from dmplay.solvers.bounded_search import BoundedSearch
from dmplay.tabular import Tables, tabulate

UNIFORM = np.full((1, 4), 0.25)


def tiny(seed: int) -> Tables:
    """A random POMDP of two or three states, three actions and two observations."""
    random = np.random.default_rng(seed)
    states = int(random.integers(2, 4))
    observation = random.dirichlet(np.ones(2), (3, states))
    if seed % 2:
        observation = np.round(observation)  # some observations become impossible
    return Tables(
        random.dirichlet(np.full(states, 0.3), (states, 3)),
        random.normal(size=(states, 3, 1)),
        observation,
    )


def by_histories(catch: Catch, b: Reals, turns: int) -> Reals:
    """Q `[A]` by trying every throw after every history."""
    q = b @ (catch.catch_probabilities * np.arange(10, 101, 10))
    if turns > 1:
        for a in range(10):
            for likely in (catch.catch_probabilities[:, a], 1 - catch.catch_probabilities[:, a]):
                p = b @ likely
                q[a] += catch.discount * p * by_histories(catch, b * likely / p, turns - 1).max()
    return np.asarray(q)


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_throws_are_worth_what_all_histories_say(turns: int) -> None:
    catch = Catch()
    b = np.array([0.1, 0.2, 0.3, 0.4])
    q = BoundedSearch(tabulate(catch), catch.discount).compute_action_values(b[None], turns)[0]
    np.testing.assert_allclose(q, by_histories(catch, b, turns), atol=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_a_search_finds_what_the_alpha_vectors_hold(seed: int) -> None:
    model, discount = tiny(seed), (0.9, 1.0)[seed % 2]
    states = len(model.transition)
    b = np.random.default_rng(seed).dirichlet(np.ones(states), 20)
    b = np.vstack([b, np.eye(states)])
    search = BoundedSearch(model, discount, grid_resolution=4)
    for turns, stage in enumerate(alpha_vectors.solve_finite_horizon(model, discount, 4), 1):
        wanted = alpha_vectors.compute_action_values(stage, b)
        np.testing.assert_allclose(search.compute_action_values(b, turns), wanted, atol=2e-9)


def test_the_bounds_hold_the_value_between_them() -> None:
    search = BoundedSearch(tabulate(Catch()), 0.9)
    b = np.random.default_rng(0).dirichlet(np.ones(4), 20)
    value = search.compute_action_values(b, 6).max(axis=1)
    low, high = search._bound_values(b, 6)
    assert (low <= value + 1e-9).all()
    assert (value <= high + 1e-9).all()
    assert (high - low).max() < 1.0


def test_a_row_does_not_depend_on_the_others() -> None:
    search = BoundedSearch(tabulate(Catch()), 0.9)
    b = np.random.default_rng(3).dirichlet(np.ones(4), 12)
    together = search.compute_action_values(b, 5)
    for row in range(len(b)):
        assert (search.compute_action_values(b[row : row + 1], 5) == together[row]).all()


def test_a_finer_grid_finds_the_same() -> None:
    tables = tabulate(Catch())
    coarse, fine = (BoundedSearch(tables, 0.9, steps) for steps in (5, 9))
    np.testing.assert_allclose(
        coarse.compute_action_values(UNIFORM, 7), fine.compute_action_values(UNIFORM, 7), atol=2e-9
    )


def test_ten_throws_from_nothing_known_are_worth_this() -> None:
    (q,) = BoundedSearch(tabulate(Catch()), 0.9).compute_action_values(UNIFORM, 10)
    assert q.max() == pytest.approx(171.17905657411524, abs=1e-8)
    assert np.argmax(q) == 4  # 50 metres


def test_a_problem_whose_state_is_seen_is_refused() -> None:
    with pytest.raises(BadParameter, match="one with observations"):
        BoundedSearch(tabulate(dmplay.load_problem("hexworld")), 0.9).compute_action_values(
            np.eye(25)[:1], 3
        )


def test_throws_of_millions_of_metres_are_searched_alike() -> None:
    catch = tabulate(dmplay.load_problem("catch"))
    far = catch._replace(rewards=1e6 * catch.rewards)
    b = np.random.default_rng(1).dirichlet(np.ones(4), 5)
    near, wide = (BoundedSearch(one, 0.9).compute_action_values(b, 4) for one in (catch, far))
    np.testing.assert_allclose(wide, 1e6 * near)
