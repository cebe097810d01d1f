import numpy as np
import pytest

from dmplay.solvers.pomdp.belief_grid import BeliefGrid


def test_two_states_at_resolution_two_give_three_points() -> None:
    points = sorted(BeliefGrid(2, 2).points.tolist())
    assert points == [[0.0, 1.0], [0.5, 0.5], [1.0, 0.0]]


@pytest.mark.parametrize(("states", "steps", "point_count"), [(2, 9, 10), (3, 4, 15), (4, 8, 165)])
def test_the_grid_has_one_point_for_each_way_to_distribute_the_steps(
    states: int, steps: int, point_count: int
) -> None:
    points = BeliefGrid(states, steps).points
    assert len(set(map(tuple, points.tolist()))) == point_count
    assert (points >= 0).all()
    np.testing.assert_allclose(points.sum(axis=1), 1)


@pytest.mark.parametrize("states", [2, 3, 4, 5])
def test_a_belief_is_the_mean_of_the_points_around_it(states: int) -> None:
    grid = BeliefGrid(states, 7)
    b = np.vstack([np.random.default_rng(states).dirichlet(np.ones(states), 500), grid.points])
    indices, weights = grid.find_surrounding_points(b)
    assert (weights >= 0).all()
    np.testing.assert_allclose(weights.sum(axis=1), 1)
    np.testing.assert_allclose(
        (weights[..., None] * grid.points[indices]).sum(axis=1), b, atol=1e-12
    )
    has_weight = weights[..., None] > 1e-12
    differences = abs(grid.points[indices] - b[:, None]) * has_weight
    assert differences.max() <= 1 / 7 + 1e-12


def test_a_grid_point_is_interpolated_by_itself() -> None:
    grid = BeliefGrid(4, 6)
    indices, weights = grid.find_surrounding_points(grid.points)
    heaviest = indices[np.arange(len(indices)), np.argmax(weights, axis=1)]
    assert heaviest.tolist() == list(range(len(indices)))
