"""The fast informed bound, computed a second time by the sum of the book."""

from itertools import product

import numpy as np
import pytest

import dmplay
from dmplay.core.arrays import Reals
from dmplay.core.problem import Problem
from dmplay.core.tabular import Tables, tabulate
from dmplay.errors import BadPolicy
from dmplay.solvers.mdp import mdp_values
from dmplay.solvers.pomdp import exact_pomdp, fast_informed_bound
from tests.support.literature_pomdps import make_random_problem, make_tiger

PROBLEMS: dict[str, Problem] = {
    "crying-baby": dmplay.load_problem("crying-baby"),
    "quiet baby": dmplay.load_problem("crying-baby", cries_hungry=0.3),
    "machine-replacement": dmplay.load_problem("machine-replacement", discount=0.9),
    "catch": dmplay.load_problem("catch"),
    "tiger": make_tiger(),
    "random 1": make_random_problem(1, 0.9),
    "random 2": make_random_problem(2, 0.7),
}
every_problem = pytest.mark.parametrize("name", PROBLEMS)


def back_up(tables: Tables, discount: float, q: Reals) -> Reals:
    """Return one sweep of the bound `[S, A]`, term by term as in the book."""
    states = range(len(q))
    actions = range(q.shape[1])
    observations = range(tables.observation_model.shape[2])
    result = tables.rewards[:, :, 0].copy()
    for s, a, o in product(states, actions, observations):
        result[s, a] += discount * max(
            sum(
                tables.observation_model[a, t, o] * tables.transition[s, a, t] * q[t, b]
                for t in states
            )
            for b in actions
        )
    return result


@every_problem
def test_the_bound_is_the_fixed_point_of_the_sum_in_the_book(name: str) -> None:
    problem = PROBLEMS[name]
    bound = fast_informed_bound.compute_fast_informed_bound(problem)
    assert back_up(tabulate(problem), problem.discount, bound) == pytest.approx(bound, rel=1e-7)


@every_problem
def test_bounds_of_a_few_turns_are_sweeps_from_the_rewards(name: str) -> None:
    problem = PROBLEMS[name]
    tables = tabulate(problem)
    expected = tables.rewards[:, :, 0]
    for bound in fast_informed_bound.compute_finite_horizon_bounds(problem, 4):
        assert bound == pytest.approx(expected)
        expected = back_up(tables, problem.discount, expected)


@every_problem
def test_qmdp_is_above_the_bound_and_the_bound_is_above_the_optimum(name: str) -> None:
    problem = PROBLEMS[name]
    state_count = problem.state_count
    assert isinstance(state_count, int)
    beliefs = np.vstack(
        [np.eye(state_count), np.random.default_rng(1).dirichlet(np.ones(state_count), 50)]
    )
    tables = tabulate(problem)
    qmdp = beliefs @ mdp_values.compute_optimal_q(tables, problem.discount)
    fib = beliefs @ fast_informed_bound.compute_fast_informed_bound(problem)
    assert (qmdp >= fib - 1e-7).all()
    horizon = 3 if name == "catch" else 20
    for turns, bound in enumerate(
        fast_informed_bound.compute_finite_horizon_bounds(problem, horizon), 1
    ):
        stage = exact_pomdp.solve_finite_horizon(tables, problem.discount, turns)[-1]
        optimum = exact_pomdp.compute_action_values(stage, beliefs)
        assert (beliefs @ bound >= optimum - 1e-9).all()
    if name != "catch":
        stage = exact_pomdp.solve_infinite_horizon(tables, problem.discount)
        optimum = exact_pomdp.compute_action_values(stage, beliefs)
        assert (fib >= optimum - stage.gap - 1e-6).all()


def test_the_bound_of_the_baby_lies_strictly_between() -> None:
    problem = dmplay.load_problem("crying-baby")
    belief = np.array([[0.5, 0.5]])
    qmdp, fib, optimum = (
        dmplay.load_agent(problem, 0, name).action_values((belief,)).max()  # type: ignore[union-attr]
        for name in ("qmdp", "fib", "optimal")
    )
    assert qmdp > fib + 0.1 > optimum + 0.1


def test_the_agent_needs_a_discount_or_a_horizon() -> None:
    problem = dmplay.load_problem("crying-baby", discount=1.0)
    agent = dmplay.load_agent(problem, 0, "fib")
    with pytest.raises(BadPolicy, match="needs a discount below 1"):
        agent.action_values((np.array([[0.5, 0.5]]),))
    machine = dmplay.load_problem("machine-replacement")
    policy = dmplay.load_agent(machine, 0, "fib:horizon=2")
    tables = tabulate(machine)
    belief = np.array([0.2, 0.5, 0.3])
    q = back_up(tables, 1.0, tables.rewards[:, :, 0])
    memory = policy.initial_memory(np.array([-1]))
    memory = (belief[None], *memory[1:])
    assert policy.action_values(memory)[0] == pytest.approx(belief @ q)  # type: ignore[index]
