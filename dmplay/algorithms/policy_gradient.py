"""Policy gradient: make actions more probable after which more reward came than usual."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmplay.algorithms.exploration import compute_softmax, sample_actions
from dmplay.algorithms.features import rate_actions
from dmplay.algorithms.learner import Learner, LearningTask
from dmplay.core.arrays import Array, Bools, Reals
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
    default_features = "numbers"

    rows: int = parameter(16, "games of a batch, after which theta changes", 2, 10_000)
    alpha: float = parameter(4.0, "length of a step", 0.0)

    def learn(self, task: LearningTask) -> Iterator[None]:
        """Play and learn without end; yield after each batch of games."""
        games, theta = task.games, task.weights
        rows = np.arange(self.rows)
        while True:
            turns, plays = list[tuple[Any, ...]](), np.ones(self.rows, bool)
            games.restart()
            while plays.any():
                x = task.features.activate(games.inputs)
                probabilities = compute_softmax(rate_actions(theta, x), games.legal)
                a = sample_actions(probabilities, games.generator.random(self.rows))
                turn = games.step(a)
                score = -probabilities  # the gradient of log pi(a|s) by the preferences
                score[rows, a] += 1.0
                turns.append((x.indices, x.strengths, score, turn.rewards * plays, plays))
                plays = plays & ~turn.ended
            indices, strengths, scores, rewards, played = map(stack, zip(*turns, strict=True))
            advantages = compute_advantages(rewards, played, task.problem.discount)
            score = scores * advantages[..., None]
            gradient = np.zeros_like(theta)
            if strengths is None:
                for k in range(indices.shape[2]):
                    np.add.at(gradient, indices[:, :, k], score)
            else:
                gradient += np.tensordot(strengths, score, ([0, 1], [0, 1]))
            theta += self.alpha * gradient / played.sum()
            yield


def stack(arrays: Sequence[Array | None]) -> Any:
    """Return the arrays of all turns as one; None if they are None."""
    return None if arrays[0] is None else np.array(arrays)


def compute_advantages(rewards: Reals, played: Bools, discount: float) -> Reals:
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


LEARNER = PolicyGradient
