"""Tests of memoryless stochastic policies of a team, evaluated as joint policies."""

import numpy as np
import pytest

import dmplay
from dmplay.core.arrays import Reals
from dmplay.errors import BadParameter
from dmplay.problems.collaborative_predator_prey import reactive_team as reactive_predator_team
from dmplay.problems.collaborative_predator_prey.rules import CollaborativePredatorPrey
from dmplay.solvers.mdp import sparse_mdp

PROBLEM_NAME = "collaborative-predator-prey"


def load_problem(name: str, **settings: object) -> CollaborativePredatorPrey:
    problem = dmplay.load_problem(name, **settings)
    assert isinstance(problem, CollaborativePredatorPrey)
    return problem


def evaluate_rules(
    problem: CollaborativePredatorPrey, model: sparse_mdp.SparseMdp, rules: Reals
) -> float:
    """Return the mean value over all states of two agents that act by their current observation."""
    observations = problem.get_observations(problem.enumerate_states())
    first, second = (rules[seat][observations[:, seat]] for seat in (0, 1))
    joint = (first[:, :, None] * second[:, None]).reshape(len(first), -1)
    return float(sparse_mdp.evaluate_policy(model, problem.discount, joint).mean())


@pytest.mark.parametrize(
    ("variant", "min_value"),
    [("triangle", 41.27), pytest.param("circle", 7.87, marks=pytest.mark.slow)],
)
def test_no_small_change_of_a_rule_improves_the_value(variant: str, min_value: float) -> None:
    problem = load_problem(f"{PROBLEM_NAME}:{variant}")
    model = sparse_mdp.build_sparse_mdp(problem)
    team = reactive_predator_team.optimize_reactive_team(problem)
    assert team.mean_value == pytest.approx(evaluate_rules(problem, model, team.policies))
    assert team.mean_value > min_value
    for seat in (0, 1):
        for sense in (0, 1):
            for action in np.eye(6):
                rules = team.policies.copy()
                rules[seat, sense] = 0.98 * rules[seat, sense] + 0.02 * action
                assert evaluate_rules(problem, model, rules) < team.mean_value + 2e-3


@pytest.mark.slow
def test_the_team_on_the_standard_map_beats_every_deterministic_rule() -> None:
    problem = load_problem(PROBLEM_NAME)
    team = reactive_predator_team.optimize_reactive_team(problem)
    model = sparse_mdp.build_sparse_mdp(problem)
    assert team.mean_value == pytest.approx(evaluate_rules(problem, model, team.policies))
    # The best of the 1296 deterministic pairs: one agent goes east next to the prey and west
    # otherwise, the other agent does the reverse.
    deterministic_rules = np.eye(6)[[[0, 3], [3, 0]]]
    uniform = np.full((2, 2, 6), 1 / 6)
    assert evaluate_rules(problem, model, uniform) == pytest.approx(-1.7358, abs=1e-4)
    assert team.mean_value > -0.6 > evaluate_rules(problem, model, deterministic_rules)


def test_rules_are_never_worse_than_the_initial_ones() -> None:
    triangle = dmplay.load_problem("collaborative-predator-prey:triangle", slip=0.0)
    assert isinstance(triangle, CollaborativePredatorPrey)
    hunt = reactive_predator_team._PredatorPreyArrays(triangle)
    value = reactive_predator_team.optimize_reactive_team(triangle).mean_value
    assert value >= hunt.evaluate_policies(reactive_predator_team._make_initial_policies()) - 1e-9
    assert value > 40


@pytest.mark.parametrize(
    "settings", [{"predators": 3}, {"discount": 1.0}, {"hexes": [[q, 0] for q in range(18)]}]
)
def test_unsupported_variants_are_rejected(settings: dict[str, object]) -> None:
    with pytest.raises(BadParameter):
        reactive_predator_team.optimize_reactive_team(load_problem(PROBLEM_NAME, **settings))
