"""Inputs that a view may draw in addition to the state: regrets, and the forecast of an action."""

import numpy as np

from dmplay.core import belief
from dmplay.core.arrays import Array, Reals
from dmplay.core.problem import ContinuousStates, Problem, enumerate_outcomes
from dmplay.core.session import Session
from dmplay.core.uniforms import NATURE_STREAM, SeededUniforms
from dmplay.draw.options import Forecast

SAMPLE_COUNT = 200


def make_regrets(*regret: float) -> Reals:
    """Return the regret of each action as an array."""
    return np.array(regret)


def forecast_action(game: Session, action: float, seat: int = 0) -> Forecast:
    """Forecast an action from the true state, with the first action for all other agents."""
    problem, state = game.problem, game.state[None]
    is_sampled = (
        isinstance(problem.state_count, ContinuousStates) and not problem.actions[seat].labels
    )
    joint = np.zeros((1, len(problem.agents)), float if is_sampled else np.int64)
    joint[0, seat] = action
    if is_sampled:
        uniforms = [
            SeededUniforms(1).generate_uniforms(
                NATURE_STREAM, turn, 0, problem.uniform_counts.step
            )[0]
            for turn in range(SAMPLE_COUNT)
        ]
        s, a = np.repeat(state, SAMPLE_COUNT, axis=0), np.repeat(joint, SAMPLE_COUNT, axis=0)
        observations = problem.step(s, a, np.array(uniforms)).observations
        return Forecast(
            action, np.full(SAMPLE_COUNT, 1 / SAMPLE_COUNT), observations, is_sampled=True
        )
    outcomes = enumerate_outcomes(problem, state, joint)
    observations = outcomes.outcomes.observations[0]
    if problem.partially_observable:
        observations = observations[:, seat]
    states, inverse = np.unique(observations, axis=0, return_inverse=True)
    probabilities: Reals = np.bincount(inverse.reshape(-1), outcomes.probabilities[0]).astype(float)
    order = [k for k in np.argsort(-probabilities, kind="stable") if probabilities[k] > 0]
    return Forecast(
        action,
        probabilities[order],
        states[order],
        _forecast_beliefs(game, action, seat, states[order]),
    )


def _forecast_beliefs(game: Session, action: float, seat: int, observations: Array) -> Reals | None:
    """Return the seat's belief after each of these observations, or None if it has no belief."""
    view = game.view(seat)
    if view.beliefs is None:
        return None
    joint_action: list[int | None] = [None] * len(game.problem.agents)
    joint_action[seat] = int(action)
    return np.array(
        [
            _update_belief(game.problem, view.belief, joint_action, seat, int(o))
            for o in observations
        ]
    )


def _update_belief(
    problem: Problem, prior: Reals, joint_action: list[int | None], seat: int, observation: int
) -> Reals:
    joint_observation: list[int | None] = [
        observation if i == seat else None for i in range(len(joint_action))
    ]
    return belief.update_belief(problem, prior, joint_action, joint_observation).belief


__all__ = ["forecast_action", "make_regrets"]
