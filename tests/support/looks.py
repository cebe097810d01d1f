"""What a view may be asked to draw beside the state: losses, and what an action may bring."""

import numpy as np

from dmplay import belief
from dmplay.chance import Array, Reals
from dmplay.core import Continuous, Problem, exact
from dmplay.dice import NATURE, Dice
from dmplay.session import Session
from dmplay.views.style import Outlook

SAMPLES = 200


def losing(*regret: float) -> Reals:
    """What each action loses."""
    return np.array(regret)


def foreseen(game: Session, action: float, seat: int = 0) -> Outlook:
    """What an action may bring from the true state, all others doing what they have first."""
    problem, state = game.problem, game.state[None]
    sampled = isinstance(problem.states, Continuous) and not problem.actions[seat].labels
    joint = np.zeros((1, len(problem.agents)), float if sampled else np.int64)
    joint[0, seat] = action
    if sampled:
        each = [Dice(1).draw(NATURE, turn, 0, problem.draws.step)[0] for turn in range(SAMPLES)]
        s, a = np.repeat(state, SAMPLES, axis=0), np.repeat(joint, SAMPLES, axis=0)
        seen = problem.step(s, a, np.array(each)).observations
        return Outlook(action, np.full(SAMPLES, 1 / SAMPLES), seen, sampled=True)
    found = exact(problem, state, joint)
    seen = found.outcome.observations[0]
    if problem.hidden:
        seen = seen[:, seat]
    states, places = np.unique(seen, axis=0, return_inverse=True)
    chances: Reals = np.bincount(places.reshape(-1), found.probabilities[0]).astype(float)
    order = [k for k in np.argsort(-chances, kind="stable") if chances[k] > 0]
    return Outlook(
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
    return belief.update(problem, before, acted, sensed).belief


__all__ = ["foreseen", "losing"]
