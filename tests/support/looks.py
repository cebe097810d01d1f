"""What a view may be asked to draw beside the state: losses, and what an action may bring."""

import numpy as np

from dmplay import belief
from dmplay.chance import Array, Reals
from dmplay.core import ContinuousStates, Problem, enumerate_outcomes
from dmplay.dice import NATURE_STREAM, SeededUniforms
from dmplay.session import Session
from dmplay.views.style import Forecast

SAMPLES = 200


def losing(*regret: float) -> Reals:
    """What each action loses."""
    return np.array(regret)


def foreseen(game: Session, action: float, seat: int = 0) -> Forecast:
    """What an action may bring from the true state, all others doing what they have first."""
    problem, state = game.problem, game.state[None]
    sampled = isinstance(problem.state_count, ContinuousStates) and not problem.actions[seat].labels
    joint = np.zeros((1, len(problem.agents)), float if sampled else np.int64)
    joint[0, seat] = action
    if sampled:
        each = [
            SeededUniforms(1).generate_uniforms(
                NATURE_STREAM, turn, 0, problem.uniform_counts.step
            )[0]
            for turn in range(SAMPLES)
        ]
        s, a = np.repeat(state, SAMPLES, axis=0), np.repeat(joint, SAMPLES, axis=0)
        seen = problem.step(s, a, np.array(each)).observations
        return Forecast(action, np.full(SAMPLES, 1 / SAMPLES), seen, is_sampled=True)
    found = enumerate_outcomes(problem, state, joint)
    seen = found.outcomes.observations[0]
    if problem.partially_observable:
        seen = seen[:, seat]
    states, places = np.unique(seen, axis=0, return_inverse=True)
    chances: Reals = np.bincount(places.reshape(-1), found.probabilities[0]).astype(float)
    order = [k for k in np.argsort(-chances, kind="stable") if chances[k] > 0]
    return Forecast(
        action, chances[order], states[order], _believed(game, action, seat, states[order])
    )


def _believed(game: Session, action: float, seat: int, seen: Array) -> Reals | None:
    """What the seat would believe after each of its observations."""
    view = game.view(seat)
    if view.beliefs is None:
        return None
    acted: list[int | None] = [None] * len(game.problem.agents)
    acted[seat] = int(action)
    return np.array([_after(game.problem, view.belief, acted, seat, int(o)) for o in seen])


def _after(
    problem: Problem, before: Reals, acted: list[int | None], seat: int, sense: int
) -> Reals:
    sensed: list[int | None] = [sense if i == seat else None for i in range(len(acted))]
    return belief.update_belief(problem, before, acted, sensed).belief


__all__ = ["foreseen", "losing"]
