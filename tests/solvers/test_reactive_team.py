"""Rules of a team that forgets, weighed by the solver for any joint policy."""

import numpy as np
import pytest

import dmplay
from dmplay.chance import Reals
from dmplay.errors import BadParameter
from dmplay.problems.collaborative_predator_prey import CollaborativePredatorPrey
from dmplay.solvers import reactive_team, sparse

NAME = "collaborative-predator-prey"


def load(name: str, **settings: object) -> CollaborativePredatorPrey:
    problem = dmplay.load_problem(name, **settings)
    assert isinstance(problem, CollaborativePredatorPrey)
    return problem


def worth(problem: CollaborativePredatorPrey, model: sparse.SparseMdp, rules: Reals) -> float:
    """The mean over all states of what both earn who act by what they would sense there."""
    sensed = problem.observe(problem.enumerate_states())
    first, second = (rules[seat][sensed[:, seat]] for seat in (0, 1))
    joint = (first[:, :, None] * second[:, None]).reshape(len(first), -1)
    return float(sparse.evaluate_policy(model, problem.discount, joint).mean())


@pytest.mark.parametrize(
    ("variant", "least"),
    [("triangle", 41.27), pytest.param("circle", 7.87, marks=pytest.mark.slow)],
)
def test_no_small_change_of_a_rule_pays(variant: str, least: float) -> None:
    problem = load(f"{NAME}:{variant}")
    model, found = sparse.build_sparse_mdp(problem), reactive_team.optimize_reactive_team(problem)
    assert found.mean_value == pytest.approx(worth(problem, model, found.policies))
    assert found.mean_value > least
    for seat in (0, 1):
        for sense in (0, 1):
            for move in np.eye(6):
                rules = found.policies.copy()
                rules[seat, sense] = 0.98 * rules[seat, sense] + 0.02 * move
                assert worth(problem, model, rules) < found.mean_value + 2e-3


@pytest.mark.slow
def test_on_the_standard_map_it_beats_every_rule_that_does_not_mix() -> None:
    problem = load(NAME)
    found = reactive_team.optimize_reactive_team(problem)
    model = sparse.build_sparse_mdp(problem)
    assert found.mean_value == pytest.approx(worth(problem, model, found.policies))
    # Of 1296 pairs of rules without chance, east by the prey and west else, and the reverse.
    sure = np.eye(6)[[[0, 3], [3, 0]]]
    uniform = np.full((2, 2, 6), 1 / 6)
    assert worth(problem, model, uniform) == pytest.approx(-1.7358, abs=1e-4)
    assert found.mean_value > -0.6 > worth(problem, model, sure)


def test_rules_are_never_worse_than_those_it_begins_with() -> None:
    triangle = dmplay.load_problem("collaborative-predator-prey:triangle", slip=0.0)
    assert isinstance(triangle, CollaborativePredatorPrey)
    hunt = reactive_team._PredatorPreyArrays(triangle)
    found = reactive_team.optimize_reactive_team(triangle).mean_value
    assert found >= hunt.evaluate_policies(reactive_team._make_initial_policies()) - 1e-9
    assert found > 40


@pytest.mark.parametrize(
    "settings", [{"predators": 3}, {"discount": 1.0}, {"hexes": [[q, 0] for q in range(18)]}]
)
def test_other_hunts_are_refused(settings: dict[str, object]) -> None:
    with pytest.raises(BadParameter):
        reactive_team.optimize_reactive_team(load(NAME, **settings))
