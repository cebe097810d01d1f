"""Features of what a learner sees: the weights of the active ones add up to values of actions.

A finite problem has one feature for each state, so that the weights are a table. Real numbers have
tiles, or are features themselves.
"""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from dmplay.core.arrays import Array, Ints, Reals
from dmplay.core.problem import AfterstateModel, Problem

MANY_WEIGHTS_PER_CELL = 64  # weights per changed one from which sorting is faster than counting


class Activation(NamedTuple):
    """The active features of B inputs, with their strengths."""

    indices: Ints  # [B, K]; [1, K] if all inputs have the same ones
    strengths: Reals | None = None  # [B, K]; None for 1


class Features(Protocol):
    """A function from inputs to their active features."""

    @property
    def count(self) -> int:
        """The number of features."""

    def activate(self, s: Array) -> Activation:
        """Return the active features of inputs `[B, ...]`."""


@dataclass(frozen=True)
class StateFeatures:
    """One feature for each state of a finite problem."""

    problem: Problem
    count: int

    def activate(self, s: Array) -> Activation:
        """Return the index `[B, 1]` of each state."""
        return Activation(self.problem.state_indices(s)[:, None])


@dataclass(frozen=True)
class NumberFeatures:
    """A constant, and each number of the input divided by its scale."""

    scales: Reals

    @property
    def count(self) -> int:
        """The number of features: the constant and each number."""
        return 1 + len(self.scales)

    def activate(self, s: Array) -> Activation:
        """Return all indices, with 1 and the scaled numbers as strengths."""
        strengths = np.ones((len(s), self.count))
        strengths[:, 1:] = s / self.scales
        return Activation(np.arange(self.count)[None], strengths)


@dataclass(frozen=True)
class AfterstateFeatures:
    """The features of the states after each action, before chance acts."""

    model: AfterstateModel

    @property
    def count(self) -> int:
        """The number of features."""
        return self.model.feature_count

    def activate(self, s: Array) -> Activation:
        """Return the features `[K, B, A]` of all actions, with their rewards `[B, A]`."""
        rewards, indices = self.model.list_features(s)
        return Activation(indices, rewards)


def rate_actions(weights: Reals, x: Activation) -> Reals:
    """Return the sum `[B, A]` of the weights `[F, A]` of active features.

    Afterstates have weights `[F]`; the result is then the reward plus the value of the afterstate.
    """
    if weights.ndim == 1:
        return np.asarray(x.strengths + weights[x.indices].sum(axis=0))
    if x.strengths is not None:
        return np.asarray(x.strengths @ weights[x.indices[0]])
    is_table = x.indices.shape[1] == 1
    return np.asarray(weights[x.indices[:, 0]] if is_table else weights[x.indices].sum(axis=1))


def add_to_weights(weights: Reals, x: Activation, actions: Ints, changes: Reals) -> None:
    """Change the values of actions `[B]` by `changes` `[B]`, spread over the active features.

    A change is divided by the sum of squared strengths. If rows share a weight, it changes by the
    mean of their changes, so that many rows do not move it too far; one row is the textbook update.
    """
    indices, strengths = x
    if strengths is None:
        parts = (changes / indices.shape[1])[:, None].repeat(indices.shape[1], axis=1)
    else:
        parts = strengths * (changes / (strengths**2).sum(axis=1))[:, None]
    cells = (indices * weights.shape[1] + actions[:, None]).reshape(-1)
    flat = weights.reshape(-1)
    if len(actions) == 1:
        flat[cells] += parts[0]
        return
    if len(flat) > MANY_WEIGHTS_PER_CELL * len(cells):
        cells, inverse, cell_counts = np.unique(cells, return_inverse=True, return_counts=True)
        flat[cells] += np.bincount(inverse, parts.reshape(-1)) / cell_counts
        return
    counts = np.bincount(cells, minlength=len(flat))
    flat += np.bincount(cells, parts.reshape(-1), len(flat)) / np.maximum(counts, 1)
