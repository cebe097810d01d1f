"""Exact beliefs over the states of any problem whose chance is finite."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dmplay.chance import Array, Reals
from dmplay.core import Problem, checked_state_indices, initial_state_distribution
from dmplay.errors import ImpossibleObservation
from dmplay.tabular import Tabular


class Posterior(NamedTuple):
    """Beliefs after a turn, and how likely that turn's observations were."""

    belief: Reals  # [..., S]
    likelihood: Reals  # [...]


def apply_bayes_rule(joint: Reals) -> Posterior:
    """Bayes' rule: joint probabilities `[..., S]` of what was seen and each state, to 1 in sum.

    Where the likelihood is 0 there is no belief, and zeros are left. Summed state by state: a row
    has the same bits in any batch.
    """
    if joint.ndim == 2 and len(joint) > 1:  # rows are summed side by side
        likelihood = np.add.reduce(np.ascontiguousarray(joint.T))
    else:
        likelihood = joint.cumsum(axis=-1)[..., -1]
    return Posterior(joint / np.where(likelihood > 0.0, likelihood, 1.0)[..., None], likelihood)


def initial_belief(problem: Problem) -> Reals:
    """The belief `[S]` before the first turn: the distribution of the start state."""
    if isinstance(problem, Tabular):
        return problem.initial_belief.astype(float)
    p, states = initial_state_distribution(problem)
    size = len(problem.enumerate_states())
    return np.bincount(checked_state_indices(problem, states), p, minlength=size).astype(float)


def initial_seat_belief(problem: Problem, seat: int, observation: Array) -> Reals:
    """The belief `[S]` of a seat before its first action, after what it observed of the start."""
    before, may = (
        initial_belief(problem),
        problem.initial_observations(problem.enumerate_states())[:, seat] == observation,
    )
    return before if may.all() else apply_bayes_rule(before * may).belief


def update_belief(
    problem: Problem,
    belief: Reals,
    actions: Sequence[int | None],
    observations: Sequence[int | None],
) -> Posterior:
    """The belief `[S]` after a joint action and the observations that followed (Bayes' rule).

    None stands for what is not known: an unknown action is taken to be uniformly random, an
    unknown observation says nothing. Raises ImpossibleObservation where the likelihood is 0.
    """
    found = apply_bayes_rule(problem.joint_belief_update(belief, actions, observations))
    if not found.likelihood:
        raise ImpossibleObservation(_impossible_observation_message(problem, actions, observations))
    return found


def _impossible_observation_message(
    problem: Problem, actions: Sequence[int | None], observations: Sequence[int | None]
) -> str:
    did = [problem.format_action(i, a) for i, a in enumerate(actions) if a is not None]
    saw = [
        problem.observations[i].format_observation(np.array(o))
        for i, o in enumerate(observations)
        if o is not None
    ]
    return f"observation {', '.join(saw)} after {', '.join(did)} has probability 0 in this belief"
