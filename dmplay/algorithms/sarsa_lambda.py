"""Sarsa(lambda): a surprise changes Q of all recent states and actions, the latest ones most."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dmplay.algorithms.exploration import ExploringLearner
from dmplay.algorithms.features import rate_actions
from dmplay.algorithms.learner import LearningTask
from dmplay.core.parameters import parameter


@dataclass(frozen=True)
class SarsaLambda(ExploringLearner):
    """Learns Q of recent states and actions together, by eligibility traces.

    N(s, a) = N(s, a) + 1 and Q = Q + alpha delta N for all states and actions, then
    N = gamma lambda N; algorithm 17.4. A replacing trace is 1 instead, and 0 for the other actions
    (Sutton and Barto, 2018, section 12.5).
    """

    name = "sarsa-lambda"
    summary = "learn Q of all recent states and actions from each reward, by eligibility traces"
    source = "section 17.4, Eligibility Traces"

    alpha: float = parameter(0.2, "learning rate", 0.0, 2.0)
    alpha_decay: float = parameter(0.99, "factor on alpha for each 1,000 steps", 0.0, 1.0)
    lambda_: float = parameter(0.9, "factor on the traces in each turn", 0.0, 1.0)
    traces: str = parameter(
        "accumulating", "accumulating or replacing", choices=("accumulating", "replacing")
    )

    def learn(self, task: LearningTask) -> Iterator[None]:
        """Play and learn without end; yield after each update."""
        games, Q, gamma = task.games, task.weights, task.problem.discount  # noqa: N806
        rows = np.arange(self.rows)
        N = np.zeros((self.rows, *Q.shape))  # noqa: N806 - traces
        flat_traces = N.reshape(self.rows, -1)
        s = task.features.activate(games.inputs)
        q = rate_actions(Q, s)
        a = self.explore(task, q, games.legal)
        while True:
            turn = games.step(a)
            s_next = task.features.activate(turn.next_inputs)
            q_next = rate_actions(Q, s_next)
            a_next = self.explore(task, q_next, turn.next_legal)
            u_next = np.where(turn.terminated, 0.0, q_next[rows, a_next])
            delta = turn.rewards + gamma * u_next - q[rows, a]
            indices, strengths = s
            marks = 1.0 if strengths is None else strengths
            if self.traces == "replacing":
                N[rows[:, None], indices] = 0.0
            N[rows[:, None], indices, a[:, None]] += marks
            squares = indices.shape[1] if strengths is None else (strengths**2).sum(axis=1)
            alpha = self.alpha * self.alpha_decay ** (games.step_count / 1000)
            change = delta / squares @ flat_traces
            if self.rows > 1:
                change /= np.maximum(flat_traces.sum(axis=0), 1.0)
            Q.reshape(-1)[:] += alpha * change
            flat_traces *= gamma * self.lambda_
            s, a = s_next, a_next
            if turn.ended.any():
                N[turn.ended] = 0.0
                s = task.features.activate(games.inputs)
                new_a = self.explore(task, rate_actions(Q, s), games.legal)
                a = np.where(turn.ended, new_a, a_next)
            q = rate_actions(Q, s)
            yield


LEARNER = SarsaLambda
