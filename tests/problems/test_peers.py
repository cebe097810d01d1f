"""Tests of the `gym` variants against Gymnasium, step by step."""

from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="needs the extra gymnasium")

import gymnasium

import dmplay
from dmplay.core.problem import Problem
from dmplay.core.uniforms import generate_uniforms

pytestmark = pytest.mark.extra("gymnasium")

NO_UNIFORMS = np.zeros((1, 0))
TOLERANCE = 1e-13  # the last bits of sin and cos differ between the two


def make_environment(name: str) -> Any:
    """Return an environment of Gymnasium without its wrappers."""
    environment = gymnasium.make(name).unwrapped
    environment.reset(seed=0)
    return environment


def step_environment(environment: Any, s: np.ndarray, a: int) -> tuple[np.ndarray, float, bool]:
    """Step the environment from the state `s`, in its own float64."""
    environment.state = tuple(s)
    environment.steps_beyond_terminated = None
    _, reward, terminated, _, _ = environment.step(a)
    return np.array(environment.state, float), float(reward), terminated


def assert_same_step(problem: Problem, environment: Any, s: np.ndarray, a: int) -> np.ndarray:
    expected, reward, terminated = step_environment(environment, s, a)
    outcome = problem.step(s[None], np.array([[a]]), NO_UNIFORMS)
    np.testing.assert_allclose(outcome.state[0], expected, rtol=TOLERANCE, atol=TOLERANCE)
    assert outcome.rewards[0, 0] == reward
    assert problem.terminal(outcome.state)[0] == terminated
    return expected


def sample_states(problem: Problem, low: list[float], high: list[float], rows: int) -> np.ndarray:
    """Return nonterminal states from all over a box."""
    s = np.array(low) + (np.array(high) - low) * generate_uniforms(
        3, 0, 0, rows=rows, count=len(low)
    )
    return np.asarray(s[~problem.terminal(s)])


STATE_BOXES = {
    "cart-pole": ("CartPole-v1", [-2.5, -3.0, -0.22, -3.0], [2.5, 3.0, 0.22, 3.0]),
    "mountain-car": ("MountainCar-v0", [-1.2, -0.07], [0.6, 0.07]),
}


@pytest.mark.parametrize("name", STATE_BOXES)
def test_steps_from_random_states_match_gymnasium(name: str) -> None:
    environment_name, low, high = STATE_BOXES[name]
    problem, environment = dmplay.load_problem(f"{name}:gym"), make_environment(environment_name)
    labels = problem.actions[0].labels
    states = sample_states(problem, low, high, 300)
    assert len(states) > 240
    for row, s in enumerate(states):
        assert_same_step(problem, environment, s, row % len(labels))


@pytest.mark.parametrize("name", STATE_BOXES)
def test_whole_games_match_gymnasium(name: str) -> None:
    problem = dmplay.load_problem(f"{name}:gym")
    environment = make_environment(STATE_BOXES[name][0])
    policy = dmplay.load_agent(problem, 0, "random" if name == "cart-pole" else "pump")
    lengths = []
    for game in range(5):
        s = problem.sample_initial_states(
            generate_uniforms(game, 0, 0, rows=1, count=problem.uniform_counts.start)
        )[0]
        for turn in range(1, 501):
            u = generate_uniforms(game, 1, turn, rows=1, count=policy.uniform_count)
            a = int(policy.choose(policy.initial_memory(s[None]), None, u)[0])
            s = assert_same_step(problem, environment, s, a)
            if problem.terminal(s[None])[0]:
                break
        lengths.append(turn)
    assert max(lengths) < 500  # every game ended in both


@pytest.mark.parametrize("name", STATE_BOXES)
def test_the_horizon_and_the_actions_match_gymnasium(name: str) -> None:
    problem = dmplay.load_problem(f"{name}:gym")
    environment: Any = gymnasium.make(STATE_BOXES[name][0])
    assert problem.horizon == environment.spec.max_episode_steps
    labels = problem.actions[0].labels
    assert len(labels) == environment.action_space.n


def test_the_start_range_of_the_cart_matches_gymnasium() -> None:
    problem = dmplay.load_problem("cart-pole:gym")
    edges = np.array([[0.0] * 4, [0.999999999] * 4])
    np.testing.assert_allclose(
        problem.sample_initial_states(edges), [[-0.05] * 4, [0.05] * 4], atol=1e-9
    )


def test_the_start_range_of_the_car_matches_gymnasium() -> None:
    problem = dmplay.load_problem("mountain-car:gym")
    edges = np.array([[0.0] * 2, [0.999999999] * 2])
    np.testing.assert_allclose(
        problem.sample_initial_states(edges), [[-0.6, 0.0], [-0.4, 0.0]], atol=1e-9
    )


def test_the_angle_limit_of_the_pole_matches_gymnasium_bit_for_bit() -> None:
    problem, environment = dmplay.load_problem("cart-pole:gym"), make_environment("CartPole-v1")
    edge = environment.theta_threshold_radians
    states = np.array([[0, 0, edge, 0], [0, 0, np.nextafter(edge, 1), 0]])
    assert problem.terminal(states).tolist() == [False, True]
