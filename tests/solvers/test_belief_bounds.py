import numpy as np
import pytest

from dmplay.solvers.belief_bounds import BeliefBatch, BoundLayer, GrowingColumns

STATES, ACTIONS = 6, 3


def test_columns_are_kept_however_many_there_are() -> None:
    columns = GrowingColumns(2)
    assert [columns.append(np.array([n, -n])) for n in range(40)] == [*range(40)]
    assert columns.array.tolist() == [[*range(40)], [-n for n in range(40)]]


def test_a_bound_is_that_of_the_point_which_lowers_it_most() -> None:
    random = np.random.default_rng(3)
    highest = random.normal(size=(ACTIONS, STATES))
    layer = BoundLayer(highest - 9.0, highest, 1)
    points = random.dirichlet(np.full(STATES, 0.3), 40) * (random.random((40, STATES)) < 0.6)
    points = points[points.any(axis=1)]
    points /= points.sum(axis=1, keepdims=True)
    values = (points @ highest.T).max(axis=1) - random.random(len(points))
    for number, (point, value) in enumerate(zip(points, values, strict=True)):
        layer.add_point(number, point, value + 0.5)
        layer.add_point(number, point, value)  # which replaces it
    likely = random.dirichlet(np.full(STATES - 1, 0.5), 8)
    some = BeliefBatch(np.arange(1, STATES), likely)
    high = layer.compute_informed_bounds(some).max(axis=1)
    expected = high.copy()
    for k, belief in enumerate(np.pad(likely, ((0, 0), (1, 0)))):
        for point, value in zip(points, values, strict=True):
            share = (belief[point > 0] / point[point > 0]).min()
            rest = (highest @ (belief - share * point)).max()
            expected[k] = min(expected[k], share * value + rest)
    assert (expected < high - 0.01).any()
    assert layer.compute_sawtooth_bounds(some, high, 0)[0] == pytest.approx(expected)
    late, _ = layer.compute_sawtooth_bounds(some, high, layer.sawtooth_points.column_count - 2)
    assert (late >= expected - 1e-9).all()
    assert layer.compute_sawtooth_bounds(some, expected, 0)[0] == pytest.approx(expected)


def test_what_a_point_hardly_holds_possible_may_be_all_that_makes_it_bad() -> None:
    layer = BoundLayer(np.full((1, 4), -1e12), np.zeros((1, 4)), 1)
    layer.add_point(
        0, np.array([0.5, 0.3, 0.2 - 1e-10, 1e-10]), -100.0
    )  # the last state is a disaster
    safe = BeliefBatch(np.arange(3), np.array([[0.5, 0.3, 0.2]]))
    assert layer.compute_sawtooth_bounds(safe, np.zeros(1), 0)[0] == 0.0


def test_plans_that_are_kept_go_on_with_what_is_now_in_the_place_of_others() -> None:
    layer = BoundLayer(np.zeros((2, 3)), np.ones((2, 3)), 2)
    assert layer.add_plan(np.full(3, 0.5), 1, np.array([0, 1]), 7) == 2
    assert layer.add_plan(np.full(3, 0.7), 0, np.array([2, 3]), 8) == 3
    layer.keep_plans(np.array([0, 1, 3]), np.array([0, 1, 2, 2]))
    assert layer.plan_actions.tolist() == [0, 1, 0]
    assert layer.source_beliefs.tolist() == [-1, -1, 8]
    assert layer.next_plans.T.tolist() == [[0, 0], [1, 1], [2, 2]]
    assert layer.plan_vectors.array[0].tolist() == [0.0, 0.0, 0.7]
