"""TD(0) on afterstates: learn the value of states after an action, before chance acts."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dmplay.algorithms.learner import Learner, LearningTask
from dmplay.core.arrays import Ints, Reals
from dmplay.core.parameters import parameter
from dmplay.core.problem import Problem


@dataclass(frozen=True)
class Afterstates(Learner):
    """Learns V(x) of an afterstate x from the reward and the afterstate of the next turn.

    V(x) = V(x) + alpha (r' + gamma V(x') - V(x)), where r' and x' are those of the best next
    action; V is a sum of weights, as in an n-tuple network (Szubert and Jaskowski, 2014). With
    `coherent`, a weight that is moved to and fro is moved less (temporal coherence learning, Beal
    and Smith, 1999).
    """

    name = "afterstates"
    summary = "learn the value of states after an action, before chance acts"
    source = "TD(0), as in section 17.1"
    default_features = "afterstates"
    default_steps = 20_000_000

    rows: int = parameter(500, "games that are played side by side", 1, 100_000)
    alpha: float = parameter(1.0, "learning rate", 0.0, 2.0)
    coherent: bool = parameter(True, "move a weight less if it was moved to and fro")

    def explain_misfit(self, problem: Problem) -> str:
        """Return the reason why a problem cannot be learned; '' if it can."""
        return "" if problem.afterstates else "it lists no afterstates"

    def learn(self, task: LearningTask) -> Iterator[None]:
        """Play and learn without end; yield after each turn."""
        games, gamma = task.games, task.problem.discount
        rows = np.arange(self.rows)
        V = task.find_array("weights", task.features.count)  # noqa: N806
        moves = np.zeros((2, len(V)))
        net, total = (task.find_array(name, len(V)) for name in ("net", "total"))
        x, is_new = np.zeros((1, self.rows), np.int64), np.ones(self.rows, bool)
        while True:
            features, rewards = task.features.activate(games.inputs)
            q = rewards + gamma * V[features].sum(axis=0)
            a = q.argmax(axis=1)
            x_next = features[:, rows, a]
            if not is_new.all():
                delta = (q[rows, a] - V[x].sum(axis=0))[~is_new]
                self.move(V, x[:, ~is_new], delta, (moves, net, total))
            turn = games.step(a)
            if turn.terminated.any():  # no reward follows the last afterstate
                last = x_next[:, turn.terminated]
                self.move(V, last, -V[last].sum(axis=0), (moves, net, total))
            x, is_new = x_next, turn.ended
            yield

    def move(self, V: Reals, x: Ints, delta: Reals, memory: tuple[Reals, Reals, Reals]) -> None:  # noqa: N803
        """Move the weights of features `[K, B]` by errors `[B]`: by the mean of a weight's rows."""
        moves, net, total = memory
        cells = x.reshape(-1)
        np.add.at(moves[0], cells, np.tile(delta, len(x)))
        np.add.at(moves[1], cells, 1.0)
        mean = moves[0][cells] / moves[1][cells]
        rate = self.alpha / len(x)
        if self.coherent:
            size = total[cells]
            rates = np.where(size > 0.0, np.abs(net[cells]) / np.maximum(size, 1e-300), 1.0)
            net[cells] += mean
            total[cells] = size + np.abs(mean)
            mean = mean * rates
        V[cells] += rate * mean
        moves[:, cells] = 0.0


LEARNER = Afterstates
