"""Sarsa: move Q(s, a) toward the reward and the value of the action that is played next."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dmplay.algorithms.exploration import ExploringLearner
from dmplay.algorithms.features import add_to_weights, rate_actions
from dmplay.algorithms.learner import LearningTask
from dmplay.core.parameters import parameter


@dataclass(frozen=True)
class Sarsa(ExploringLearner):
    """Learns Q of the actions that it plays, exploration included.

    Q(s, a) = Q(s, a) + alpha (r + gamma Q(s', a') - Q(s, a)); algorithm 17.3.
    """

    name = "sarsa"
    summary = "learn the value of each action from the action that is played next"
    source = "section 17.3, Sarsa"

    alpha: float = parameter(0.2, "learning rate", 0.0, 2.0)
    alpha_decay: float = parameter(0.99, "factor on alpha for each 1,000 steps", 0.0, 1.0)

    def learn(self, task: LearningTask) -> Iterator[None]:
        """Play and learn without end; yield after each update."""
        games, Q, gamma = task.games, task.weights, task.problem.discount  # noqa: N806
        rows = np.arange(self.rows)
        s = task.features.activate(games.inputs)
        a = self.explore(task, rate_actions(Q, s), games.legal)
        while True:
            turn = games.step(a)
            s_next = task.features.activate(turn.next_inputs)
            q_next = rate_actions(Q, s_next)
            a_next = self.explore(task, q_next, turn.next_legal)
            u_next = np.where(turn.terminated, 0.0, q_next[rows, a_next])
            target = turn.rewards + gamma * u_next
            alpha = self.alpha * self.alpha_decay ** (games.step_count / 1000)
            add_to_weights(Q, s, a, alpha * (target - rate_actions(Q, s)[rows, a]))
            s, a = s_next, a_next
            if turn.ended.any():
                s = task.features.activate(games.inputs)
                a = np.where(turn.ended, self.explore(task, rate_actions(Q, s), games.legal), a)
            yield


LEARNER = Sarsa
