import numpy as np
import pytest

from dmplay.solvers.pomdp.upper_envelope import compute_upper_envelope

TENT_VECTORS = np.array([[0.0, -1.0], [-1.0, 0.0]])


def test_two_lines_meet_where_they_are_equal() -> None:
    cells = compute_upper_envelope(TENT_VECTORS)
    assert cells.needed_vectors.tolist() == [0, 1]
    order = np.argsort(cells.corner_beliefs[:, 1])
    np.testing.assert_allclose(
        cells.corner_beliefs[order], np.array([[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]])
    )
    np.testing.assert_allclose(cells.corner_values[order], [0.0, -0.5, 0.0])
    assert cells.touching_vectors[order].tolist() == [[True, False], [True, True], [False, True]]


@pytest.mark.parametrize("height", [-0.5, -0.6, -0.5 - 1e-13, -0.5 + 1e-13])
def test_a_line_that_only_touches_the_envelope_is_not_needed(height: float) -> None:
    cells = compute_upper_envelope(np.vstack([[height, height], TENT_VECTORS]))
    assert cells.needed_vectors.tolist() == [1, 2]


def test_a_line_that_rises_above_a_corner_is_needed() -> None:
    assert compute_upper_envelope(
        np.vstack([TENT_VECTORS, [-0.49999, -0.49999]])
    ).needed_vectors.tolist() == [0, 1, 2]


def test_only_one_of_equal_vectors_is_needed() -> None:
    assert (
        len(compute_upper_envelope(np.vstack([TENT_VECTORS, TENT_VECTORS + 1e-14])).needed_vectors)
        == 2
    )


@pytest.mark.parametrize("states", [2, 3])
def test_only_one_of_nearly_equal_vectors_is_needed(states: int) -> None:
    middle = np.full(states, -0.3)  # rounding does not raise it above the others
    near = middle + 2e-11 * np.array([[tilt, *[-tilt] * (states - 1)] for tilt in range(-2, 3)])
    assert (
        len(compute_upper_envelope(np.vstack([-np.eye(states), near])).needed_vectors) == states + 1
    )


def test_a_vector_that_is_best_only_in_one_corner_is_not_needed() -> None:
    assert compute_upper_envelope(
        np.array([[1.0, 0.0, 0.0], [1.0, -1.0, -1.0]])
    ).needed_vectors.tolist() == [0]


def test_one_vector_is_the_envelope_over_any_simplex() -> None:
    cells = compute_upper_envelope(np.array([[1.0, 2.0, 3.0, 4.0]]))
    assert cells.needed_vectors.tolist() == [0]
    np.testing.assert_allclose(sorted(cells.corner_values), [1, 2, 3, 4])


@pytest.mark.parametrize("seed", range(20))
def test_needed_vectors_are_the_best_ones_of_a_fine_grid(seed: int) -> None:
    rng = np.random.default_rng(seed)
    states = int(rng.integers(2, 5))
    vectors = rng.normal(size=(12, states))
    cells = compute_upper_envelope(vectors)
    b = rng.dirichlet(np.ones(states), 5000)
    np.testing.assert_allclose(
        (b @ vectors[cells.needed_vectors].T).max(axis=1), (b @ vectors.T).max(axis=1)
    )
    assert set(np.argmax(b @ vectors.T, axis=1)) <= set(cells.needed_vectors)


@pytest.mark.parametrize("seed", range(20))
def test_the_middle_of_a_cell_has_one_best_vector(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vectors = rng.normal(size=(15, int(rng.integers(2, 6))))
    cells = compute_upper_envelope(vectors)
    np.testing.assert_allclose(
        cells.corner_values, (vectors @ cells.corner_beliefs.T).max(axis=0), atol=1e-12
    )
    for k, vector in enumerate(cells.needed_vectors):
        middle = cells.corner_beliefs[cells.touching_vectors[:, k]].mean(axis=0)
        values = vectors @ middle
        assert np.argmax(values) == vector
        assert np.sort(values)[-2] < values[vector] - 1e-9


def test_scaled_values_need_the_same_vectors() -> None:
    for seed, states, scale in ((5, 3, 1e6), (1, 4, 1e6), (3, 3, 1e8), (5, 2, 1e12)):
        vectors = np.random.default_rng(seed).normal(size=(40, states))
        cells, large = compute_upper_envelope(vectors), compute_upper_envelope(scale * vectors)
        assert large.needed_vectors.tolist() == cells.needed_vectors.tolist()
        assert large.touching_vectors.tolist() == cells.touching_vectors.tolist()
        np.testing.assert_allclose(
            large.corner_values, scale * cells.corner_values, atol=1e-12 * scale
        )
