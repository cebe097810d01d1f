"""Tests of the figures of the book's appendix F."""

import itertools
from functools import cache

import numpy as np
import pytest

from dmplay.game.plot_kinds import FIGURES, find_figure_name
from dmplay.plots.appendix_figures import DRAW_FUNCTIONS, draw_figure
from dmplay.plots.plot_data import (
    GridPanel,
    HexPanel,
    LinePanel,
    Plot,
    Series,
    TablePanel,
    TrianglePanel,
)


@cache
def draw_cached_figure(name: str) -> Plot:
    return draw_figure(name)


def find_series(panel: LinePanel, label: str) -> Series:
    (series,) = (item for item in panel.series if item.label == label)
    return series


def test_every_figure_has_a_function() -> None:
    assert list(FIGURES) == list(DRAW_FUNCTIONS)


@pytest.mark.parametrize("spelling", ["F.2", "f2", "figure F.2"])
def test_a_figure_is_found_by_several_spellings(spelling: str) -> None:
    assert find_figure_name(spelling) == "F.2"


@pytest.mark.parametrize("spelling", ["F.3", "", "values"])
def test_other_words_are_no_figure(spelling: str) -> None:
    assert find_figure_name(spelling) is None


def test_figure_f1_has_the_chances_of_the_book() -> None:
    (panel,) = draw_cached_figure("F.1").panels
    assert isinstance(panel, HexPanel)
    chances = {cell.hex: cell.value for cell in panel.cells}
    assert chances[1, 0] == pytest.approx(0.7)
    assert chances[0, 1] == chances[1, -1] == pytest.approx(0.15)
    assert chances[-1, 0] == chances[-1, 1] == chances[0, -1] == 0.0


def test_settings_change_a_figure_and_its_title() -> None:
    plot = draw_figure("F.1", ["slip=0.5"])
    (panel,) = plot.panels
    assert isinstance(panel, HexPanel)
    assert max(cell.value or 0.0 for cell in panel.cells) == pytest.approx(0.5)
    assert plot.title == "hexworld (slip=0.5): where a move to E ends"


def test_figure_f2_has_both_maps() -> None:
    maps = draw_cached_figure("F.2").panels
    assert [len(panel.cells) for panel in maps if isinstance(panel, HexPanel)] == [24, 7]


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
    assert ends == [
        [(-13.06, -23.06), (-9.69, -31.63)],
        [(-19.67, -29.67), (-16.31, -38.25)],
    ]
    assert (ten.title, infinite.title) == ("10 turns left", "infinite horizon")


def test_figure_f11_has_two_regions_of_manufacture() -> None:
    (panel,) = draw_cached_figure("F.11").panels
    assert isinstance(panel, TrianglePanel)
    assert panel.best_action(np.array([1.0, 0.0, 0.0])) == "manufacture"
    edge = [panel.best_action(np.array([p, 0.0, 1.0 - p])) for p in np.linspace(0.0, 1.0, 201)]
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
