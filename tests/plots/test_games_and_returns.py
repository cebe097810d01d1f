"""Tests of plots of payoffs, recorded games and the returns of many games."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dmplay.draw.panels import GridPanel, LinePanel, TablePanel
from dmplay.errors import BadParameter
from dmplay.evaluation.many_games import run
from dmplay.game.launch_requests import ReplayRequest
from dmplay.game.playback import review
from dmplay.output.evaluation_request import EvaluationRequest
from dmplay.plots.payoffs import find_pure_cell, plot_payoffs
from dmplay.plots.played_games import plot_belief_path, plot_regret
from dmplay.plots.plotted_problem import load_plotted_problem
from dmplay.plots.returns import choose_bin_edges, plot_returns
from dmplay.registry.agents import load_agent
from dmplay.registry.problems import load_problem
from dmplay.solvers.games.bimatrix_game import MixedProfile
from tests.support.document_examples import PROJECT_ROOT
from tests.support.games import record_game
from tests.support.programs import run_dmplay

BABY_GAME = PROJECT_ROOT / "transcripts" / "crying_baby" / "starve_then_feed.dmt"


def test_a_stag_hunt_file_marks_both_pure_equilibria_and_lists_the_mixed_one(
    tmp_path: Path,
) -> None:
    path = tmp_path / "stag.nfg"
    path.write_text(
        'NFG 1 R "Stag hunt" { "ann" "bob" } { { "stag" "hare" } { "stag" "hare" } }\n\n'
        "4 4 3 0 0 3 3 3\n"
    )
    plot = plot_payoffs(load_plotted_problem(str(path)))
    (panel,) = plot.panels
    assert isinstance(panel, TablePanel)
    assert panel.cells == [["4, 4", "0, 3"], ["3, 0", "3, 3"]]
    assert panel.marked == {(0, 0), (1, 1)}
    assert plot.notes[2] == "Nash equilibrium: ann: stag 0.75 hare 0.25; bob: stag 0.75 hare 0.25"


def test_a_large_game_is_a_heat_map_with_its_equilibrium_marked() -> None:
    plot = plot_payoffs(load_plotted_problem("travelers-dilemma"))
    first, second = plot.panels
    assert isinstance(first, GridPanel)
    assert isinstance(second, GridPanel)
    assert first.values.shape == (99, 99)
    assert first.values[48, 28] == 28.0  # claims 50 and 30: the lower claim less 2
    assert second.values[48, 28] == 32.0
    assert first.marks == [(2.0, 2.0)]
    assert (first.x.low, first.x.high) == (2.0, 100.0)


def test_the_extreme_equilibria_of_equal_actions_are_not_all_equilibria(tmp_path: Path) -> None:
    path = tmp_path / "equal.nfg"
    path.write_text('NFG 1 R "Equal actions" { "ann" "bob" } { 2 2 }\n\n1 1 1 1 1 1 1 1\n')
    plot = plot_payoffs(load_plotted_problem(str(path)))
    assert len(plot.notes) == 5
    assert "infinitely many equilibria" in plot.notes[-1]


def test_an_equilibrium_in_mixed_strategies_has_no_cell() -> None:
    even = np.array([0.5, 0.5])
    assert find_pure_cell(MixedProfile(even, even)) is None
    assert find_pure_cell(MixedProfile(np.array([0.0, 1.0]), np.array([1.0, 0.0]))) == (1, 0)


def test_payoffs_need_two_agents_and_one_round() -> None:
    with pytest.raises(BadParameter, match="payoffs does not fit hexworld: expected two agents"):
        plot_payoffs(load_plotted_problem("hexworld"))
    with pytest.raises(BadParameter, match="--turns: has no effect on payoffs"):
        plot_payoffs(load_plotted_problem("prisoners-dilemma", (), 3))


def test_the_belief_path_is_that_of_the_transcript() -> None:
    plot = plot_belief_path(ReplayRequest(BABY_GAME))
    (panel,) = plot.panels
    assert isinstance(panel, LinePanel)
    recorded = [
        [float(number) for number in line.partition("[")[2].rstrip("]}").split(",")]
        for line in BABY_GAME.read_text(encoding="utf-8").splitlines()
        if line.startswith("belief: ")
    ]
    sated, hungry, truth = panel.series
    assert np.stack([sated.y, hungry.y], axis=1) == pytest.approx(np.array(recorded), abs=1e-6)
    assert [sated.label, hungry.label, truth.label] == ["P(sated)", "P(hungry)", "true state"]
    assert truth.y[:2].tolist() == hungry.y[:2].tolist()  # the baby begins hungry


def test_a_team_has_a_belief_of_each_agent_with_its_assumption(tmp_path: Path) -> None:
    path = tmp_path / "team.dmt"
    record_game(path, "multicaregiver-crying-baby", "random", turns=3)
    plot = plot_belief_path(ReplayRequest(path))
    assert [panel.title for panel in plot.panels] == [
        "belief of caregiver1", "belief of caregiver2",
    ]  # fmt: skip
    assert any("uniformly random" in note for note in plot.notes)


def test_a_belief_needs_hidden_states(tmp_path: Path) -> None:
    record_game(tmp_path / "walk.dmt", "hexworld", "random", turns=3)
    with pytest.raises(BadParameter, match="belief: the agents see the state in hexworld"):
        plot_belief_path(ReplayRequest(tmp_path / "walk.dmt"))


def test_the_bars_of_regret_are_those_of_the_review(tmp_path: Path) -> None:
    keys = "feed\nignore\nsing\nfeed\n"
    run_dmplay(tmp_path, "crying-baby", "--seed", "3", "--turns", "4", "-o", "g.dmt", stdin=keys)
    plot = plot_regret(ReplayRequest(tmp_path / "g.dmt"))
    (panel,) = plot.panels
    assert isinstance(panel, LinePanel)
    reviewed = review(tmp_path / "g.dmt")
    expected = [0.9 ** (action.turn - 1) * (action.regret or 0.0) for action in reviewed]
    assert len(expected) == 4
    assert panel.series[0].y.tolist() == pytest.approx(expected)
    assert panel.series[0].x.tolist() == [1, 2, 3, 4]
    assert plot.notes[1] == "the values in turn 1 are about: 4 turns left"


def test_the_regret_of_agents_is_drawn_if_no_person_plays() -> None:
    plot = plot_regret(ReplayRequest(BABY_GAME))
    assert plot.notes[0] == "total regret 14.48 in 6 choices"


def ignore_progress(number: int, count: int) -> Callable[[float], None]:
    return lambda share: None


def test_a_histogram_holds_the_returns_of_the_same_run() -> None:
    request = EvaluationRequest("catch", agent="optimal", seed=5)
    plot = plot_returns(request, ["random"], 200, ignore_progress)
    problem = load_problem("catch")
    for panel, name in zip(plot.panels, ("optimal", "random"), strict=True):
        assert isinstance(panel, LinePanel)
        (bars,) = panel.series
        assert bars.y.sum() == pytest.approx(1.0)
        returns = run(problem, [load_agent(problem, 0, name)], episodes=200, seed=5).rollout.returns
        half = (bars.x[1] - bars.x[0]) / 2
        first = (returns[:, 0] < bars.x[0] + half).mean()
        assert bars.y[0] == pytest.approx(first)
        assert panel.title.startswith(f"{name}: mean {returns.mean():.5g} ±")
    assert plot.title == "catch: returns of 200 games"


def test_the_other_players_are_named() -> None:
    request = EvaluationRequest("prisoners-dilemma", agent="grim", other_agent="tit-for-tat")
    plot = plot_returns(request, [], 10, ignore_progress)
    assert "other players: agent2 tit-for-tat" in plot.notes


@pytest.mark.parametrize("exponent", [0, -30, 30])
def test_a_few_evenly_spaced_returns_have_a_bar_each(exponent: int) -> None:
    returns = np.array([-1.0, 0.0, 0.0, 1.0]) * 2.0**exponent
    assert (choose_bin_edges(returns) / 2.0**exponent).tolist() == [-1.5, -0.5, 0.5, 1.5]


def test_equal_returns_have_one_bar_and_many_returns_equal_widths() -> None:
    assert choose_bin_edges(np.array([3.0, 3.0])).tolist() == [2.5, 3.5]
    edges = choose_bin_edges(np.linspace(0.0, 1.0, 1000) ** 2)
    assert (edges[0], edges[-1]) == (0.0, 1.0)
