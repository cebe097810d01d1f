"""The cross-entropy method: sample policies, and move the distribution toward the best ones."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dmplay.algorithms.exploration import choose_greedy
from dmplay.algorithms.learner import Learner, LearningTask
from dmplay.core.arrays import Reals
from dmplay.core.parameters import parameter


@dataclass(frozen=True)
class CrossEntropy(Learner):
    """Learns the weights of a greedy policy as the mean of a normal distribution.

    Each batch samples weights, plays a game with each, and fits mean and standard deviation to the
    elite; algorithm 10.4, with a constant added to the deviations.
    """

    name = "cross-entropy"
    summary = "sample policies, and move their distribution toward the best ones"
    source = "section 10.4, Cross Entropy Method"
    default_features = "numbers"

    rows: int = parameter(40, "policies of a batch", 2, 10_000)
    games: int = parameter(1, "games of each policy", 1, 1000)
    elite: int = parameter(8, "best policies, to which the distribution is fitted", 1, 10_000)
    spread: float = parameter(1.0, "standard deviation of each weight at the start", 0.0)
    noise: float = parameter(0.1, "standard deviation that is added, halved in each batch", 0.0)

    def learn(self, task: LearningTask) -> Iterator[None]:
        """Play and learn without end; yield after each batch."""
        mean = task.weights
        deviation = task.find_array("deviation", *mean.shape, value=self.spread)
        batches = task.find_array("batches", 1)
        while True:
            z = task.generator.standard_normal((self.rows, *mean.shape))
            policies = mean + deviation * z
            returns = np.mean([play(task, policies) for _ in range(self.games)], axis=0)
            elite = policies[np.argsort(-returns, kind="stable")[: self.elite]]
            batches += 1
            mean[...] = elite.mean(axis=0)
            deviation[...] = elite.std(axis=0) + self.noise * 0.5 ** batches[0]
            yield


def play(task: LearningTask, policies: Reals) -> Reals:
    """Return the return of a game with each of these weights `[B, F, A]`."""
    games, rows = task.games, np.arange(len(policies))[:, None]
    returns, factor, plays = np.zeros(len(policies)), 1.0, np.ones(len(policies), bool)
    games.restart()
    while plays.any():
        indices, strengths = task.features.activate(games.inputs)
        if strengths is None:
            q = policies[rows, indices].sum(axis=1)
        else:
            q = (strengths[:, None, :] @ policies)[:, 0]
        turn = games.step(choose_greedy(q, games.legal))
        returns += factor * turn.rewards * plays
        factor *= task.problem.discount
        plays &= ~turn.ended
    return returns


LEARNER = CrossEntropy
