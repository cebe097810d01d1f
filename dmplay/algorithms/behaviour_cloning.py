"""Behaviour cloning: imitate recorded choices by a softmax policy of maximum likelihood."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dmplay.algorithms.exploration import compute_softmax
from dmplay.algorithms.features import rate_actions
from dmplay.algorithms.learner import Learner, LearningTask
from dmplay.core.parameters import parameter


@dataclass(frozen=True)
class BehaviourCloning(Learner):
    """Learns the actions of an expert from its turns, whatever their rewards.

    theta = theta + alpha grad, where grad is the mean of grad log pi(a|s) over a batch of recorded
    turns.
    """

    name = "behaviour-cloning"
    summary = "imitate the choices that an agent or a person made in recorded turns"
    source = "section 18.1, Behavioral Cloning"
    data_use = "required"

    rows: int = parameter(64, "recorded turns of a batch", 1, 10_000)
    alpha: float = parameter(1.0, "length of a step", 0.0)

    def learn(self, task: LearningTask) -> Iterator[None]:
        """Learn without end; yield after each batch."""
        games, theta, rows = task.games, task.weights, np.arange(self.rows)
        while True:
            x, a = task.features.activate(games.inputs), games.recorded_actions
            assert a is not None
            score = -compute_softmax(rate_actions(theta, x), None)
            score[rows, a] += 1.0  # the gradient of log pi(a|s) by the preferences
            if x.strengths is None:
                for k in range(x.indices.shape[1]):
                    np.add.at(theta, x.indices[:, k], self.alpha * score / self.rows)
            else:
                theta += self.alpha * x.strengths.T @ score / self.rows
            games.step(a)
            yield


LEARNER = BehaviourCloning
