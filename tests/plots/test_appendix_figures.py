"""Tests of the figures of the book's appendix F."""

import itertools
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from dmplay.draw.panels import (
    BoardPanel,
    GridPanel,
    HexPanel,
    Label,
    LinePanel,
    Plot,
    Polyline,
    Series,
    ShapesPanel,
    TablePanel,
    TrianglePanel,
)
from dmplay.game.plot_kinds import PLOT_KINDS, find_figure_name, list_book_figures, load_figures
from dmplay.plots.report import PlotRequest, build_plot
from dmplay.problems.mountain_car.rules import MountainCar
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.problems import load_problem
from tests.support.programs import run_dmplay


@cache
def draw_cached_figure(name: str) -> Plot:
    return build_plot(PlotRequest(name))


def find_series(panel: LinePanel, label: str) -> Series:
    (series,) = (item for item in panel.series if item.label == label)
    return series


def format_boards(name: str) -> list[str]:
    """Return the boards of a figure as texts, such as `2 . / . 4`."""
    texts = []
    for panel in draw_cached_figure(name).panels:
        assert isinstance(panel, BoardPanel)
        numbers = {(tile.row, tile.column): str(tile.number) for tile in panel.tiles}
        side = range(panel.size)
        rows = [" ".join(numbers.get((row, column), ".") for column in side) for row in side]
        texts.append("/".join(rows))
    return texts


def find_shapes(name: str) -> tuple[list[Polyline], list[str]]:
    """Return the lines and the texts of a figure of shapes."""
    (panel,) = draw_cached_figure(name).panels
    assert isinstance(panel, ShapesPanel)
    lines = [shape for shape in panel.shapes if isinstance(shape, Polyline)]
    return lines, [shape.text for shape in panel.shapes if isinstance(shape, Label) and shape.text]


def test_the_list_read_without_imports_names_the_figures_of_all_problems() -> None:
    defined = {
        name: (figure.title, problem)
        for problem in problem_names()
        for name, figure in load_figures(load_problem(problem)).items()
        if name not in PLOT_KINDS
    }
    assert [*list_book_figures()] == [*(f"F.{number}" for number in range(1, 17)), "T.2"]
    assert list_book_figures() == defined


@pytest.mark.parametrize("spelling", ["F.2", "f2", "figure F.2"])
def test_a_figure_is_found_by_several_spellings(spelling: str) -> None:
    assert find_figure_name(spelling, list_book_figures()) == "F.2"


@pytest.mark.parametrize("spelling", ["F.17", "", "values"])
def test_other_words_are_no_figure(spelling: str) -> None:
    assert find_figure_name(spelling, list_book_figures()) is None


def test_figure_f1_has_the_chances_of_the_book() -> None:
    (panel,) = draw_cached_figure("F.1").panels
    assert isinstance(panel, HexPanel)
    chances = {cell.hex: cell.value for cell in panel.cells}
    assert chances[1, 0] == pytest.approx(0.7)
    assert chances[0, 1] == chances[1, -1] == pytest.approx(0.15)
    assert chances[-1, 0] == chances[-1, 1] == chances[0, -1] == 0.0


def test_settings_change_a_figure_and_its_title() -> None:
    plot = build_plot(PlotRequest("F.1", settings=["slip=0.5"]))
    (panel,) = plot.panels
    assert isinstance(panel, HexPanel)
    assert max(cell.value or 0.0 for cell in panel.cells) == pytest.approx(0.5)
    assert plot.title == "hexworld (slip=0.5): where a move to E ends"


def test_figure_f2_has_both_maps() -> None:
    maps = draw_cached_figure("F.2").panels
    assert [len(panel.cells) for panel in maps if isinstance(panel, HexPanel)] == [24, 7]


def test_figure_f3_is_the_start_of_the_game_with_its_seed(tmp_path: Path) -> None:
    assert format_boards("F.3") == [". . . 4/. . . ./. . 2 ./. . . ."]
    assert draw_cached_figure("F.3").title == "2048: a random starting state (seed 11)"
    start = run_dmplay(tmp_path, "2048", "--seed", "11", stdin="").stdout
    assert "row 1: empty empty empty 4." in start
    assert "row 3: empty empty 2 empty." in start


def test_figure_f3_follows_the_probability_of_a_2() -> None:
    (panel,) = build_plot(PlotRequest("F.3", settings=["p_two=0"])).panels
    assert isinstance(panel, BoardPanel)
    assert [tile.number for tile in panel.tiles] == [4, 4]


def test_figure_f4_slides_the_start_down_and_adds_a_tile() -> None:
    before, slid, after = format_boards("F.4")
    assert [before] == format_boards("F.3")
    assert slid == ". . . ./. . . ./. . . ./. . 2 4"
    assert after == ". 2 . ./. . . ./. . . ./. . 2 4"
    first, _, last = draw_cached_figure("F.4").panels
    assert isinstance(first, BoardPanel)
    assert isinstance(last, BoardPanel)
    assert [tile.end for tile in first.tiles] == [(3, 3), (3, 2)]
    assert [(tile.row, tile.column) for tile in last.tiles if tile.is_marked] == [(0, 1)]


def test_figure_f5_merges_two_4_tiles_and_pays_8() -> None:
    assert format_boards("F.5")[:2] == [
        ". . . 2/4 . . ./. . . ./4 2 . .",
        ". . . ./. . . ./. . . ./8 2 . 2",
    ]
    slid = draw_cached_figure("F.5").panels[1]
    assert isinstance(slid, BoardPanel)
    assert slid.title == "reward 8"
    assert [tile.number for tile in slid.tiles if tile.is_marked] == [8]


def test_figure_f6_draws_the_state_after_seven_pushes() -> None:
    """The state is computed again with the book's equations F.1 to F.4."""
    x = v = theta = omega = 0.0
    for _ in range(7):
        tau = (-10.0 + omega**2 * math.sin(theta) / 2) / 1.1
        inertia = (4 / 3 - 0.1 / 1.1 * math.cos(theta) ** 2) / 2
        alpha = (9.8 * math.sin(theta) - tau * math.cos(theta)) / inertia
        acceleration = tau - alpha * math.cos(theta) / 2 * 0.1 / 1.1
        x, v = x + 0.02 * v, v + 0.02 * acceleration
        theta, omega = theta + 0.02 * omega, omega + 0.02 * alpha
    lines, texts = find_shapes("F.6")
    (pole,) = (line.points for line in lines[1:] if not line.is_dashed and not line.arrow_heads)
    foot, tip = np.array(pole)
    assert tip - foot == pytest.approx([math.sin(theta), math.cos(theta)])
    assert foot[0] == pytest.approx(x)
    assert set(texts) == {
        "force 10 N",
        "pole 1 m, 0.1 kg",
        f"theta {math.degrees(theta):+.1f} deg",
        f"omega {math.degrees(omega):+.0f} deg/s",
        f"cart 1 kg, x {x:+.2f} m, v {v:+.2f} m/s",
    }
    limits = sorted(float(line.points[0][0]) for line in lines if line.is_dashed)
    assert (limits[0], limits[-1]) == (-2.4, 2.4)


def test_figure_f6_stops_before_a_game_ends_that_has_no_room() -> None:
    (note, *_) = build_plot(PlotRequest("F.6", settings=["x_limit=0"])).notes
    assert note == "the state after 1 turn of pushes to the left, from rest"


def test_figure_f7_has_the_hill_whose_slope_moves_the_car() -> None:
    hill, *_ = find_shapes("F.7")[0]
    positions, heights = np.transpose(hill.points)
    problem = MountainCar()
    s = np.stack([positions, np.zeros_like(positions)], axis=1)
    coast = np.ones((len(s), 1), np.int64)
    speeds = problem.step(s, coast, np.zeros((len(s), 0))).state[:-1, 1]  # not at the goal
    slopes = np.gradient(heights, positions)[:-1]
    assert speeds == pytest.approx(-0.0025 / 3 * slopes, abs=2e-5)
    assert (positions[0], positions[-1]) == (-1.2, 0.6)


def test_figure_f7_moves_its_flag_with_the_goal() -> None:
    (panel,) = build_plot(PlotRequest("F.7", settings=["goal=0.5"])).panels
    assert isinstance(panel, ShapesPanel)
    (flag,) = (s for s in panel.shapes if isinstance(s, Label) and s.text == "goal 0.5")
    assert flag.x == 0.5


def test_figure_f8_names_the_state_and_points_along_the_flight() -> None:
    lines, texts = find_shapes("F.8")
    assert texts == [
        "collision: closer than 50 m",
        "other aircraft",
        "h = +52 m",
        "t_col = 40 s",
        "dh = -5.1 m/s",
        "our aircraft, a_prev = no-advisory",
    ]
    height, rate = 52.0696784, -5.13890606  # the start of the game with seed 11
    (flight,) = (line.points for line in lines if line.arrow_heads == "end")
    assert np.array(flight) == pytest.approx(np.array([[40.0, height], [32.0, height + 8 * rate]]))


def test_figure_f9_has_its_climb_region_at_a_rising_aircraft() -> None:
    panels = draw_cached_figure("F.9").panels
    level, rising = (panel.values for panel in panels[2:] if isinstance(panel, GridPanel))
    # At 5 m/s, advisories reach from 2 to 37 s. At 0 m/s, climbs above mirror descents below.
    seconds = np.flatnonzero((rising != 1).any(axis=1))
    assert (seconds.min(), seconds.max()) == (2, 37)
    assert np.flatnonzero((rising == 2).any(axis=1)).max() == 25
    assert (level[:, :10] == 2 - level[:, :10:-1]).all()


def test_figure_f10_has_the_ten_turn_and_the_infinite_horizon_function() -> None:
    ten, infinite = draw_cached_figure("F.10").panels
    assert isinstance(ten, LinePanel)
    assert isinstance(infinite, LinePanel)
    ends = [
        sorted(tuple(np.round(item.y, 2).tolist()) for item in panel.series if item.is_thin)
        for panel in (ten, infinite)
    ]
    assert ends == [[(-13.06, -23.06), (-9.69, -31.63)], [(-19.67, -29.67), (-16.31, -38.25)]]
    assert (ten.title, infinite.title) == ("10 turns left", "infinite horizon")


def test_figure_f11_has_two_regions_of_manufacture() -> None:
    (panel,) = draw_cached_figure("F.11").panels
    assert isinstance(panel, TrianglePanel)
    assert panel.find_best_actions(np.array([[1.0, 0.0, 0.0]])) == ["manufacture"]
    p = np.linspace(0.0, 1.0, 201)
    edge = panel.find_best_actions(np.stack([p, np.zeros(201), 1.0 - p], axis=1))
    changes = [edge[0]]
    changes += [name for before, name in itertools.pairwise(edge) if name != before]
    assert changes == ["replace", "manufacture", "examine", "manufacture"]


def test_figure_f12_has_the_known_number_of_alpha_vectors_for_each_horizon() -> None:
    panels = draw_cached_figure("F.12").panels
    counts = [len(panel.actions) for panel in panels if isinstance(panel, TrianglePanel)]
    assert counts == [1, 1, 1, 1, 1, 2, 3, 4, 4, 5, 6, 8, 10, 15, 13, 14, 9, 12, 10, 13]


def test_figure_f13_halves_at_the_proficiency() -> None:
    (panel,) = draw_cached_figure("F.13").panels
    assert isinstance(panel, LinePanel)
    for proficiency in (20, 40, 60, 80):
        series = find_series(panel, f"proficiency {proficiency}")
        assert np.interp(proficiency, series.x, series.y) == pytest.approx(0.5)
        assert series.y == pytest.approx(1 - 1 / (1 + np.exp(-(series.x - proficiency) / 15)))


def test_figure_f14_marks_that_both_defect() -> None:
    (panel,) = draw_cached_figure("F.14").panels
    assert isinstance(panel, TablePanel)
    assert panel.cells == [["-1, -1", "-4, 0"], ["0, -4", "-3, -3"]]
    assert panel.marked == {(1, 1)}


def test_figure_f15_has_no_equilibrium_in_pure_strategies() -> None:
    plot = draw_cached_figure("F.15")
    (panel,) = plot.panels
    assert isinstance(panel, TablePanel)
    assert panel.marked == frozenset()
    third = "rock 0.3333 paper 0.3333 scissors 0.3333"
    assert plot.notes == [f"Nash equilibrium: agent1: {third}; agent2: {third}"]


def test_figure_f16_has_the_predator_above_the_prey() -> None:
    (panel,) = draw_cached_figure("F.16").panels
    assert isinstance(panel, HexPanel)
    places = {cell.text: cell.hex for cell in panel.cells if cell.text}
    assert places == {"predator": (1, 2), "prey": (2, 0)}


def test_table_f2_equals_the_printed_table() -> None:
    tables = [panel for panel in draw_cached_figure("T.2").panels if isinstance(panel, TablePanel)]
    assert [table.title for table in tables] == ["manufacture", "examine", "interrupt", "replace"]
    assert tables[1].cells[0] == ["0.81", "0.18", "0.01", "1", "0", "0.6525"]
    assert tables[1].cells[2] == ["0", "0", "1", "0.25", "0.75", "0"]
