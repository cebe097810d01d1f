"""Exploration: choose an action that seems worse now and then (sections 15.3 and 15.4)."""

from dataclasses import dataclass

import numpy as np

from dmplay.algorithms.learner import Learner, LearningTask
from dmplay.core.arrays import Bools, Ints, Reals
from dmplay.core.chance import sample_uniform_index
from dmplay.core.parameters import parameter

DECAY_STEPS = 1000  # steps of the environment that `decay` is about


@dataclass(frozen=True)
class ExploringLearner(Learner):
    """A learner that explores by epsilon-greedy choice with decay, or by softmax."""

    epsilon: float = parameter(0.3, "probability of a random action at the start", 0.0, 1.0)
    decay: float = parameter(0.99, "factor on epsilon for each 1,000 steps", 0.0, 1.0)
    precision: float = parameter(
        0.0, "softmax choice with this factor on the values; 0: epsilon-greedy", 0.0
    )

    def explore(self, task: LearningTask, q: Reals, legal: Bools | None) -> Ints:
        """Return an action `[B]` by values `[B, A]`, random at times; that of recorded turns."""
        if task.games.recorded_actions is not None:
            return task.games.recorded_actions
        if self.precision:
            return choose_softmax(q, legal, self.precision, task.generator.random(len(q)))
        epsilon = self.epsilon * self.decay ** (task.games.step_count / DECAY_STEPS)
        return choose_epsilon_greedy(q, legal, epsilon, task.generator.random((len(q), 2)))


def choose_greedy(q: Reals, legal: Bools | None) -> Ints:
    """Return the first of the best legal actions `[B]` by values `[B, A]`."""
    return np.asarray((q if legal is None else np.where(legal, q, -np.inf)).argmax(axis=1))


def maximize(q: Reals, legal: Bools | None) -> Reals:
    """Return the value `[B]` of the best legal action."""
    return np.asarray((q if legal is None else np.where(legal, q, -np.inf)).max(axis=1))


def choose_epsilon_greedy(q: Reals, legal: Bools | None, epsilon: float, u: Reals) -> Ints:
    """Return a random action with probability epsilon, else the best one; uniforms `[B, 2]`."""
    greedy = choose_greedy(q, legal)
    explores = u[:, 0] < epsilon
    if not explores.any():
        return greedy
    return np.where(explores, sample_uniform_index(q.shape[1], u[:, 1], legal), greedy)


def compute_softmax(preferences: Reals, legal: Bools | None) -> Reals:
    """Return the probabilities `[B, A]`, proportional to the exponentials of preferences."""
    if legal is not None:
        preferences = np.where(legal, preferences, -np.inf)
    exponentials = np.exp(preferences - preferences.max(axis=1, keepdims=True))
    return np.asarray(exponentials / exponentials.sum(axis=1, keepdims=True))


def choose_softmax(q: Reals, legal: Bools | None, precision: float, u: Reals) -> Ints:
    """Return an action with a probability proportional to exp(precision Q); uniforms `[B]`."""
    return sample_actions(compute_softmax(precision * q, legal), u)


def sample_actions(probabilities: Reals, u: Reals) -> Ints:
    """Return an action `[B]` from probabilities `[B, A]` by uniforms `[B]`."""
    return np.asarray((probabilities.cumsum(axis=1)[:, :-1] <= u[:, None]).sum(axis=1))
