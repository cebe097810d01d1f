"""Maximum likelihood: count what follows each action, and plan with the estimated model."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dmplay.algorithms.exploration import ExploringLearner, maximize
from dmplay.algorithms.learner import LearningTask
from dmplay.core.arrays import Bools, Reals
from dmplay.core.parameters import parameter
from dmplay.core.problem import Problem

MAX_COUNTS = 4_000_000  # states times actions times states
MAX_CHANGE, MAX_SWEEPS = 1e-6, 1000  # of a value in the last sweep of a full update


@dataclass(frozen=True)
class MaximumLikelihood(ExploringLearner):
    """Learns T and R by counting, and Q from them; algorithms 16.1 to 16.4.

    T(s'|s, a) = N(s, a, s') / N(s, a) and R(s, a) = rho(s, a) / N(s, a), and both are 0 for an
    action that was never taken. After each turn a full update sweeps all states until Q stays the
    same. Dyna instead backs up the visited state and a few random ones, one after another.
    """

    name = "maximum-likelihood"
    summary = "count what follows each action, and plan with the estimated model"
    source = "sections 16.1 and 16.2, Maximum Likelihood Models and Update Schemes"
    data_use = "possible"
    default_steps = 10_000

    rows: int = parameter(1, "games that are played side by side", 1, 10_000)
    update: str = parameter("full", "update scheme: full or dyna", choices=("full", "dyna"))
    random_updates: int = parameter(10, "random states that Dyna backs up in a turn", 0, 10_000)

    def explain_misfit(self, problem: Problem) -> str:
        """Return the reason why a problem cannot be learned; '' if it can."""
        count = problem.state_count
        if problem.partially_observable or not isinstance(count, int):
            return "it counts states, which must be listed and visible"
        too_many = count**2 * problem.action_counts[0] > MAX_COUNTS
        return f"it has {count} states, too many to count" if too_many else ""

    def learn(self, task: LearningTask) -> Iterator[None]:
        """Play and learn without end; yield after each turn."""
        games, Q, gamma = task.games, task.weights, task.problem.discount  # noqa: N806
        N = task.find_array("counts", *Q.shape, len(Q))  # noqa: N806
        n, rho = (task.find_array(name, *Q.shape) for name in ("visits", "reward_sums"))
        legal = task.problem.legal_actions_mask(task.problem.enumerate_states())
        is_legal = np.ones(Q.shape, bool) if legal is None else legal[:, 0]
        s = task.features.activate(games.inputs).indices[:, 0]
        while True:
            a = self.explore(task, Q[s], games.legal)
            turn = games.step(a)
            s_next = task.features.activate(turn.next_inputs).indices[:, 0]
            np.add.at(n, (s, a), 1.0)
            np.add.at(rho, (s, a), turn.rewards)
            np.add.at(N, (s, a, s_next), ~turn.terminated)  # after the end, all values are 0
            if self.update == "full":
                sweep_until_stable(Q, is_legal, N, n, rho, gamma)
            else:
                states = task.generator.integers(len(Q), size=self.random_updates)
                for state in (*s.tolist(), *states.tolist()):
                    u = maximize(Q, is_legal)
                    Q[state] = back_up(N[state], n[state], rho[state], gamma * u)
            s = task.features.activate(games.inputs).indices[:, 0]
            yield


def back_up(N: Reals, n: Reals, rho: Reals, discounted_u: Reals) -> Reals:  # noqa: N803
    """Return R(s, a) + sum T(s'|s, a) gamma U(s') `[..., A]`, from counts `[..., A, S]`."""
    return np.asarray((rho + N @ discounted_u) / np.maximum(n, 1.0))


def sweep_until_stable(  # noqa: PLR0913, PLR0917 - the model
    Q: Reals,  # noqa: N803
    is_legal: Bools,
    N: Reals,  # noqa: N803
    n: Reals,
    rho: Reals,
    gamma: float,
) -> None:
    """Back up all states together until no value of Q changes: value iteration of the model."""
    for _ in range(MAX_SWEEPS):
        backed_up = back_up(N, n, rho, gamma * maximize(Q, is_legal))
        change = np.abs(backed_up - Q).max()
        Q[:] = backed_up
        if change <= MAX_CHANGE:
            return


LEARNER = MaximumLikelihood
