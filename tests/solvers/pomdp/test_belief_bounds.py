import numpy as np
import pytest

from dmplay.solvers.pomdp.belief_bounds import BeliefBatch, BoundLayer, GrowingColumns

STATE_COUNT, ACTION_COUNT = 6, 3


def test_growing_columns_keep_all_their_values() -> None:
    columns = GrowingColumns(2)
    assert [columns.append(np.array([n, -n])) for n in range(40)] == [*range(40)]
    assert columns.array.tolist() == [[*range(40)], [-n for n in range(40)]]


def test_the_upper_bound_is_the_lowest_over_all_sawtooth_points() -> None:
    rng = np.random.default_rng(3)
    upper_vectors = rng.normal(size=(ACTION_COUNT, STATE_COUNT))
    layer = BoundLayer(upper_vectors - 9.0, upper_vectors, 1)
    points = rng.dirichlet(np.full(STATE_COUNT, 0.3), 40) * (rng.random((40, STATE_COUNT)) < 0.6)
    points = points[points.any(axis=1)]
    points /= points.sum(axis=1, keepdims=True)
    values = (points @ upper_vectors.T).max(axis=1) - rng.random(len(points))
    for node, (point, value) in enumerate(zip(points, values, strict=True)):
        layer.add_sawtooth_point(node, point, value + 0.5)
        layer.add_sawtooth_point(node, point, value)  # replaces the previous value
    probabilities = rng.dirichlet(np.full(STATE_COUNT - 1, 0.5), 8)
    beliefs = BeliefBatch(np.arange(1, STATE_COUNT), probabilities)
    upper_bounds = layer.compute_informed_bounds(beliefs).max(axis=1)
    expected = upper_bounds.copy()
    for k, belief in enumerate(np.pad(probabilities, ((0, 0), (1, 0)))):
        for point, value in zip(points, values, strict=True):
            weight = (belief[point > 0] / point[point > 0]).min()
            remainder = (upper_vectors @ (belief - weight * point)).max()
            expected[k] = min(expected[k], weight * value + remainder)
    assert (expected < upper_bounds - 0.01).any()
    assert layer.compute_sawtooth_bounds(beliefs, upper_bounds, 0)[0] == pytest.approx(expected)
    later_bounds, _ = layer.compute_sawtooth_bounds(
        beliefs, upper_bounds, layer.sawtooth_points.column_count - 2
    )
    assert (later_bounds >= expected - 1e-9).all()
    assert layer.compute_sawtooth_bounds(beliefs, expected, 0)[0] == pytest.approx(expected)


def test_an_almost_impossible_state_can_dominate_the_value_of_a_point() -> None:
    layer = BoundLayer(np.full((1, 4), -1e12), np.zeros((1, 4)), 1)
    # the last state is a disaster
    layer.add_sawtooth_point(0, np.array([0.5, 0.3, 0.2 - 1e-10, 1e-10]), -100.0)
    safe = BeliefBatch(np.arange(3), np.array([[0.5, 0.3, 0.2]]))
    assert layer.compute_sawtooth_bounds(safe, np.zeros(1), 0)[0] == 0.0


def test_pruned_plans_refer_to_the_new_indices_of_their_successors() -> None:
    layer = BoundLayer(np.zeros((2, 3)), np.ones((2, 3)), 2)
    assert layer.add_plan(np.full(3, 0.5), 1, np.array([0, 1]), 7) == 2
    assert layer.add_plan(np.full(3, 0.7), 0, np.array([2, 3]), 8) == 3
    layer.keep_plans(np.array([0, 1, 3]), np.array([0, 1, 2, 2]))
    assert layer.plan_actions.tolist() == [0, 1, 0]
    assert layer.source_beliefs.tolist() == [-1, -1, 8]
    assert layer.next_plans.T.tolist() == [[0, 0], [1, 1], [2, 2]]
    assert layer.plan_vectors.array[0].tolist() == [0.0, 0.0, 0.7]
