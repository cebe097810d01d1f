"""Quantities of collision avoidance."""

import numpy as np

from dmplay.core.arrays import Array
from dmplay.core.problem import enumerate_possible_outcomes
from dmplay.tutor.positions import PositionInGame
from dmplay.tutor.quantity import Quantity
from dmplay.tutor.truth import Truth

from .rules import COLLISION_DISTANCE, CollisionAvoidance

MIDDLE_SHARE = (0.05, 0.95)  # of the heights between which 9 of 10 cases are
ROUND_DECIMALS = 9  # of states that differ by rounding errors only


def collision_probability(
    position: PositionInGame, action: str, height: float, rate: float, seconds: int
) -> Truth:
    """Return the probability of a collision if one advisory is repeated until the pass.

    The game is collision avoidance, `seconds` before the pass, without an advisory so far.
    """
    problem = position.problem
    assert isinstance(problem, CollisionAvoidance)
    index = int(problem.parse_action(position.seat, action))
    states: Array = np.array([[height, rate, 0.0, float(seconds)]])
    probabilities: Array = np.ones(1)
    for _ in range(seconds):
        rows, p, outcome = enumerate_possible_outcomes(
            problem, states, np.full((len(states), 1), index)
        )
        states, places = np.unique(outcome.state.round(ROUND_DECIMALS), axis=0, return_inverse=True)
        probabilities = np.bincount(places.ravel(), probabilities[rows] * p)
    heights = states[:, 0]  # in ascending order
    low, high = heights[probabilities.cumsum().searchsorted(MIDDLE_SHARE)]
    mean, low_text, high_text = (f"{x:.3g}" for x in (heights @ probabilities, low, high))
    middle = f"in at least 9 of 10 cases from {low_text} to {high_text} m"
    return Truth(
        float(probabilities[np.abs(heights) < COLLISION_DISTANCE].sum()),
        lambda _: f"the height at the pass is {mean} m on average, {middle}",
    )


ARGUMENT_BOUNDS = {"height": (-1e4, 1e4), "rate": (-1e3, 1e3), "seconds": (0, 40)}
QUANTITIES = {"collision-probability": Quantity(collision_probability, ARGUMENT_BOUNDS)}
