"""The `gym` variants against Gymnasium itself, step for step."""

from typing import Any

import gymnasium
import numpy as np
import pytest

import dmplay
from dmplay.core import Problem
from dmplay.dice import generate_uniforms

NO_DRAWS = np.zeros((1, 0))
TOLERANCE = 1e-13  # the last bits of sin and cos differ between the two


def bare(name: str) -> Any:
    """Gymnasium's environment without its wrappers."""
    environment = gymnasium.make(name).unwrapped
    environment.reset(seed=0)
    return environment


def peer_step(environment: Any, s: np.ndarray, a: int) -> tuple[np.ndarray, float, bool]:
    """Gymnasium's step from the state `s`, in its own float64."""
    environment.state = tuple(s)
    environment.steps_beyond_terminated = None
    _, reward, over, _, _ = environment.step(a)
    return np.array(environment.state, float), float(reward), over


def assert_same_step(problem: Problem, environment: Any, s: np.ndarray, a: int) -> np.ndarray:
    told, reward, over = peer_step(environment, s, a)
    after = problem.step(s[None], np.array([[a]]), NO_DRAWS)
    np.testing.assert_allclose(after.state[0], told, rtol=TOLERANCE, atol=TOLERANCE)
    assert after.rewards[0, 0] == reward
    assert problem.terminal(after.state)[0] == over
    return told


def scattered(problem: Problem, low: list[float], high: list[float], rows: int) -> np.ndarray:
    """States all over a box that are not terminal."""
    s = np.array(low) + (np.array(high) - low) * generate_uniforms(
        3, 0, 0, rows=rows, count=len(low)
    )
    return np.asarray(s[~problem.terminal(s)])


BOXES = {
    "cart-pole": ("CartPole-v1", [-2.5, -3.0, -0.22, -3.0], [2.5, 3.0, 0.22, 3.0]),
    "mountain-car": ("MountainCar-v0", [-1.2, -0.07], [0.6, 0.07]),
}


@pytest.mark.parametrize("name", BOXES)
def test_a_step_from_anywhere_is_gymnasiums(name: str) -> None:
    peer, low, high = BOXES[name]
    problem, environment = dmplay.load_problem(f"{name}:gym"), bare(peer)
    labels = problem.actions[0].labels
    states = scattered(problem, low, high, 300)
    assert len(states) > 240
    for row, s in enumerate(states):
        assert_same_step(problem, environment, s, row % len(labels))


@pytest.mark.parametrize("name", BOXES)
def test_whole_games_are_gymnasiums(name: str) -> None:
    problem, environment = dmplay.load_problem(f"{name}:gym"), bare(BOXES[name][0])
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
    assert max(lengths) < 500  # every game came to its end in both


@pytest.mark.parametrize("name", BOXES)
def test_the_horizon_and_the_actions_are_gymnasiums(name: str) -> None:
    problem = dmplay.load_problem(f"{name}:gym")
    environment: Any = gymnasium.make(BOXES[name][0])
    assert problem.horizon == environment.spec.max_episode_steps
    labels = problem.actions[0].labels
    assert len(labels) == environment.action_space.n


def test_the_cart_starts_where_gymnasiums_does() -> None:
    problem = dmplay.load_problem("cart-pole:gym")
    edges = np.array([[0.0] * 4, [0.999999999] * 4])
    np.testing.assert_allclose(
        problem.sample_initial_states(edges), [[-0.05] * 4, [0.05] * 4], atol=1e-9
    )


def test_the_car_starts_where_gymnasiums_does() -> None:
    problem = dmplay.load_problem("mountain-car:gym")
    edges = np.array([[0.0] * 2, [0.999999999] * 2])
    np.testing.assert_allclose(
        problem.sample_initial_states(edges), [[-0.6, 0.0], [-0.4, 0.0]], atol=1e-9
    )


def test_the_limit_of_the_pole_is_gymnasiums_to_the_last_bit() -> None:
    problem, environment = dmplay.load_problem("cart-pole:gym"), bare("CartPole-v1")
    edge = environment.theta_threshold_radians
    states = np.array([[0, 0, edge, 0], [0, 0, np.nextafter(edge, 1), 0]])
    assert problem.terminal(states).tolist() == [False, True]
