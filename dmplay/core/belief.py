"""Exact beliefs over the states of any problem whose chance is finite."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Array, Reals
from dmplay.core.problem import Problem, checked_state_indices, initial_state_distribution
from dmplay.core.tabular import Tabular
from dmplay.errors import BadParameter, ImpossibleObservation

SUM_TOLERANCE = 0.011  # so that rounded probabilities are accepted
STATED_DIGITS = 10  # significant digits of a stated belief, as of all facts in a transcript


class Posterior(NamedTuple):
    """A belief after a turn, and the likelihood of that turn's observations."""

    belief: Reals  # [..., S]
    likelihood: Reals  # [...]


def apply_bayes_rule(joint: Reals) -> Posterior:
    """Return the posterior of joint probabilities `[..., S]` of the observations and each state.

    This is Bayes' rule: the probabilities are divided by their sum, the likelihood. Where the
    likelihood is 0 there is no belief, and the zeros stay. The sum is taken state by state, so that
    a row has the same bits in any batch.
    """
    # One reduction of the transposed array sums all rows at once.
    if joint.ndim == 2 and len(joint) > 1:
        likelihood = np.add.reduce(np.ascontiguousarray(joint.T))
    else:
        likelihood = joint.cumsum(axis=-1)[..., -1]
    return Posterior(joint / np.where(likelihood > 0.0, likelihood, 1.0)[..., None], likelihood)


def initial_belief(problem: Problem) -> Reals:
    """Return the belief `[S]` before the first turn: the distribution of the initial state."""
    if isinstance(problem, Tabular):
        return problem.initial_belief.astype(float)
    p, states = initial_state_distribution(problem)
    indices, state_count = checked_state_indices(problem, states), len(problem.enumerate_states())
    return np.bincount(indices, p, minlength=state_count).astype(float)


def initial_seat_belief(problem: Problem, seat: int, observation: Array) -> Reals:
    """Return the belief `[S]` of a seat before its first action, given its initial observation."""
    start_belief = initial_belief(problem)
    consistent = problem.initial_observations(problem.enumerate_states())[:, seat] == observation
    return start_belief if consistent.all() else apply_bayes_rule(start_belief * consistent).belief


def update_belief(
    problem: Problem,
    belief: Reals,
    actions: Sequence[int | None],
    observations: Sequence[int | None],
) -> Posterior:
    """Return the belief `[S]` after a joint action and its observations, by Bayes' rule.

    None means unknown: an unknown action is taken to be uniformly random, an unknown observation
    does not change the belief. Raise ImpossibleObservation if the likelihood is 0.
    """
    posterior = apply_bayes_rule(problem.joint_belief_update(belief, actions, observations))
    if not posterior.likelihood:
        raise ImpossibleObservation(_impossible_observation_message(problem, actions, observations))
    return posterior


def _impossible_observation_message(
    problem: Problem, actions: Sequence[int | None], observations: Sequence[int | None]
) -> str:
    """Return the error message for observations that have probability 0 after these actions."""
    acts = [problem.format_action(i, a) for i, a in enumerate(actions) if a is not None]
    pairs = zip(problem.observations, observations, strict=True)
    obs = [space.format_observation(np.array(o)) for space, o in pairs if o is not None]
    return f"observation {', '.join(obs)} after {', '.join(acts)} has probability 0 in this belief"


def normalize_belief(values: Reals, tolerance: float = SUM_TOLERANCE) -> Reals:
    """Return probabilities `[S]` divided by their sum.

    Raise BadParameter if one is negative or not finite, or if the sum is not 1 within a tolerance.
    """
    total = float(values.sum())
    if not abs(total - 1.0) <= tolerance or values.min() < 0.0:
        got = f"probabilities that add up to {total:g}"
        raise BadParameter(f"got {got}, expected 1, and none below 0")
    return np.asarray(values / total)


def round_stated_belief(values: Reals) -> Reals:
    """Return a stated belief `[S]` as a transcript records it, so that both are the same."""
    return np.array([float(f"{p:.{STATED_DIGITS}g}") for p in values.tolist()])
