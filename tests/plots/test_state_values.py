"""Tests of the plotted values and best actions of states, against independent computations."""

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest

from dmplay.core.problem import Problem, enumerate_outcomes
from dmplay.draw.panels import GridPanel, HexPanel, LinePanel, Plot, PlottedHex, TablePanel
from dmplay.errors import BadParameter
from dmplay.plots.report import PlotRequest, build_plot
from dmplay.problems.hexworld.rules import HexWorld
from dmplay.registry.problems import load_problem


@cache
def plot_cached_values(name: str, settings: Sequence[str] = (), turns: int | None = None) -> Plot:
    return build_plot(PlotRequest("values", name, settings=settings, turns=turns))


def list_hex_cells(plot: Plot) -> Sequence[PlottedHex]:
    (panel,) = plot.panels
    assert isinstance(panel, HexPanel)
    return panel.cells


def look_ahead(problem: Problem, s: int, turns: int) -> tuple[float, set[int]]:
    """Return the value of a state with some turns left and its best actions, by recursion."""
    if turns == 0 or problem.terminal(np.array([s]))[0]:
        return 0.0, set()
    q = []
    for a in range(problem.action_counts[0]):
        p, outcome = enumerate_outcomes(problem, np.array([s]), np.array([[a]]))
        q.append(
            sum(
                chance * (reward + problem.discount * look_ahead(problem, int(t), turns - 1)[0])
                for chance, reward, t in zip(
                    p[0], outcome.rewards[0, :, 0], outcome.state[0], strict=True
                )
                if chance > 0
            )
        )
    return max(q), {a for a, value in enumerate(q) if value >= max(q) - 1e-9}


def test_the_values_of_the_straight_line_are_those_of_figure_f2() -> None:
    cells = list_hex_cells(plot_cached_values("hexworld:straight-line"))
    texts = [cell.text for cell in cells]
    assert texts == ["2.37", "3.22", "4.21", "5.36", "6.68", "8.22", "+10"]
    assert [cell.directions for cell in cells] == [[0]] * 6 + [()]


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_hex_values_with_few_turns_left_are_those_of_a_recursion(turns: int) -> None:
    settings = ("slip=0.2",)
    problem = load_problem("hexworld", slip=0.2)
    assert isinstance(problem, HexWorld)
    for cell in list_hex_cells(plot_cached_values("hexworld", settings, turns)):
        value, best = look_ahead(problem, problem.hexes.index(cell.hex), turns)
        assert cell.value == pytest.approx(value, abs=1e-12)
        assert cell.kind or set(cell.directions) == best


def test_hex_values_of_an_infinite_horizon_satisfy_the_bellman_equation() -> None:
    problem = load_problem("hexworld")
    cells = list_hex_cells(plot_cached_values("hexworld"))
    values = np.array([*(cell.value for cell in cells), 0.0])
    for s, cell in enumerate(cells):
        q = []
        for a in range(6):
            p, outcome = enumerate_outcomes(problem, np.array([s]), np.array([[a]]))
            q.append((p * (outcome.rewards[..., 0] + 0.9 * values[outcome.state])).sum())
        assert cell.value == pytest.approx(max(q), abs=1e-9)


def test_the_title_names_settings_and_turns_left() -> None:
    plot = plot_cached_values("hexworld", ("slip=0.2",), 3)
    assert plot.title == "hexworld (slip=0.2): values and best actions, 3 turns left"
    assert plot_cached_values("hexworld").title.endswith("infinite horizon")


@pytest.mark.usefixtures("coarse")
def test_a_plotted_value_of_mountain_car_is_the_length_of_the_drive() -> None:
    problem = load_problem("mountain-car")
    (values,) = build_plot(PlotRequest("values", "mountain-car")).panels
    (policy,) = build_plot(PlotRequest("policy", "mountain-car")).panels
    assert isinstance(values, GridPanel)
    assert isinstance(policy, GridPanel)
    assert policy.categories == ("left", "coast", "right", "several equally good")
    s, turns = np.array([[-0.5, 0.0]]), 0
    columns, rows = values.values.shape
    while not problem.terminal(s)[0]:
        i = round((float(s[0, 0]) - values.x.low) / (values.x.high - values.x.low) * (columns - 1))
        j = round((float(s[0, 1]) - values.y.low) / (values.y.high - values.y.low) * (rows - 1))
        action = min(int(policy.values[i, j]), 2)
        s, turns = problem.step(s, np.array([[action]]), np.zeros((1, 0))).state, turns + 1
        assert turns < 200
    start = values.values[round(0.7 / 1.8 * (columns - 1)), (rows - 1) // 2]
    assert turns == pytest.approx(-start, rel=0.25)


def test_the_values_of_the_regulator_are_the_closed_form() -> None:
    # With a = -s only the noise (standard deviation 0.1) remains: -s^2 - 0.01 * 0.9 / (1 - 0.9).
    (panel,) = plot_cached_values("simple-regulator").panels
    assert isinstance(panel, LinePanel)
    (series,) = panel.series
    assert series.y == pytest.approx(-(series.x**2) - 0.09)
    assert panel.x.label == "state s"
    note = "a game has at most 20 turns; --turns 20 plots those"
    assert plot_cached_values("simple-regulator").notes[-1] == note


def test_the_best_action_of_the_regulator_cancels_the_state() -> None:
    (panel,) = build_plot(PlotRequest("policy", "simple-regulator")).panels
    assert isinstance(panel, LinePanel)
    assert (panel.series[0].y == -panel.series[0].x).all()


def test_states_of_a_small_mdp_file_are_listed_with_their_best_actions(tmp_path: object) -> None:
    path = f"{tmp_path}/coin.mdp"
    with open(path, "w", encoding="utf-8") as file:
        file.write(
            "discount: 0.5\nvalues: reward\nstates: poor rich\nactions: wait work\n"
            "T: wait\nidentity\nT: work\n0 1\n0 1\n"
            "R: wait : rich : * : * 4\nR: work : * : * : * -1\n"
        )
    (panel,) = plot_cached_values(path).panels
    assert isinstance(panel, TablePanel)
    assert panel.rows == ["poor", "rich"]
    # rich: wait pays 4 for ever, 4 / (1 - 0.5); poor: work costs 1 and then half of 8.
    assert panel.cells == [["3", "work"], ["8", "wait"]]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("2048", "values does not fit 2048: it has no list of states and actions; try dmplay"),
        ("cart-pole", "values does not fit cart-pole: it has no list of states and actions"),
        ("predator-prey", "values does not fit predator-prey: it has 2 agents, expected 1"),
    ],
)
def test_a_problem_without_a_picture_of_its_values_is_refused(name: str, message: str) -> None:
    with pytest.raises(BadParameter, match=message):
        plot_cached_values(name)


def test_turns_are_refused_if_they_change_nothing() -> None:
    with pytest.raises(BadParameter, match="--turns: has no effect on values of mountain-car"):
        plot_cached_values("mountain-car", (), 3)
