import numpy as np
import pytest

import dmplay
from dmplay.errors import BadParameter
from dmplay.policies.cart_pole import LinearQuadraticPolicy
from dmplay.problems._trigonometry import compute_sine_and_cosine
from dmplay.problems.cart_pole import CartPole
from dmplay.session import Session
from dmplay.solvers import riccati
from tests.truth_kinds.course import course

LEFT, RIGHT = 0, 1
PROBLEM = dmplay.load_problem("cart-pole")
GYM = dmplay.load_problem("cart-pole:gym")


def stepped(state: list[float], push: int) -> tuple[list[float], float]:
    after = PROBLEM.step(np.array([state]), np.array([[push]]), np.zeros((1, 0)))
    return after.state[0].tolist(), float(after.rewards[0, 0])


def test_a_push_from_rest_moves_the_cart_one_way_and_the_pole_the_other() -> None:
    (x, v, theta, omega), reward = stepped([0, 0, 0, 0], RIGHT)
    assert (x, theta) == (0, 0)  # old speeds
    assert v == pytest.approx(0.02 * 400 / 41)
    assert omega == pytest.approx(-0.02 * 600 / 41)
    assert reward == 1


def test_being_at_a_limit_is_not_past_it() -> None:
    lean = 12 * np.pi / 180
    states = np.array([[2.4, 0, 0, 0], [-2.4, 0, 0, 0], [0, 0, lean, 0], [0, 0, -lean, 0]])
    assert not PROBLEM.terminal(states).any()
    assert PROBLEM.terminal(states * 1.0000001).all()


def test_the_step_that_fails_still_pays() -> None:
    after, reward = stepped([2.39, 1.0, 0, 0], RIGHT)
    assert after[0] > 2.4
    assert reward == 1


def test_a_fallen_pole_lies_and_pays_nothing() -> None:
    for state in ([2.5, 1.0, 0.1, 1.0], [0.0, 1.0, -0.3, -2.0]):
        assert stepped(state, LEFT) == (state, 0.0)


def test_a_batch_keeps_its_fallen_rows_beside_its_standing_ones() -> None:
    s = np.array([[0.0, 0, 0, 0], [3.0, 1, 0, 0], [0, 0, 0.05, 0]])
    after = PROBLEM.step(s, np.array([[0], [1], [1]]), np.zeros((3, 0)))
    assert after.rewards[:, 0].tolist() == [1, 0, 1]
    assert after.state[1].tolist() == [3, 1, 0, 0]
    assert after.state[2].tolist() == stepped([0, 0, 0.05, 0], RIGHT)[0]


def test_the_mass_of_the_pole_is_in_tau_only_where_gymnasium_has_it() -> None:
    s, a = np.array([[0.0, 0.0, 0.1, 2.0]]), np.array([[RIGHT]])
    text, gym = (game.step(s, a, np.zeros((1, 0))).state[0] for game in (PROBLEM, GYM))
    assert abs(text[1] - gym[1]) == pytest.approx(0.0035, abs=5e-5)
    assert abs(text[3] - gym[3]) == pytest.approx(0.0052, abs=5e-5)
    still = np.array([[0.0, 0.0, 0.1, 0.0]])  # the term is of omega squared
    text, gym = (game.step(still, a, np.zeros((1, 0))).state[0] for game in (PROBLEM, GYM))
    assert (text == gym).all()


@pytest.mark.parametrize("game", [PROBLEM, GYM])
def test_balance_stands_500_turns_from_every_usual_start(game: dmplay.Problem) -> None:
    balance = dmplay.load_agent(game, 0, "balance")
    played = dmplay.rollout(game, [balance], episodes=200)
    assert (played.turn_counts == 500).all()
    assert not played.terminated.any()
    s = np.array(np.meshgrid(*[[-0.05, 0.05]] * 4)).reshape(4, 16).T  # the corners
    for _ in range(500):
        a = balance.choose(balance.initial_memory(s), None, np.zeros((16, 0)))
        s = game.step(s, a[:, None], np.zeros((16, 0))).state
        assert not game.terminal(s).any()


@pytest.mark.slow
@pytest.mark.parametrize("game", [PROBLEM, GYM])
@pytest.mark.parametrize("agent", ["balance", "regulate"])
def test_the_pole_stands_10_000_turns_from_every_usual_start(
    game: dmplay.Problem, agent: str
) -> None:
    played = dmplay.rollout(
        game, [dmplay.load_agent(game, 0, agent)], episodes=200, turn_limit=10_000, seed=3
    )
    assert (played.turn_counts == 10_000).all()
    assert not played.terminated.any()


@pytest.mark.parametrize("changed", [{"length": 0.15}, {"length": 4, "mass_pole": 0.5}])
def test_the_regulator_fits_its_pole_where_fixed_weights_do_not(changed: dict[str, float]) -> None:
    game = dmplay.load_problem("cart-pole", **changed)
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
    angular = 9.8 / (half * (4 / 3 - 0.1 / total))  # of theta, with no push (F.1)
    assert a[3] == pytest.approx([0, 0, 0.02 * angular, 1], rel=1e-6)
    assert b[1, 0] > 0
    assert b[3, 0] < 0
    cost, k = np.eye(4), riccati.solve_riccati(system, np.eye(4), 1.0).gain
    closed = a - b @ k[None]
    for _ in range(4000):  # the cost of following k, by its definition
        cost = np.eye(4) + np.outer(k, k) + closed.T @ cost @ closed
    assert (b.T @ cost @ a / (1.0 + b.T @ cost @ b))[0] == pytest.approx(k, rel=1e-6)


def test_a_regulator_of_the_shortest_turns_weighs_as_one_without_turns_would() -> None:
    told = [LinearQuadraticPolicy(CartPole(dt=dt), 0).regulator for dt in (1e-4, 1e-5, 1e-6)]
    assert all(found.riccati_residual < 1e-12 for found in told)
    gains = np.array([found.gain for found in told])
    assert np.diff(gains[:, 3])[1] == pytest.approx(np.diff(gains[:, 3])[0] / 10, rel=0.01)


def test_a_cost_that_grows_by_the_same_each_turn_is_given_up_without_weights() -> None:
    drifting = riccati.LinearDynamics(np.eye(4), np.zeros((4, 1)))
    found = riccati.solve_riccati(drifting, np.eye(4), 1.0)
    assert found.sweep_count == 2**50  # as HOPELESS is 1e15
    assert found.gain.tolist() == [0, 0, 0, 0]
    assert found.spectral_radius == 1


@pytest.mark.parametrize("push", [1e-6, 1e6])
def test_a_strong_cart_is_held_whatever_a_push_costs(push: float) -> None:
    found = LinearQuadraticPolicy(CartPole(force=1e6), 0, push=push).regulator
    assert found.riccati_residual < 1e-10
    assert found.spectral_radius == pytest.approx(0.98665, abs=1e-5)


def test_a_pole_at_the_bounds_of_its_parameters_moves_by_numbers() -> None:
    least = {"mass_cart": 1e-6, "length": 1e-6, "dt": 1e-6}
    most = {"gravity": 1e6, "force": 1e6, "mass_pole": 1e6, "dt": 1e6}
    for pole in (
        dmplay.load_problem("cart-pole", **least),
        dmplay.load_problem("cart-pole", **least | most),
    ):
        assert isinstance(pole, CartPole)
        assert np.isfinite(LinearQuadraticPolicy(pole, 0).regulator.gain).all()
        pushed = pole.step(np.full((1, 4), 0.05), np.array([[RIGHT]]), np.zeros((1, 0)))
        assert np.isfinite(pushed.state).all()


def test_a_push_that_moves_nothing_leaves_the_regulator_without_weights() -> None:
    still = dmplay.load_problem("cart-pole", force=0)
    regulate = dmplay.load_agent(still, 0, "regulate")
    chosen = regulate.choose(
        regulate.initial_memory(np.array([[0.0, 0, 0.1, 0]])), None, np.zeros((1, 0))
    )
    assert chosen.tolist() == [LEFT]
    with pytest.raises(BadParameter, match="push: got 0, expected a number at least 1e-06"):
        dmplay.load_agent(PROBLEM, 0, "regulate:push=0")


def test_alternate_takes_turns() -> None:
    game = Session(
        PROBLEM, dmplay.SeededUniforms(1), [dmplay.load_agent(PROBLEM, 0, "alternate:first=right")]
    )
    assert [int(game.advance().actions[0]) for _ in range(4)] == [RIGHT, LEFT, RIGHT, LEFT]


def test_alternate_refuses_a_first_push_that_is_none() -> None:
    with pytest.raises(BadParameter, match="first: got 'up', expected one of left, right"):
        dmplay.load_agent(PROBLEM, 0, "alternate:first=up")


def test_a_state_is_read_back_to_the_last_bit() -> None:
    s = PROBLEM.sample_initial_states(np.array([[0.123456789, 0.5, 0.987654321, 0.0]]))[0]
    assert (PROBLEM.parse_state(PROBLEM.format_state(s)) == s).all()
    assert PROBLEM.format_state(np.array([0.0, -0.5, 1e-17, 2.0])) == "0.0 -0.5 1e-17 2.0"


def test_the_limits_are_parameters_in_metres_and_degrees() -> None:
    wide = dmplay.load_problem("cart-pole", x_limit="4.8", theta_limit="24")
    states = np.array([[4.7, 0, 0, 0], [0, 0, 0.41, 0], [4.9, 0, 0, 0], [0, 0, 0.42, 0]])
    assert wide.terminal(states).tolist() == [False, False, True, True]


def test_every_processor_gives_these_bits_after_500_turns() -> None:
    balance = dmplay.load_agent(PROBLEM, 0, "balance")
    *_, (final, _) = course(PROBLEM, balance, [0.01, -0.02, 0.03, 0.04], 500)
    assert (
        PROBLEM.format_state(final)
        == "-0.04700439100598123 0.36170604624184344 0.0022100259780529685 -0.353492414904413"
    )


@pytest.mark.parametrize("angle", [0.1, 0.78, 4.0, 1000.0])
def test_sine_and_cosine_are_the_librarys_to_the_last_bit_or_two(angle: float) -> None:
    x = np.linspace(-angle, angle, 10_001)
    sine, cosine = compute_sine_and_cosine(x)
    assert np.abs(sine - np.sin(x)).max() < 3e-16
    assert np.abs(cosine - np.cos(x)).max() < 3e-16


def test_an_angle_has_the_same_sine_beside_any_other() -> None:
    small = np.array([-0.0, 0.1, -0.7])
    alone = np.array(compute_sine_and_cosine(small))
    beside = np.array(compute_sine_and_cosine(np.append(small, 2.0)))
    assert alone.tobytes() == beside[:, :3].tobytes()
    for row, angle in enumerate([*small.tolist(), 2.0]):
        assert np.array(compute_sine_and_cosine(angle)).tobytes() == beside[:, row].tobytes()


def test_the_regulator_knows_for_how_long_a_pole_stands_after_each_push() -> None:
    regulate = dmplay.load_agent(PROBLEM, 0, "regulate")
    leans = [[0, 0, np.radians(lean), rate] for lean, rate in ((0, 0), (11, 0.2), (8, 1.2))]
    starts = np.array([*leans, [3.0, 0, 0, 0]])
    values = regulate.action_values(regulate.initial_memory(starts))
    assert values is not None
    assert values.tolist() == [[50, 50], [3, 50], [3, 5], [0, 0]]
