"""Learners make the updates of the book, as hand arithmetic and another implementation say."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay.agents.learned_policy import build_features, describe_features
from dmplay.algorithms import policy_gradient
from dmplay.algorithms.exploration import choose_epsilon_greedy, choose_softmax
from dmplay.algorithms.features import Activation, add_to_weights, rate_actions
from dmplay.algorithms.learner import Learner, LearningTask
from dmplay.algorithms.maximum_likelihood import MaximumLikelihood
from dmplay.algorithms.q_learning import QLearning
from dmplay.algorithms.registry import load_learners
from dmplay.algorithms.sarsa import Sarsa
from dmplay.algorithms.sarsa_lambda import SarsaLambda
from dmplay.algorithms.tile_coding import TileFeatures
from dmplay.core.arrays import Reals
from dmplay.core.problem import Problem
from dmplay.core.uniforms import make_numpy_generator
from dmplay.simulation.learning_games import LearningGames
from tests.support.random_problems import RandomProblem

ALPHA, GAMMA, LAMBDA = 0.25, 0.9, 0.8
UPDATES = 400


@dataclass
class RecordedTurn:
    """A turn of one game, as plain numbers."""

    s: int
    a: int
    r: float
    s_next: int
    terminated: bool
    ended: bool


def learn(learner: Learner, problem: Problem, seed: int) -> tuple[LearningTask, list[RecordedTurn]]:
    """Return a task after some updates with one game at a time, and the turns of that game."""
    games = LearningGames(problem, learner.rows, make_numpy_generator(seed))
    features = build_features(problem, describe_features(problem))
    task = LearningTask(problem, games, features)
    turns, step = list[RecordedTurn](), games.step

    def record_step(actions: Any) -> Any:
        s = games.inputs[0]
        turn = step(actions)
        turns.append(
            RecordedTurn(
                int(s), int(actions[0]), float(turn.rewards[0]), int(turn.next_inputs[0]),
                bool(turn.terminated[0]), bool(turn.ended[0]),
            )
        )  # fmt: skip
        return turn

    games.step = record_step  # type: ignore[method-assign]
    updates = learner.learn(task)
    for _ in range(UPDATES):
        next(updates)
    return task, turns


def list_legal(problem: RandomProblem, s: int) -> list[int]:
    return [a for a in range(3) if problem.legal_mask[s, 0, a]]


@pytest.mark.parametrize("seed", range(10))
def test_q_learning_equals_plain_python_on_a_random_mdp(seed: int) -> None:
    problem = RandomProblem(seed=seed)
    task, turns = learn(QLearning(rows=1, alpha=ALPHA, alpha_decay=1.0), problem, seed)
    q = {(s, a): 0.0 for s in range(5) for a in range(3)}
    for turn in turns:
        best = max(q[turn.s_next, a] for a in list_legal(problem, turn.s_next))
        target = turn.r + (0.0 if turn.terminated else GAMMA * best)
        q[turn.s, turn.a] += ALPHA * (target - q[turn.s, turn.a])
    expected = [[q[s, a] for a in range(3)] for s in range(5)]
    np.testing.assert_allclose(task.weights, expected, atol=1e-12)
    assert len({turn.s for turn in turns}) > 1


@pytest.mark.parametrize("seed", range(10))
def test_sarsa_equals_plain_python_on_a_random_mdp(seed: int) -> None:
    problem = RandomProblem(seed=seed)
    task, turns = learn(Sarsa(rows=1, alpha=ALPHA, alpha_decay=1.0), problem, seed)
    q = np.zeros((5, 3))
    for turn, following in pairwise(turns):
        after = 0.0 if turn.terminated else GAMMA * q[following.s, following.a]
        q[turn.s, turn.a] += ALPHA * (turn.r + after - q[turn.s, turn.a])
    is_last = np.zeros((5, 3), bool)
    is_last[turns[-1].s, turns[-1].a] = True  # its next action is not recorded
    np.testing.assert_allclose(task.weights[~is_last], q[~is_last], atol=1e-12)


@pytest.mark.parametrize("traces", ["accumulating", "replacing"])
@pytest.mark.parametrize("seed", range(10))
def test_sarsa_lambda_equals_plain_python_on_a_random_mdp(seed: int, traces: str) -> None:
    problem = RandomProblem(seed=seed)
    learner = SarsaLambda(rows=1, alpha=ALPHA, alpha_decay=1.0, lambda_=LAMBDA, traces=traces)
    task, turns = learn(learner, problem, seed)
    q, trace = np.zeros((5, 3)), np.zeros((5, 3))
    while not turns[-1].terminated:  # so that all next actions are recorded
        turns.pop()
    for turn, following in zip(turns, [*turns[1:], turns[0]], strict=True):
        after = 0.0 if turn.terminated else GAMMA * q[following.s, following.a]
        delta = turn.r + after - q[turn.s, turn.a]
        if traces == "replacing":
            trace[turn.s] = 0.0
        trace[turn.s, turn.a] += 1.0
        q, trace = q + ALPHA * delta * trace, trace * GAMMA * LAMBDA
        trace = np.zeros((5, 3)) if turn.ended else trace
    repeated, games = learn_until(learner, problem, seed, len(turns))
    np.testing.assert_allclose(repeated, q, atol=1e-12)
    assert games == len([turn for turn in turns if turn.ended])
    assert not np.array_equal(repeated, task.weights) or len(turns) == UPDATES


def learn_until(learner: Learner, problem: Problem, seed: int, updates: int) -> tuple[Reals, int]:
    games = LearningGames(problem, learner.rows, make_numpy_generator(seed))
    features = build_features(problem, describe_features(problem))
    task = LearningTask(problem, games, features)
    iterator = learner.learn(task)
    for _ in range(updates):
        next(iterator)
    return task.weights, games.episode_count


@pytest.mark.parametrize("update", ["full", "dyna"])
@pytest.mark.parametrize("seed", range(10))
def test_maximum_likelihood_values_solve_the_counted_model(seed: int, update: str) -> None:
    problem = RandomProblem(seed=seed)
    learner = MaximumLikelihood(update=update, random_updates=40)
    task, turns = learn(learner, problem, seed)
    visits, rewards, next_counts = np.zeros((5, 3)), np.zeros((5, 3)), np.zeros((5, 3, 5))
    for turn in turns:
        visits[turn.s, turn.a] += 1
        rewards[turn.s, turn.a] += turn.r
        next_counts[turn.s, turn.a, turn.s_next] += not turn.terminated
    q = np.zeros((5, 3))
    for _ in range(500):
        u = np.where(problem.legal_mask[:, 0], q, -np.inf).max(axis=1)
        q = (rewards + GAMMA * next_counts @ u) / np.maximum(visits, 1)
    tolerance = 1e-4 if update == "full" else 0.05  # Dyna has not yet backed up all states
    np.testing.assert_allclose(task.weights, q, atol=tolerance)


def test_an_update_of_q_equals_hand_arithmetic() -> None:
    weights = np.array([[3.10, 0.0], [6.1, 2.0]])
    x, x_next = Activation(np.array([[0]])), Activation(np.array([[1]]))
    target = 0.0 + 0.9 * rate_actions(weights, x_next).max()
    add_to_weights(weights, x, np.array([0]), np.array([0.1 * (target - weights[0, 0])]))
    assert weights[0, 0] == pytest.approx(3.10 + 0.1 * (0.9 * 6.1 - 3.10))


def test_rows_that_share_a_weight_change_it_by_their_mean() -> None:
    weights = np.zeros((2, 2))
    x = Activation(np.array([[0], [0], [1]]))
    add_to_weights(weights, x, np.array([1, 1, 0]), np.array([1.0, 3.0, 5.0]))
    assert weights.tolist() == [[0.0, 2.0], [5.0, 0.0]]


def test_many_weights_change_like_few_weights() -> None:
    x = Activation(np.array([[0, 3], [0, 2], [1, 3]]))
    small, large = np.zeros((5, 2)), np.zeros((500, 2))
    for weights in (small, large):
        add_to_weights(weights, x, np.array([1, 1, 0]), np.array([1.0, 3.0, 5.0]))
    np.testing.assert_allclose(large[:5], small)
    assert small[0].tolist() == [0.0, 1.0]


def test_a_change_of_tiles_changes_the_value_by_exactly_that_much() -> None:
    features = TileFeatures(np.zeros(2), np.ones(2), tilings=4, tiles=5)
    weights = np.zeros((features.count, 3))
    x = features.activate(np.array([[0.3, 0.7]]))
    add_to_weights(weights, x, np.array([2]), np.array([1.5]))
    assert rate_actions(weights, x)[0].tolist() == pytest.approx([0.0, 0.0, 1.5])
    near, far = np.array([[0.4, 0.7]]), np.array([[0.9, 0.1]])
    assert 0.0 < rate_actions(weights, features.activate(near))[0, 2] < 1.5
    assert rate_actions(weights, features.activate(far))[0, 2] == 0.0


def test_a_state_has_one_tile_of_each_tiling_up_to_the_bounds() -> None:
    features = TileFeatures(np.array([-1.0, 0.0]), np.array([1.0, 4.0]), tilings=8, tiles=3)
    s = np.array([[-1.0, 0.0], [1.0, 4.0], [-9.0, 99.0], [0.1, 2.0]])
    indices = features.activate(s).indices
    assert (indices // 16 == np.arange(8)).all()
    assert indices.max() < features.count


def test_the_gradient_of_one_turn_equals_hand_arithmetic() -> None:
    rewards = np.array([[1.0, 0.0], [2.0, 4.0]])
    advantages = policy_gradient.compute_advantages(rewards, np.ones((2, 2), bool), 0.5)
    # rewards to go: 1 + 0.5 x 2 = 2 and 0.5 x 4 = 2, then 2 and 4; the baselines are 2 and 3
    assert advantages.tolist() == [[0.0, 0.0], pytest.approx([-(2**0.5), 2**0.5])]


def test_epsilon_greedy_explores_the_given_share_of_legal_actions() -> None:
    q, legal = np.tile([1.0, 2.0, 3.0], (20_000, 1)), np.tile([True, True, False], (20_000, 1))
    u = make_numpy_generator(1).random((20_000, 2))
    actions = choose_epsilon_greedy(q, legal, 0.4, u)
    shares = np.bincount(actions, minlength=3) / len(q)
    np.testing.assert_allclose(shares, [0.2, 0.8, 0.0], atol=0.01)


def test_softmax_chooses_in_proportion_to_exponentials() -> None:
    q = np.tile(np.log([1.0, 4.0]), (20_000, 1))
    actions = choose_softmax(q, None, 0.5, make_numpy_generator(2).random(20_000))
    assert actions.mean() == pytest.approx(2 / 3, abs=0.01)  # exp(0.5 ln 4) = 2


def iterate_small_learners() -> Iterator[tuple[str, Learner]]:
    for name, learner in load_learners().items():
        fits = not learner().explain_misfit(dmplay.load_problem("hexworld"))
        if fits and learner.data_use != "required":
            yield name, learner()


@pytest.mark.parametrize(("name", "learner"), [*iterate_small_learners()])
def test_the_same_seed_gives_the_same_bits(name: str, learner: Learner) -> None:
    problem = dmplay.load_problem("hexworld")
    first, second, other = (
        learn_until(learner, problem, seed, 5)[0].tobytes() for seed in (3, 3, 4)
    )
    assert first == second, name
    assert first != other, name


def test_afterstates_learn_the_reward_and_the_next_afterstate() -> None:
    """A chain of one action: afterstates 0, 1 and 2 are followed by rewards 5, 7 and the end."""
    learner = load_learners()["afterstates"](rows=1, coherent=False, alpha=0.5)  # type: ignore[call-arg]
    problem = SimpleNamespace(discount=0.9, action_counts=(1,))
    position = [0]

    class Chain:
        """The features of a chain of states."""

        count = 3

        def activate(self, s: Any) -> Activation:
            return Activation(
                np.full((1, 1, 1), position[0]), np.array([[[2.0, 5.0, 7.0][position[0]]]])
            )

    def step(actions: Any) -> Any:
        position[0] = (position[0] + 1) % 3
        is_over = np.array([position[0] == 0])
        return SimpleNamespace(terminated=is_over, ended=is_over)

    games = SimpleNamespace(inputs=None, legal=None, step=step, generator=None)
    task = LearningTask(problem, games, Chain())  # type: ignore[arg-type]
    updates = learner.learn(task)
    for _ in range(3):
        next(updates)
    assert task.arrays["weights"].tolist() == [0.5 * 5.0, 0.5 * 7.0, 0.0]
    for _ in range(3):
        next(updates)
    assert task.arrays["weights"][0] == 2.5 + 0.5 * (5.0 + 0.9 * 3.5 - 2.5)
