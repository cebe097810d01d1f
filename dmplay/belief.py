"""Exact beliefs over the states of any problem whose chance is finite."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dmplay.chance import Array, Reals
from dmplay.core import Problem, exact_start, placed
from dmplay.errors import ImpossibleObservation
from dmplay.tabular import Tabular


class Posterior(NamedTuple):
    """Beliefs after a turn, and how likely that turn's observations were."""

    belief: Reals  # [..., S]
    likelihood: Reals  # [...]


def bayes(joint: Reals) -> Posterior:
    """Bayes' rule: joint probabilities `[..., S]` of what was seen and each state, to 1 in sum.

    Where the likelihood is 0 there is no belief, and zeros are left. Summed state by state: a row
    has the same bits in any batch.
    """
    if joint.ndim == 2 and len(joint) > 1:  # rows are summed side by side
        likelihood = np.add.reduce(np.ascontiguousarray(joint.T))
    else:
        likelihood = joint.cumsum(axis=-1)[..., -1]
    return Posterior(joint / np.where(likelihood > 0.0, likelihood, 1.0)[..., None], likelihood)


def prior(problem: Problem) -> Reals:
    """The belief `[S]` before the first turn: the distribution of the start state."""
    if isinstance(problem, Tabular):
        return problem.start_belief.astype(float)
    p, states = exact_start(problem)
    size = len(problem.enumerated())
    return np.bincount(placed(problem, states), p, minlength=size).astype(float)


def first(problem: Problem, seat: int, observation: Array) -> Reals:
    """The belief `[S]` of a seat before its first action, after what it observed of the start."""
    before, may = prior(problem), problem.first(problem.enumerated())[:, seat] == observation
    return before if may.all() else bayes(before * may).belief


def update(
    problem: Problem,
    belief: Reals,
    actions: Sequence[int | None],
    observations: Sequence[int | None],
) -> Posterior:
    """The belief `[S]` after a joint action and the observations that followed (Bayes' rule).

    None stands for what is not known: an unknown action is taken to be uniformly random, an
    unknown observation says nothing. Raises ImpossibleObservation where the likelihood is 0.
    """
    found = bayes(problem.carry(belief, actions, observations))
    if not found.likelihood:
        raise ImpossibleObservation(_impossible(problem, actions, observations))
    return found


def _impossible(
    problem: Problem, actions: Sequence[int | None], observations: Sequence[int | None]
) -> str:
    did = [problem.action_name(i, a) for i, a in enumerate(actions) if a is not None]
    saw = [
        problem.observations[i].told(np.array(o))
        for i, o in enumerate(observations)
        if o is not None
    ]
    return f"observation {', '.join(saw)} after {', '.join(did)} has probability 0 in this belief"
