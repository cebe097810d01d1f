from functools import cache
from itertools import product

import numpy as np
import pytest

import dmplay
from dmplay.core.arrays import Reals
from dmplay.core.tabular import Tables, tabulate
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.solvers.mdp import mdp_values
from dmplay.solvers.pomdp import exact_pomdp
from dmplay.solvers.pomdp.upper_envelope import compute_upper_envelope


@cache
def tabulate_problem(name: str) -> Tables:
    return tabulate(dmplay.load_problem(name))


def make_random_pomdp(seed: int) -> Tables:
    """A random POMDP of two to four states, two actions and two observations."""
    rng = np.random.default_rng(seed)
    states = int(rng.integers(2, 5))
    observation = rng.dirichlet(np.ones(2), (2, states))
    if seed % 3 == 0:
        observation = np.round(observation)  # some observations become impossible
    return Tables(
        rng.dirichlet(np.ones(states), (states, 2)),
        np.round(rng.normal(size=(states, 2, 1)), 1),
        observation,
    )


def enumerate_plans(model: Tables, discount: float, horizon: int) -> list[tuple[int, Reals]]:
    """Return the first action and the value vector of every conditional plan."""
    observation = model.observation
    assert observation is not None
    observation_count = observation.shape[2]
    if horizon == 0:
        return [(0, np.zeros(len(model.transition)))]
    next_vectors = [vector for _, vector in enumerate_plans(model, discount, horizon - 1)]
    return [
        (
            a,
            model.rewards[:, a, 0]
            + discount
            * sum(
                model.transition[:, a] @ (observation[a, :, o] * assigned[o])
                for o in range(observation_count)
            ),
        )
        for a in range(model.transition.shape[1])
        for assigned in product(next_vectors, repeat=observation_count)
    ]


@pytest.mark.parametrize("seed", range(12))
def test_values_equal_those_of_the_best_plan(seed: int) -> None:
    model, discount = make_random_pomdp(seed), (0.9, 1.0)[seed % 2]
    all_plans = enumerate_plans(model, discount, 3)  # 2 * 8^2 = 128 plans of three turns
    stage = exact_pomdp.solve_finite_horizon(model, discount, 3)[-1]
    b = np.random.default_rng(seed).dirichlet(np.ones(len(model.transition)), 300)
    q = exact_pomdp.compute_action_values(stage, b)
    for a in range(2):
        vectors = np.array([vector for action, vector in all_plans if action == a])
        np.testing.assert_allclose(q[:, a], (b @ vectors.T).max(axis=1), atol=1e-10)
    np.testing.assert_allclose(
        exact_pomdp.compute_belief_values(stage.alpha_vectors, b), q.max(axis=1), atol=1e-10
    )
    assert stage.first_action_mask.any(axis=1).all()


@pytest.mark.parametrize("seed", range(8))
def test_infinite_horizon_values_match_a_long_finite_horizon(seed: int) -> None:
    model, discount = make_random_pomdp(seed), 0.1
    long_stage = exact_pomdp.solve_finite_horizon(model, discount, 10)[-1]  # 0.1^10 is 1e-10
    stage = exact_pomdp.solve_infinite_horizon(model, discount)
    b = np.random.default_rng(seed).dirichlet(np.ones(len(model.transition)), 300)
    actual, expected = (
        exact_pomdp.compute_action_values(current, b) for current in (stage, long_stage)
    )
    np.testing.assert_allclose(actual, expected, atol=1e-9)


def test_a_fully_observed_pomdp_has_the_values_of_its_mdp() -> None:
    rng = np.random.default_rng(5)
    transition = rng.dirichlet(np.ones(3), (3, 2))
    rewards = rng.normal(size=(3, 2, 1))
    model = Tables(transition, rewards, np.repeat(np.eye(3)[None], 2, axis=0))
    stage = exact_pomdp.solve_infinite_horizon(model, 0.9)
    q = mdp_values.compute_optimal_q(Tables(transition, rewards, None), 0.9)
    np.testing.assert_allclose(exact_pomdp.compute_action_values(stage, np.eye(3)), q, atol=1e-9)


def test_identical_actions_share_their_alpha_vectors() -> None:
    baby = tabulate_problem("crying-baby")
    assert baby.observation is not None
    transition, rewards = (np.concatenate([x, x], axis=1) for x in baby[:2])
    doubled = Tables(transition, rewards, np.tile(baby.observation, (2, 1, 1)))
    stage = exact_pomdp.solve_finite_horizon(doubled, 0.9, 5)[-1]
    assert (stage.first_action_mask[:, :3] == stage.first_action_mask[:, 3:]).all()
    assert len(stage.alpha_vectors) == len(
        exact_pomdp.solve_finite_horizon(baby, 0.9, 5)[-1].alpha_vectors
    )


def test_alpha_vectors_equal_the_backup_of_their_successor_plans() -> None:
    machine = tabulate_problem("machine-replacement")
    assert machine.observation is not None
    previous_stage, last_stage = exact_pomdp.solve_finite_horizon(machine, 1.0, 14)[-2:]
    for a, action_plans in enumerate(last_stage.plans_by_action):
        for vector, next_plans in zip(
            action_plans.alpha_vectors, action_plans.next_plans, strict=True
        ):
            next_values = (machine.observation[a] * previous_stage.alpha_vectors[next_plans].T).sum(
                axis=1
            )
            expected = machine.rewards[:, a, 0] + machine.transition[:, a] @ next_values
            np.testing.assert_allclose(vector, expected, atol=1e-12)


def test_machine_replacement_vector_counts_by_horizon() -> None:
    counts = [
        len(stage.alpha_vectors)
        for stage in exact_pomdp.solve_finite_horizon(
            tabulate_problem("machine-replacement"), 1, 20
        )
    ]
    assert counts == [1, 1, 1, 1, 1, 2, 3, 4, 4, 5, 6, 8, 10, 15, 13, 14, 9, 12, 10, 13]


def test_infinite_horizon_machine_replacement_satisfies_the_bellman_equation() -> None:
    machine = tabulate_problem("machine-replacement")
    stage = exact_pomdp.solve_infinite_horizon(machine, 0.7)
    next_stage = exact_pomdp.backup_vectors(machine, 0.7, stage.alpha_vectors)
    b = compute_upper_envelope(stage.alpha_vectors).corner_beliefs
    np.testing.assert_allclose(
        exact_pomdp.compute_belief_values(stage.alpha_vectors, b),
        exact_pomdp.compute_belief_values(next_stage.alpha_vectors, b),
        atol=1e-9,
    )


def test_singing_is_optimal_in_an_undiscounted_finite_game() -> None:
    stage = exact_pomdp.solve_finite_horizon(tabulate_problem("crying-baby"), 1.0, 4)[-1]
    feed, sing, ignore = stage.first_action_mask.T
    cells = compute_upper_envelope(stage.alpha_vectors)
    singing_beliefs = cells.corner_beliefs[cells.touching_vectors[:, sing].any(axis=1), 1]
    np.testing.assert_allclose(
        [singing_beliefs.min(), singing_beliefs.max()], [0.1902, 0.2425], atol=5e-5
    )
    assert feed.sum() == ignore.sum() == 1


def test_the_discounted_optimum_ignores_below_a_belief_and_feeds_above_it() -> None:
    stage = exact_pomdp.solve_infinite_horizon(tabulate_problem("crying-baby"), 0.9)
    expected = [[-960550 / 48821, -1448760 / 48821], [-796050 / 48821, -1867460 / 48821]]
    np.testing.assert_allclose(stage.alpha_vectors, expected, atol=1e-9)
    assert stage.first_action_mask.tolist() == [[True, False, False], [False, False, True]]


@pytest.mark.parametrize(
    ("constant", "value"), [("MAX_CONTROLLER_NODES", 30), ("MAX_POLICY_ITERATIONS", 7)]
)
def test_an_optimum_without_a_finite_controller_reports_its_gap(
    constant: str, value: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exact_pomdp, constant, value)
    baby = dmplay.load_problem("crying-baby", becomes_hungry=0.0)
    stage = exact_pomdp.solve_infinite_horizon(tabulate(baby), baby.discount)
    sated = float(stage.alpha_vectors[:, 0].max())
    assert sated == pytest.approx(0.0, abs=1e-9)  # a baby that never gets hungry can be ignored
    assert 0 < stage.gap < 0.05
    hungry = exact_pomdp.compute_belief_values(stage.alpha_vectors, np.array([[0.0, 1.0]]))[0]
    assert -15.0 - stage.gap <= hungry <= -15.0 + 1e-9  # fed once


def test_too_many_stages_raise_an_error_before_the_first() -> None:
    with pytest.raises(BudgetExceeded, match="alpha vectors: more than"):
        exact_pomdp.solve_finite_horizon(tabulate_problem("crying-baby"), 1.0, 10**9)


def test_a_fully_observable_problem_is_rejected() -> None:
    with pytest.raises(BadParameter, match="one with observations"):
        exact_pomdp.solve_finite_horizon(tabulate_problem("hexworld"), 0.9, 1)
