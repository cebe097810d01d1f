from functools import cache
from itertools import product

import numpy as np
import pytest

import dmplay
from dmplay.chance import Reals
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.solvers import alpha_vectors, value_iteration
from dmplay.solvers.envelope import compute_upper_envelope
from dmplay.tabular import Tables, tabulate


@cache
def tables(name: str) -> Tables:
    return tabulate(dmplay.load_problem(name))


def tiny(seed: int) -> Tables:
    """A random POMDP of two to four states, two actions and two observations."""
    random = np.random.default_rng(seed)
    states = int(random.integers(2, 5))
    observation = random.dirichlet(np.ones(2), (2, states))
    if seed % 3 == 0:
        observation = np.round(observation)  # some observations become impossible
    return Tables(
        random.dirichlet(np.ones(states), (states, 2)),
        np.round(random.normal(size=(states, 2, 1)), 1),
        observation,
    )


def plans(model: Tables, discount: float, horizon: int) -> list[tuple[int, Reals]]:
    """The first action and the value of every conditional plan."""
    observation = model.observation
    assert observation is not None
    kinds = observation.shape[2]
    if horizon == 0:
        return [(0, np.zeros(len(model.transition)))]
    after = [vector for _, vector in plans(model, discount, horizon - 1)]
    return [
        (
            a,
            model.rewards[:, a, 0]
            + discount
            * sum(model.transition[:, a] @ (observation[a, :, o] * then[o]) for o in range(kinds)),
        )
        for a in range(model.transition.shape[1])
        for then in product(after, repeat=kinds)
    ]


@pytest.mark.parametrize("seed", range(12))
def test_values_are_those_of_the_best_of_all_plans(seed: int) -> None:
    model, discount = tiny(seed), (0.9, 1.0)[seed % 2]
    every = plans(model, discount, 3)  # 2 * 8^2 of them: 128 plans of three turns
    stage = alpha_vectors.solve_finite_horizon(model, discount, 3)[-1]
    b = np.random.default_rng(seed).dirichlet(np.ones(len(model.transition)), 300)
    q = alpha_vectors.compute_action_values(stage, b)
    for a in range(2):
        vectors = np.array([vector for action, vector in every if action == a])
        np.testing.assert_allclose(q[:, a], (b @ vectors.T).max(axis=1), atol=1e-10)
    np.testing.assert_allclose(
        alpha_vectors.compute_belief_values(stage.alpha_vectors, b), q.max(axis=1), atol=1e-10
    )
    assert stage.first_action_mask.any(axis=1).all()


@pytest.mark.parametrize("seed", range(8))
def test_the_unending_game_is_worth_what_many_turns_are(seed: int) -> None:
    model, discount = tiny(seed), 0.1
    many = alpha_vectors.solve_finite_horizon(model, discount, 10)[-1]  # 0.1^10 is 1e-10
    stage = alpha_vectors.solve_infinite_horizon(model, discount)
    b = np.random.default_rng(seed).dirichlet(np.ones(len(model.transition)), 300)
    got, wanted = (alpha_vectors.compute_action_values(one, b) for one in (stage, many))
    np.testing.assert_allclose(got, wanted, atol=1e-9)


def test_where_the_state_is_seen_a_pomdp_is_worth_its_mdp() -> None:
    random = np.random.default_rng(5)
    transition = random.dirichlet(np.ones(3), (3, 2))
    rewards = random.normal(size=(3, 2, 1))
    model = Tables(transition, rewards, np.repeat(np.eye(3)[None], 2, axis=0))
    stage = alpha_vectors.solve_infinite_horizon(model, 0.9)
    q = value_iteration.compute_optimal_q(Tables(transition, rewards, None), 0.9)
    np.testing.assert_allclose(alpha_vectors.compute_action_values(stage, np.eye(3)), q, atol=1e-9)


def test_actions_that_are_the_same_share_their_vectors() -> None:
    baby = tables("crying-baby")
    assert baby.observation is not None
    transition, rewards = (np.concatenate([x, x], axis=1) for x in baby[:2])
    twice = Tables(transition, rewards, np.tile(baby.observation, (2, 1, 1)))
    stage = alpha_vectors.solve_finite_horizon(twice, 0.9, 5)[-1]
    assert (stage.first_action_mask[:, :3] == stage.first_action_mask[:, 3:]).all()
    assert len(stage.alpha_vectors) == len(
        alpha_vectors.solve_finite_horizon(baby, 0.9, 5)[-1].alpha_vectors
    )


def test_plans_lead_to_the_plans_that_give_their_value() -> None:
    machine = tables("machine-replacement")
    assert machine.observation is not None
    before, last = alpha_vectors.solve_finite_horizon(machine, 1.0, 14)[-2:]
    for a, one in enumerate(last.plans_by_action):
        for vector, then in zip(one.alpha_vectors, one.next_plans, strict=True):
            follow = (machine.observation[a] * before.alpha_vectors[then].T).sum(axis=1)
            wanted = machine.rewards[:, a, 0] + machine.transition[:, a] @ follow
            np.testing.assert_allclose(vector, wanted, atol=1e-12)


def test_the_machine_needs_these_many_vectors() -> None:
    counts = [
        len(one.alpha_vectors)
        for one in alpha_vectors.solve_finite_horizon(tables("machine-replacement"), 1, 20)
    ]
    assert counts == [1, 1, 1, 1, 1, 2, 3, 4, 4, 5, 6, 8, 10, 15, 13, 14, 9, 12, 10, 13]


def test_an_unending_machine_is_solved_too() -> None:
    machine = tables("machine-replacement")
    stage = alpha_vectors.solve_infinite_horizon(machine, 0.7)
    again = alpha_vectors.backup_vectors(machine, 0.7, stage.alpha_vectors)
    b = compute_upper_envelope(stage.alpha_vectors).corner_beliefs
    np.testing.assert_allclose(
        alpha_vectors.compute_belief_values(stage.alpha_vectors, b),
        alpha_vectors.compute_belief_values(again.alpha_vectors, b),
        atol=1e-9,
    )


def test_singing_pays_in_a_finite_game_without_discount() -> None:
    stage = alpha_vectors.solve_finite_horizon(tables("crying-baby"), 1.0, 4)[-1]
    feed, sing, ignore = stage.first_action_mask.T
    cells = compute_upper_envelope(stage.alpha_vectors)
    sung = cells.corner_beliefs[cells.touching_vectors[:, sing].any(axis=1), 1]
    np.testing.assert_allclose([sung.min(), sung.max()], [0.1902, 0.2425], atol=5e-5)
    assert feed.sum() == ignore.sum() == 1


def test_the_unending_baby_is_ignored_up_to_a_belief_and_then_fed() -> None:
    stage = alpha_vectors.solve_infinite_horizon(tables("crying-baby"), 0.9)
    wanted = [[-960550 / 48821, -1448760 / 48821], [-796050 / 48821, -1867460 / 48821]]
    np.testing.assert_allclose(stage.alpha_vectors, wanted, atol=1e-9)
    assert stage.first_action_mask.tolist() == [[True, False, False], [False, False, True]]


@pytest.mark.parametrize(
    ("limit", "most"), [("MAX_CONTROLLER_NODES", 30), ("MAX_POLICY_ITERATIONS", 7)]
)
def test_an_optimum_without_a_finite_controller_is_told_with_its_gap(
    limit: str, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(alpha_vectors, limit, most)
    baby = dmplay.load_problem("crying-baby", becomes_hungry=0.0)
    stage = alpha_vectors.solve_infinite_horizon(tabulate(baby), baby.discount)
    sated = float(stage.alpha_vectors[:, 0].max())
    assert sated == pytest.approx(0.0, abs=1e-9)  # who never gets hungry is left alone
    assert 0 < stage.gap < 0.05
    hungry = alpha_vectors.compute_belief_values(stage.alpha_vectors, np.array([[0.0, 1.0]]))[0]
    assert -15.0 - stage.gap <= hungry <= -15.0 + 1e-9  # fed once


def test_stages_without_number_are_refused_before_the_first() -> None:
    with pytest.raises(BudgetExceeded, match="alpha vectors: more than"):
        alpha_vectors.solve_finite_horizon(tables("crying-baby"), 1.0, 10**9)


def test_a_problem_whose_state_is_seen_is_refused() -> None:
    with pytest.raises(BadParameter, match="one with observations"):
        alpha_vectors.solve_finite_horizon(tables("hexworld"), 0.9, 1)
