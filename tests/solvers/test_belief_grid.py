import numpy as np
import pytest

from dmplay.solvers.belief_grid import BeliefGrid


def test_two_states_in_halves_are_three_points() -> None:
    points = sorted(BeliefGrid(2, 2).points.tolist())
    assert points == [[0.0, 1.0], [0.5, 0.5], [1.0, 0.0]]


@pytest.mark.parametrize(("states", "steps", "many"), [(2, 9, 10), (3, 4, 15), (4, 8, 165)])
def test_there_are_as_many_points_as_ways_to_share_the_steps(
    states: int, steps: int, many: int
) -> None:
    points = BeliefGrid(states, steps).points
    assert len(set(map(tuple, points.tolist()))) == many
    assert (points >= 0).all()
    np.testing.assert_allclose(points.sum(axis=1), 1)


@pytest.mark.parametrize("states", [2, 3, 4, 5])
def test_a_belief_is_the_mean_of_the_points_around_it(states: int) -> None:
    grid = BeliefGrid(states, 7)
    b = np.vstack([np.random.default_rng(states).dirichlet(np.ones(states), 500), grid.points])
    places, weights = grid.find_surrounding_points(b)
    assert (weights >= 0).all()
    np.testing.assert_allclose(weights.sum(axis=1), 1)
    np.testing.assert_allclose(
        (weights[..., None] * grid.points[places]).sum(axis=1), b, atol=1e-12
    )
    near = weights[..., None] > 1e-12
    apart = abs(grid.points[places] - b[:, None]) * near
    assert apart.max() <= 1 / 7 + 1e-12


def test_a_point_is_its_own_mean() -> None:
    grid = BeliefGrid(4, 6)
    places, weights = grid.find_surrounding_points(grid.points)
    heaviest = places[np.arange(len(places)), np.argmax(weights, axis=1)]
    assert heaviest.tolist() == list(range(len(places)))
