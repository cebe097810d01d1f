"""Q-learning: move Q(s, a) toward the reward and the value of the best next action."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dmplay.algorithms.exploration import ExploringLearner, maximize
from dmplay.algorithms.features import add_to_weights, rate_actions
from dmplay.algorithms.learner import LearningTask
from dmplay.core.parameters import parameter


@dataclass(frozen=True)
class QLearning(ExploringLearner):
    """Learns Q from the reward and the best next action, whatever action follows.

    Q(s, a) = Q(s, a) + alpha (r + gamma max Q(s', a') - Q(s, a)); algorithm 17.2.
    """

    name = "q-learning"
    summary = "learn the value of each action from the best action of the next state"
    source = "section 17.2, Q-Learning"
    data_use = "possible"

    alpha: float = parameter(0.2, "learning rate", 0.0, 2.0)
    alpha_decay: float = parameter(0.99, "factor on alpha for each 1,000 steps", 0.0, 1.0)

    def learn(self, task: LearningTask) -> Iterator[None]:
        """Play and learn without end; yield after each update."""
        games, Q, gamma = task.games, task.weights, task.problem.discount  # noqa: N806
        rows = np.arange(self.rows)
        s = task.features.activate(games.inputs)
        while True:
            q = rate_actions(Q, s)
            a = self.explore(task, q, games.legal)
            turn = games.step(a)
            s_next = task.features.activate(turn.next_inputs)
            u_next = maximize(rate_actions(Q, s_next), turn.next_legal)
            target = turn.rewards + gamma * np.where(turn.terminated, 0.0, u_next)
            alpha = self.alpha * self.alpha_decay ** (games.step_count / 1000)
            add_to_weights(Q, s, a, alpha * (target - q[rows, a]))
            s = task.features.activate(games.inputs) if turn.ended.any() else s_next
            yield


LEARNER = QLearning
