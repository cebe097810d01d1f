"""Tests of the figures and the maps of a problem in a user's file."""

from pathlib import Path

import pytest

from dmplay.draw.panels import HexPanel, LinePanel
from dmplay.draw.plot_text import draw_plot
from dmplay.errors import BadParameter, UnknownName
from dmplay.plots.report import PlotRequest, build_plot
from tests.support.programs import run_dmplay
from tests.support.user_problems import WALK_SOURCE

FIGURE_SOURCE = """
from dmplay import Axis, Figure, LinePanel, Plot, Series


def draw(subject):
    s = subject.problem.enumerate_states().astype(float)
    x, y = Axis("state", 0.0, 9.0), Axis("double", 0.0, 18.0)
    return Plot(f"{subject.title}, {subject.turns}", [LinePanel("", x, y, [Series("", s, 2 * s)])])


FIGURES = {"line": Figure("twice the state", draw), "policy": Figure("a line", draw, True)}
"""
HEX_SOURCE = """
from dataclasses import dataclass

import numpy as np

from dmplay import Labels, Tables, Tabular


@dataclass(frozen=True)
class Path(Tabular):
    # three hexes in a row; at the eastern one, any action pays 4 and ends the game

    actions = (Labels(("e", "ne", "nw", "w", "sw", "se")),)
    state_names, initial_belief = ("first", "second", "exit", "end"), np.array([1.0, 0, 0, 0])
    hexes, exits = ((0, 0), (1, 0), (2, 0)), {(2, 0): 4.0}
    discount: float = 0.5
    tables = Tables(
        np.eye(4)[[[1, 0, 0, 0, 0, 0], [2, 1, 1, 0, 1, 1], [3] * 6, [3] * 6]],
        np.repeat(np.array([0.0, 0.0, 4.0, 0.0]), 6).reshape(4, 6, 1),
    )

    def terminal(self, s):
        return s == 3
"""


@pytest.fixture(autouse=True)
def working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    Path("walk.py").write_text(WALK_SOURCE + FIGURE_SOURCE)
    Path("path.py").write_text(HEX_SOURCE)


def test_a_figure_of_a_users_file_is_drawn_by_its_name() -> None:
    plot = build_plot(PlotRequest("line", "./walk.py", settings=["slip=0.2"]))
    (panel,) = plot.panels
    assert isinstance(panel, LinePanel)
    assert plot.title == "./walk.py (slip=0.2), None"
    assert (panel.series[0].y == 2 * panel.series[0].x).all()


def test_a_figure_with_the_name_of_a_plot_is_drawn_in_its_place() -> None:
    assert build_plot(PlotRequest("policy", "./walk.py", turns=3)).title == "./walk.py, 3"


@pytest.mark.parametrize(
    ("request_", "message"),
    [
        (PlotRequest("lines", "./walk.py"), "unknown plot 'lines'; did you mean line"),
        (PlotRequest("line", "./walk.py", turns=3), "--turns: has no effect on plot line"),
        (PlotRequest("F.2", "./walk.py"), "got ./walk.py; the figure is about hexworld"),
    ],
)
def test_a_plot_that_a_users_file_does_not_have_is_refused(
    request_: PlotRequest, message: str
) -> None:
    with pytest.raises((BadParameter, UnknownName), match=message):
        build_plot(request_)


@pytest.mark.parametrize(
    "value", ["[7]", '{"line": draw}', '{1: Figure("", draw)}', '{"line": Figure("", print)}']
)
def test_figures_of_a_wrong_type_are_one_line_that_names_the_file(value: str) -> None:
    Path("bad.py").write_text(f"{WALK_SOURCE}{FIGURE_SOURCE}\n\nFIGURES = {value}\n")
    with pytest.raises(
        BadParameter, match=r"bad\.py:\d+: FIGURES: .*got .*expected a (mapping of names|Plot)"
    ):
        build_plot(PlotRequest("line", "./bad.py"))


def test_the_check_of_a_problem_reports_invalid_figures(tmp_path: Path) -> None:
    Path("bad.py").write_text(f"{WALK_SOURCE}{FIGURE_SOURCE}\n\nFIGURES = [7]\n")
    result = run_dmplay(tmp_path, "check", "./bad.py")
    assert result.returncode == 2
    assert "bad.py:78: FIGURES: got [7]" in result.stdout


def test_an_error_in_the_function_of_a_figure_names_its_line(tmp_path: Path) -> None:
    Path("bad.py").write_text(WALK_SOURCE + FIGURE_SOURCE.replace("enumerate", "list"))
    result = run_dmplay(tmp_path, "plot", "line", "./bad.py")
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.count("\n") == 1
    assert "AttributeError" in result.stderr


def test_values_are_drawn_on_the_hexes_of_a_users_problem(tmp_path: Path) -> None:
    plot = build_plot(PlotRequest("values", "./path.py"))
    (panel,) = plot.panels
    assert isinstance(panel, HexPanel)
    assert [(cell.hex, round(cell.value or 0.0, 9), cell.text) for cell in panel.cells] == [
        ((0, 0), 1.0, "1.00"), ((1, 0), 2.0, "2.00"), ((2, 0), 4.0, "+4"),
    ]  # fmt: skip
    assert "+4" in draw_plot(plot, 80).plain
