import numpy as np
import pytest

import dmplay
from dmplay.core.session import Session
from dmplay.core.trigonometry import compute_sine_and_cosine
from dmplay.errors import BadParameter
from dmplay.problems.cart_pole.agents import LinearQuadraticPolicy
from dmplay.problems.cart_pole.rules import CartPole
from dmplay.solvers.mdp import riccati
from tests.truth_cases.deterministic_trajectory import iterate_game

LEFT, RIGHT = 0, 1
PROBLEM = dmplay.load_problem("cart-pole")
GYM_PROBLEM = dmplay.load_problem("cart-pole:gym")


def step_state(state: list[float], push: int) -> tuple[list[float], float]:
    outcome = PROBLEM.step(np.array([state]), np.array([[push]]), np.zeros((1, 0)))
    return outcome.state[0].tolist(), float(outcome.rewards[0, 0])


def test_a_push_from_rest_moves_the_cart_one_way_and_the_pole_the_other() -> None:
    (x, v, theta, omega), reward = step_state([0, 0, 0, 0], RIGHT)
    assert (x, theta) == (0, 0)  # positions change by the old speeds
    assert v == pytest.approx(0.02 * 400 / 41)
    assert omega == pytest.approx(-0.02 * 600 / 41)
    assert reward == 1


def test_being_at_a_limit_is_not_past_it() -> None:
    lean = 12 * np.pi / 180
    states = np.array([[2.4, 0, 0, 0], [-2.4, 0, 0, 0], [0, 0, lean, 0], [0, 0, -lean, 0]])
    assert not PROBLEM.terminal(states).any()
    assert PROBLEM.terminal(states * 1.0000001).all()


def test_the_step_that_fails_still_pays() -> None:
    next_state, reward = step_state([2.39, 1.0, 0, 0], RIGHT)
    assert next_state[0] > 2.4
    assert reward == 1


def test_a_fallen_pole_stays_down_and_pays_nothing() -> None:
    for state in ([2.5, 1.0, 0.1, 1.0], [0.0, 1.0, -0.3, -2.0]):
        assert step_state(state, LEFT) == (state, 0.0)


def test_fallen_rows_of_a_batch_stay_unchanged_while_others_move() -> None:
    s = np.array([[0.0, 0, 0, 0], [3.0, 1, 0, 0], [0, 0, 0.05, 0]])
    outcome = PROBLEM.step(s, np.array([[0], [1], [1]]), np.zeros((3, 0)))
    assert outcome.rewards[:, 0].tolist() == [1, 0, 1]
    assert outcome.state[1].tolist() == [3, 1, 0, 0]
    assert outcome.state[2].tolist() == step_state([0, 0, 0.05, 0], RIGHT)[0]


def test_the_mass_of_the_pole_is_in_tau_only_as_in_gymnasium() -> None:
    s, a = np.array([[0.0, 0.0, 0.1, 2.0]]), np.array([[RIGHT]])
    book_state, gym_state = (
        game.step(s, a, np.zeros((1, 0))).state[0] for game in (PROBLEM, GYM_PROBLEM)
    )
    assert abs(book_state[1] - gym_state[1]) == pytest.approx(0.0035, abs=5e-5)
    assert abs(book_state[3] - gym_state[3]) == pytest.approx(0.0052, abs=5e-5)
    still = np.array([[0.0, 0.0, 0.1, 0.0]])  # the term is proportional to omega squared
    book_state, gym_state = (
        game.step(still, a, np.zeros((1, 0))).state[0] for game in (PROBLEM, GYM_PROBLEM)
    )
    assert (book_state == gym_state).all()


@pytest.mark.parametrize("game", [PROBLEM, GYM_PROBLEM])
def test_balance_keeps_the_pole_up_for_500_turns_from_every_start(game: dmplay.Problem) -> None:
    balance = dmplay.load_agent(game, 0, "balance")
    result = dmplay.rollout(game, [balance], episodes=200)
    assert (result.turn_counts == 500).all()
    assert not result.terminated.any()
    # the corners of the initial box
    s = np.array(np.meshgrid(*[[-0.05, 0.05]] * 4)).reshape(4, 16).T
    for _ in range(500):
        a = balance.choose(balance.initial_memory(s), None, np.zeros((16, 0)))
        s = game.step(s, a[:, None], np.zeros((16, 0))).state
        assert not game.terminal(s).any()


@pytest.mark.slow
@pytest.mark.parametrize("game", [PROBLEM, GYM_PROBLEM])
@pytest.mark.parametrize("agent", ["balance", "regulate"])
def test_agents_keep_the_pole_up_for_10_000_turns(game: dmplay.Problem, agent: str) -> None:
    result = dmplay.rollout(
        game, [dmplay.load_agent(game, 0, agent)], episodes=200, turn_limit=10_000, seed=3
    )
    assert (result.turn_counts == 10_000).all()
    assert not result.terminated.any()


@pytest.mark.parametrize("settings", [{"length": 0.15}, {"length": 4, "mass_pole": 0.5}])
def test_the_regulator_adapts_to_poles_for_which_fixed_weights_fail(
    settings: dict[str, float],
) -> None:
    game = dmplay.load_problem("cart-pole", **settings)
    fixed, fitted = (
        dmplay.rollout(game, [dmplay.load_agent(game, 0, name)], episodes=40, turn_limit=500)
        for name in ("balance", "regulate")
    )
    assert fixed.terminated.mean() > 0.9
    assert not fitted.terminated.any()


def test_the_regulator_solves_the_riccati_equation() -> None:
    system = riccati.linearize_dynamics(PROBLEM, LEFT, RIGHT, 4)
    a, b = system
    half, total = 0.5, 1.1
    angular = 9.8 / (half * (4 / 3 - 0.1 / total))  # of theta, without a push (F.1)
    assert a[3] == pytest.approx([0, 0, 0.02 * angular, 1], rel=1e-6)
    assert b[1, 0] > 0
    assert b[3, 0] < 0
    cost, k = np.eye(4), riccati.solve_riccati(system, np.eye(4), 1.0).gain
    closed = a - b @ k[None]
    for _ in range(4000):  # the cost of following k, by its definition
        cost = np.eye(4) + np.outer(k, k) + closed.T @ cost @ closed
    assert (b.T @ cost @ a / (1.0 + b.T @ cost @ b))[0] == pytest.approx(k, rel=1e-6)


def test_regulator_gains_converge_as_the_time_step_goes_to_zero() -> None:
    regulators = [LinearQuadraticPolicy(CartPole(dt=dt), 0).regulator for dt in (1e-4, 1e-5, 1e-6)]
    assert all(regulator.riccati_residual < 1e-12 for regulator in regulators)
    gains = np.array([regulator.gain for regulator in regulators])
    assert np.diff(gains[:, 3])[1] == pytest.approx(np.diff(gains[:, 3])[0] / 10, rel=0.01)


def test_a_cost_that_grows_without_bound_yields_zero_gains() -> None:
    drifting = riccati.LinearDynamics(np.eye(4), np.zeros((4, 1)))
    result = riccati.solve_riccati(drifting, np.eye(4), 1.0)
    assert result.sweep_count == 2**50  # because MAX_COST is 1e15
    assert result.gain.tolist() == [0, 0, 0, 0]
    assert result.spectral_radius == 1


@pytest.mark.parametrize("push", [1e-6, 1e6])
def test_a_strong_cart_is_stabilised_for_every_push_cost(push: float) -> None:
    regulator = LinearQuadraticPolicy(CartPole(force=1e6), 0, push=push).regulator
    assert regulator.riccati_residual < 1e-10
    assert regulator.spectral_radius == pytest.approx(0.98665, abs=1e-5)


def test_extreme_parameters_give_finite_states_and_gains() -> None:
    lowest = {"mass_cart": 1e-6, "length": 1e-6, "dt": 1e-6}
    highest = {"gravity": 1e6, "force": 1e6, "mass_pole": 1e6, "dt": 1e6}
    for pole in (
        dmplay.load_problem("cart-pole", **lowest),
        dmplay.load_problem("cart-pole", **lowest | highest),
    ):
        assert isinstance(pole, CartPole)
        assert np.isfinite(LinearQuadraticPolicy(pole, 0).regulator.gain).all()
        outcome = pole.step(np.full((1, 4), 0.05), np.array([[RIGHT]]), np.zeros((1, 0)))
        assert np.isfinite(outcome.state).all()


def test_a_push_without_force_leaves_the_regulator_without_gains() -> None:
    still = dmplay.load_problem("cart-pole", force=0)
    regulate = dmplay.load_agent(still, 0, "regulate")
    chosen = regulate.choose(
        regulate.initial_memory(np.array([[0.0, 0, 0.1, 0]])), None, np.zeros((1, 0))
    )
    assert chosen.tolist() == [LEFT]
    with pytest.raises(BadParameter, match="push: got 0, expected a number at least 1e-06"):
        dmplay.load_agent(PROBLEM, 0, "regulate:push=0")


def test_alternate_pushes_right_and_left_by_turns() -> None:
    game = Session(
        PROBLEM, dmplay.SeededUniforms(1), [dmplay.load_agent(PROBLEM, 0, "alternate:first=right")]
    )
    assert [int(game.advance().actions[0]) for _ in range(4)] == [RIGHT, LEFT, RIGHT, LEFT]


def test_alternate_rejects_an_invalid_first_push() -> None:
    with pytest.raises(BadParameter, match="first: got 'up', expected one of left, right"):
        dmplay.load_agent(PROBLEM, 0, "alternate:first=up")


def test_a_formatted_state_is_parsed_back_bit_for_bit() -> None:
    s = PROBLEM.sample_initial_states(np.array([[0.123456789, 0.5, 0.987654321, 0.0]]))[0]
    assert (PROBLEM.parse_state(PROBLEM.format_state(s)) == s).all()
    assert PROBLEM.format_state(np.array([0.0, -0.5, 1e-17, 2.0])) == "0.0 -0.5 1e-17 2.0"


def test_the_limits_are_parameters_in_metres_and_degrees() -> None:
    wide = dmplay.load_problem("cart-pole", x_limit="4.8", theta_limit="24")
    states = np.array([[4.7, 0, 0, 0], [0, 0, 0.41, 0], [4.9, 0, 0, 0], [0, 0, 0.42, 0]])
    assert wide.terminal(states).tolist() == [False, False, True, True]


def test_the_state_after_500_turns_has_these_bits_on_every_processor() -> None:
    balance = dmplay.load_agent(PROBLEM, 0, "balance")
    *_, (final, _) = iterate_game(PROBLEM, balance, [0.01, -0.02, 0.03, 0.04], 500)
    assert (
        PROBLEM.format_state(final)
        == "-0.04700439100598123 0.36170604624184344 0.0022100259780529685 -0.353492414904413"
    )


@pytest.mark.parametrize("angle", [0.1, 0.78, 4.0, 1000.0])
def test_sine_and_cosine_match_numpy_to_the_last_bit_or_two(angle: float) -> None:
    x = np.linspace(-angle, angle, 10_001)
    sine, cosine = compute_sine_and_cosine(x)
    assert np.abs(sine - np.sin(x)).max() < 3e-16
    assert np.abs(cosine - np.cos(x)).max() < 3e-16


def test_the_sine_of_an_angle_does_not_depend_on_the_batch() -> None:
    small = np.array([-0.0, 0.1, -0.7])
    expected = np.array(compute_sine_and_cosine(small))
    batch = np.array(compute_sine_and_cosine(np.append(small, 2.0)))
    assert expected.tobytes() == batch[:, :3].tobytes()
    for row, angle in enumerate(np.append(small, 2.0)):
        assert np.array(compute_sine_and_cosine(angle)).tobytes() == batch[:, row].tobytes()


def test_regulator_values_are_the_turns_until_the_pole_falls_after_each_push() -> None:
    regulate = dmplay.load_agent(PROBLEM, 0, "regulate")
    leans = [[0, 0, np.radians(lean), rate] for lean, rate in ((0, 0), (11, 0.2), (8, 1.2))]
    starts = np.array([*leans, [3.0, 0, 0, 0]])
    values = regulate.action_values(regulate.initial_memory(starts))
    assert values is not None
    assert values.tolist() == [[50, 50], [3, 50], [3, 5], [0, 0]]
