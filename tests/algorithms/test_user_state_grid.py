"""Tests of the grid over real states that a user's file defines."""

from pathlib import Path

import numpy as np
import pytest

from dmplay.algorithms.finite_mdp import build_finite_mdp
from dmplay.draw.panels import GridPanel
from dmplay.errors import BadParameter
from dmplay.plots.report import PlotRequest, build_plot
from dmplay.plots.state_values import PLOTTED_NOUNS
from dmplay.registry.problems import load_problem
from tests.support.programs import run_dmplay

GLIDER_SOURCE = '''
from dataclasses import dataclass

import numpy as np

from dmplay import ContinuousStates, GridAxis, Labels, Outcome, Problem, StateGrid


@dataclass(frozen=True)
class Glider(Problem):
    """A glider that sinks; its wind stays the same."""

    actions = (Labels(("dive", "stay")),)
    state_count = ContinuousStates(3)
    state_grid = StateGrid(
        (
            GridAxis("height", np.linspace(0.0, 4.0, 5)),
            GridAxis("wind", np.array([0.0, 1.0]), is_interpolated=False, drawn=(1.0,)),
            GridAxis("distance", np.linspace(0.0, 8.0, 9)),
        ),
        x=2,
        y=0,
        note="Drawn: wind 1.",
    )

    def initial_chance(self, rows):
        return ()

    def initial_states(self, rows, events):
        return np.tile([4.0, 1.0, 0.0], (rows, 1))

    def resolve_events(self, s, a, events):
        sinks = np.where(a[:, 0] == 0, 2.0, 0.5)
        h = np.maximum(s[:, 0] - sinks, 0.0)
        next_s = np.stack([h, s[:, 1], np.minimum(s[:, 2] + sinks, 8.0)], axis=1)
        over = self.terminal(s)
        next_s = np.where(over[:, None], s, next_s)
        return Outcome(next_s, np.where(over, 0.0, sinks)[:, None], next_s)

    def terminal(self, s):
        return s[:, 0] <= 0.0

    def format_state(self, s):
        return " ".join(repr(float(number)) for number in s)

    def parse_state(self, text):
        return np.array([float(word) for word in text.split()])
'''


@pytest.fixture(autouse=True)
def working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    Path("glider.py").write_text(GLIDER_SOURCE)


def test_the_states_are_the_points_of_the_users_grid_and_one_slice_is_drawn() -> None:
    mdp = build_finite_mdp(load_problem("./glider.py"))
    assert len(mdp.states) == 5 * 2 * 9
    assert len(mdp.drawn) == 5 * 9
    assert (mdp.states[mdp.drawn, 1] == 1.0).all()
    # A dive from (4, 1, 0) ends at (2, 1, 2), which is a grid point.
    start = mdp.find_index(mdp.states[0] * 0 + [4.0, 1.0, 0.0])
    (next_state,) = set(mdp.next_states[start, 0][mdp.probabilities[start, 0] > 0].tolist())
    assert mdp.states[next_state].tolist() == [2.0, 1.0, 2.0]


def test_watch_names_the_points_and_the_slice_of_the_users_grid(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "watch", "value-iteration", "./glider.py", "--iterations", "1")
    assert "V is interpolated between 5 x 2 x 9 grid points" in result.stdout
    assert "Drawn: wind 1." in result.stdout


def test_plot_draws_the_values_and_the_best_actions_on_the_users_grid() -> None:
    (values,), (policy,) = (
        build_plot(PlotRequest(what, "./glider.py", turns=2)).panels for what in PLOTTED_NOUNS
    )
    assert isinstance(values, GridPanel)
    assert isinstance(policy, GridPanel)
    assert (values.title, values.x.label, values.y.label) == ("wind 1", "distance", "height")
    # with two turns left from the height 2, one stay and one dive sink 0.5 + 2
    assert values.values.tolist() == [[0.0, 2.0, 2.5, 4.0, 4.0]] * 9
    actions = [[*policy.categories].index(name) for name in ("dive", "stay")]
    assert policy.values[0, [4, 2]].tolist() == actions
    assert np.isnan(policy.values[:, 0]).all()


def test_a_grid_with_too_many_maps_is_refused() -> None:
    points = "np.arange(5.0), is_interpolated=False"
    Path("windy.py").write_text(
        GLIDER_SOURCE.replace("np.array([0.0, 1.0]), is_interpolated=False, drawn=(1.0,)", points)
    )
    with pytest.raises(BadParameter, match="its state_grid has 5 maps, expected at most 4"):
        build_plot(PlotRequest("values", "./windy.py"))


@pytest.mark.parametrize(
    ("part", "wrong"),
    [
        ("np.linspace(0.0, 8.0, 9)", "np.linspace(8.0, 0.0, 9)"),
        ("np.linspace(0.0, 8.0, 9)", "[0.0, 8.0]"),
        ("x=2", "x=0"),
        ("x=2", "x=3"),
        ("ContinuousStates(3)", "ContinuousStates(2)"),
        ("state_grid = StateGrid(", "state_grid = dict(axes="),
    ],
)
def test_a_grid_that_does_not_fit_the_states_is_refused_in_one_line(part: str, wrong: str) -> None:
    Path("bad.py").write_text(GLIDER_SOURCE.replace(part, wrong))
    with pytest.raises(
        BadParameter, match="expected a StateGrid with a GridAxis for each"
    ) as error:
        load_problem("./bad.py")
    assert "\n" not in str(error.value)
