"""Policy gradient: make actions more probable after which more reward came than usual."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dmplay.algorithms.exploration import choose_softmax, compute_softmax
from dmplay.algorithms.learner import Learner, LearningTask, rate_actions
from dmplay.core.arrays import Reals
from dmplay.core.parameters import parameter


@dataclass(frozen=True)
class PolicyGradient(Learner):
    """Learns a softmax policy by the likelihood ratio, reward to go and a baseline.

    theta = theta + alpha grad, where grad is the mean of grad log pi(a|s) (reward to go - baseline)
    over the turns of a batch of games. The baseline is the mean reward to go of the games that
    still last; rewards to go are divided by their standard deviation.
    """

    name = "policy-gradient"
    summary = "make actions more probable after which more reward came than usual"
    source = "section 11.5, Baseline Subtraction"
    feature_kind = "numbers"

    rows: int = parameter(32, "games of a batch, after which theta changes", 2, 10_000)
    alpha: float = parameter(1.0, "length of a step", 0.0)

    def learn(self, task: LearningTask) -> Iterator[None]:
        """Play and learn without end; yield after each batch of games."""
        games, theta = task.games, task.weights
        while True:
            turns, plays = [], np.ones(self.rows, bool)
            games.restart()
            while plays.any():
                active, strengths = task.features.activate(games.states)
                preferences = rate_actions(theta, active, strengths)
                probabilities = compute_softmax(preferences, games.legal)
                u = games.generator.random(self.rows)
                a = (probabilities.cumsum(axis=1)[:, :-1] <= u[:, None]).sum(axis=1)
                turn = games.step(a)
                turns.append((active, strengths, a, probabilities, turn.rewards * plays, plays))
                plays = plays & ~turn.ended
            active, strengths, actions, probabilities, rewards, played = zip(*turns, strict=True)
            advantages = compute_advantages(
                np.array(rewards), np.array(played), task.problem.discount
            )
            score = -np.array(probabilities)  # gradient of log pi by the preferences
            np.put_along_axis(
                score, np.array(actions)[..., None],
                1.0 + np.take_along_axis(score, np.array(actions)[..., None], 2), 2,
            )
            score *= advantages[..., None]
            gradient = np.zeros_like(theta)
            if isinstance(strengths[0], float):
                indices = np.array(active)
                for k in range(indices.shape[2]):
                    np.add.at(gradient, indices[:, :, k], score)
            else:
                gradient += np.tensordot(np.array(strengths), score, ([0, 1], [0, 1]))
            theta += self.alpha * gradient / np.array(played).sum()
            yield


def compute_advantages(rewards: Reals, played: Reals, discount: float) -> Reals:
    """Return the reward to go of each turn `[T, B]` minus that of the mean game, standardized."""
    to_go = np.zeros_like(rewards)
    total = np.zeros(rewards.shape[1])
    for t in range(len(rewards) - 1, -1, -1):
        total = rewards[t] + discount * total
        to_go[t] = total
    counts = np.maximum(played.sum(axis=1, keepdims=True), 1)
    baseline = (to_go * played).sum(axis=1, keepdims=True) / counts
    advantages = (to_go - baseline) * played
    spread = np.sqrt((advantages**2).sum() / played.sum())
    return np.asarray(advantages / (spread or 1.0))
