"""Tests of plots over beliefs: alpha vectors, their regions, and bounds of other methods."""

import itertools

import numpy as np
import pytest

from dmplay.core.arrays import Reals
from dmplay.core.tabular import Tables, tabulate
from dmplay.draw.panels import LinePanel, TrianglePanel
from dmplay.errors import BadParameter, UnknownName
from dmplay.plots.belief_values import (
    compute_alpha_vectors,
    find_action_regions,
    find_upper_surface,
    plot_alpha_vectors,
    plot_belief_values,
)
from dmplay.plots.plotted_problem import load_plotted_problem
from dmplay.registry.problems import load_problem

BELIEFS = np.linspace(0.0, 1.0, 101)


def plan_backward(tables: Tables, discount: float, b: Reals, turns: int) -> float:
    """Return the value of a belief by recursion over actions and observations."""
    if turns == 0:
        return 0.0
    values = []
    for a in range(tables.transition.shape[1]):
        value = float(b @ tables.rewards[:, a, 0])
        for o in range(tables.observation_model.shape[2]):
            joint = (b @ tables.transition[:, a]) * tables.observation_model[a, :, o]
            if joint.sum() > 0:
                continuation = plan_backward(tables, discount, joint / joint.sum(), turns - 1)
                value += discount * float(joint.sum()) * continuation
        values.append(value)
    return max(values)


@pytest.mark.parametrize("turns", [1, 2, 3, 4])
def test_the_upper_surface_is_the_value_of_planning_by_recursion(turns: int) -> None:
    tables = tabulate(load_problem("crying-baby"))
    result = compute_alpha_vectors(load_plotted_problem("crying-baby", (), turns))
    p, values = find_upper_surface(result.vectors)
    for b in (0.0, 0.1, 0.3, 0.5, 0.9, 1.0):
        expected = plan_backward(tables, 0.9, np.array([1 - b, b]), turns)
        assert np.interp(b, p, values) == pytest.approx(expected, abs=1e-9)


def test_the_best_action_of_the_crying_baby_changes_at_the_known_belief() -> None:
    regions = find_action_regions(compute_alpha_vectors(load_plotted_problem("crying-baby")))
    assert [region.label for region in regions] == ["ignore", "feed"]
    assert regions[0].high == pytest.approx(0.28206, abs=5e-6)
    assert (regions[0].low, regions[1].high) == (0.0, 1.0)


@pytest.mark.parametrize("turns", [1, 2, 5, None])
def test_qmdp_is_at_least_fib_which_is_at_least_the_optimum(turns: int | None) -> None:
    subject = load_plotted_problem("crying-baby", (), turns)
    surfaces = []
    for method in ("qmdp", "fib", "optimal"):
        p, values = find_upper_surface(compute_alpha_vectors(subject, method).vectors)
        surfaces.append(np.interp(BELIEFS, p, values))
    for upper, lower in itertools.pairwise(surfaces):
        assert (upper >= lower - 1e-9).all()


def test_with_one_turn_left_all_methods_give_the_expected_rewards() -> None:
    rewards = tabulate(load_problem("crying-baby")).rewards[:, :, 0].T
    for method in ("qmdp", "fib"):
        result = compute_alpha_vectors(load_plotted_problem("crying-baby", (), 1), method)
        assert result.vectors == pytest.approx(rewards)


def test_methods_are_overlaid_with_their_values_at_the_start() -> None:
    plot = plot_alpha_vectors(
        load_plotted_problem("crying-baby", (), 3), ["optimal", "qmdp", "fib"]
    )
    (panel,) = plot.panels
    assert isinstance(panel, LinePanel)
    labels = [series.label for series in panel.series if series.label]
    assert labels == ["optimal", "qmdp", "fib"]
    value = plan_backward(tabulate(load_problem("crying-baby")), 0.9, np.array([0.5, 0.5]), 3)
    assert f"value {value:.4g} at the start; optimal is exact" in plot.notes
    assert plot.title == "crying-baby: alpha vectors, 3 turns left"


def test_the_regions_of_a_triangle_cover_it_and_have_their_best_action() -> None:
    subject = load_plotted_problem("machine-replacement", (), 14)
    (panel,) = plot_belief_values(subject, "policy").panels
    assert isinstance(panel, TrianglePanel)
    area = 0.0
    for index, action in enumerate(panel.actions):
        corners = panel.region_corners(index)
        assert panel.find_best_actions(corners.mean(axis=0, keepdims=True)) == [action]
        x, y = corners[:, 1], corners[:, 2]
        area += float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2
    assert area == pytest.approx(0.5)


def test_two_triangles_of_values_and_actions_come_from_the_same_vectors() -> None:
    subject = load_plotted_problem("machine-replacement", (), 5)
    (values,) = plot_belief_values(subject, "values").panels
    (policy,) = plot_belief_values(subject, "policy").panels
    assert isinstance(values, TrianglePanel)
    assert isinstance(policy, TrianglePanel)
    assert (values.value_label, policy.value_label) == ("expected return", "")
    assert (values.alpha_vectors == policy.alpha_vectors).all()
    tables = tabulate(load_problem("machine-replacement"))
    for b in np.eye(3):
        expected = plan_backward(tables, 1.0, b, 5)
        assert (values.alpha_vectors @ b).max() == pytest.approx(expected)


@pytest.mark.parametrize(
    ("what", "name", "message"),
    [
        ("values", "catch", "values does not fit catch: it has 4 hidden states, expected 2 or 3"),
        ("policy", "hexworld", "policy does not fit hexworld: its agent sees the state"),
        ("values", "multicaregiver-crying-baby", "it has 2 agents, expected 1"),
    ],
)
def test_a_problem_whose_beliefs_cannot_be_drawn_is_refused(
    what: str, name: str, message: str
) -> None:
    with pytest.raises(BadParameter, match=message):
        plot_belief_values(load_plotted_problem(name), what)


def test_alpha_vectors_need_two_states_and_known_methods() -> None:
    with pytest.raises(BadParameter, match="it has 3 hidden states, expected 2"):
        plot_alpha_vectors(load_plotted_problem("machine-replacement"))
    baby = load_plotted_problem("crying-baby")
    with pytest.raises(UnknownName, match="unknown method 'qdmp'; did you mean qmdp"):
        plot_alpha_vectors(baby, ["qdmp"])
    with pytest.raises(BadParameter, match="--methods: got fib,fib, expected each method once"):
        plot_alpha_vectors(baby, ["fib", "fib"])
