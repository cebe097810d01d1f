"""Tests of the registry of solution methods, which `solve`, agents and hints share."""

from pathlib import Path

import pytest

import dmplay
from dmplay.agents.agents_by_method import build_roster_by_method
from dmplay.cli import reports
from dmplay.evaluation.solutions.solve import (
    NAMED_SOLVERS,
    SIMULATION,
    SOLUTIONS,
    load_solution_function,
)
from dmplay.registry.builtin_names import problem_names
from dmplay.solvers.methods import FIT_TESTS, Method, find_fitting_method, list_fitting_methods

METHODS_OF_PROBLEMS = {
    "hexworld": [Method.MDP_PLANNING],
    "2048": [],  # too many states for any but a search
    "cart-pole": [],  # real numbers
    "crying-baby": [Method.ALPHA_VECTORS, Method.POINT_BASED],
    "machine-replacement": [Method.ALPHA_VECTORS, Method.POINT_BASED],
    "catch": [Method.POINT_BASED],  # four states are too many to list all vectors
    "prisoners-dilemma": [Method.EQUILIBRIUM_ENUMERATION],
    "collaborative-predator-prey": [Method.FULLY_OBSERVED_TEAM],
}


@pytest.mark.parametrize("name", METHODS_OF_PROBLEMS)
def test_class_and_size_of_a_problem_choose_its_methods(name: str) -> None:
    problem = dmplay.load_problem(name)
    assert list_fitting_methods(problem) == METHODS_OF_PROBLEMS[name]
    assert find_fitting_method(problem) == next(iter(METHODS_OF_PROBLEMS[name]), None)


def test_every_method_has_a_test_and_a_solution_that_can_be_loaded() -> None:
    assert {*FIT_TESTS} == {*SOLUTIONS} == {*Method}
    help_text = str(reports.solve.__annotations__["method"].__metadata__[0].help)
    for name, (_, function) in NAMED_SOLVERS.items():
        assert name in help_text
        assert callable(load_solution_function(function))
    for name in (*SOLUTIONS.values(), SIMULATION):
        assert callable(load_solution_function(name))


@pytest.mark.parametrize("name", problem_names())
def test_a_problem_with_a_method_has_an_agent_that_plays_it(name: str) -> None:
    problem = dmplay.load_problem(name)
    if [
        method
        for method in list_fitting_methods(problem)
        if method is not Method.FULLY_OBSERVED_TEAM
    ]:
        assert build_roster_by_method(problem, 0).agents


FOUR_DOORS_SOURCE = """
from dataclasses import dataclass
import numpy as np
from dmplay import ConstantPolicy, Labels, Roster, Tables, Tabular

@dataclass(frozen=True)
class Doors(Tabular):
    actions = (Labels(("listen", "open")),)
    observations = (Labels(("left", "right")),)
    state_names = ("a", "b", "c", "d")
    initial_belief = np.full(4, 0.25)
    discount: float = 0.9
    tables = Tables(
        np.stack([np.eye(4), np.full((4, 4), 0.25)], axis=1),
        np.array([[[-1.0], [5.0]], [[-1.0], [5.0]], [[-1.0], [-9.0]], [[-1.0], [-9.0]]]),
        np.array([[[0.8, 0.2]] * 2 + [[0.2, 0.8]] * 2, [[0.5, 0.5]] * 4]),
    )

class Listen(ConstantPolicy):
    action = 0

AGENTS = Roster({"listen": Listen}, hint_provider="listen")
"""


def test_a_hint_provider_of_a_module_does_not_hide_the_solution(tmp_path: Path) -> None:
    (tmp_path / "doors.py").write_text(FOUR_DOORS_SOURCE)
    solution = dmplay.solve(dmplay.load_problem(tmp_path / "doors.py"))
    assert solution.method == "point-based, infinite horizon"
    assert [row["first"] for row in solution.rows if row["best"]] == ["listen"]
