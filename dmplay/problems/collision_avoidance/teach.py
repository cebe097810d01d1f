"""Reasons for advisories, and quantities of collision avoidance."""

from collections.abc import Iterator, Sequence

import numpy as np

from dmplay.core.arrays import Array, Reals
from dmplay.core.problem import enumerate_possible_outcomes
from dmplay.core.spaces import Labels
from dmplay.core.text import format_count, join_words
from dmplay.game.position import Position
from dmplay.tutor.positions import PositionInGame
from dmplay.tutor.quantity import Quantity
from dmplay.tutor.truth import Truth

from .rules import (
    ADVISED_RATES,
    ADVISORY_CHANGE_COST,
    COLLISION_COST,
    COLLISION_DISTANCE,
    CollisionAvoidance,
)

MIDDLE_SHARE = (0.05, 0.95)  # of the heights between which 9 of 10 cases are
MIN_CROSSING_PROBABILITY = 0.95  # less probable crossings are not told
MIN_PROBABILITY = 0.001  # smaller probabilities are not told apart
MIN_STATE_PROBABILITY = 1e-8  # less probable states together have less than 0.0002
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
    state: Array = np.array([height, rate, 0.0, float(seconds)])
    heights, probabilities = _list_heights(problem, state, [index] * seconds)
    low, high = heights[probabilities.cumsum().searchsorted(MIDDLE_SHARE)]
    mean, low_text, high_text = (f"{x:.3g}" for x in (heights @ probabilities, low, high))
    middle = f"in at least 9 of 10 cases from {low_text} to {high_text} m"
    return Truth(
        _sum_collisions(heights, probabilities),
        lambda _: f"the height at the pass is {mean} m on average, {middle}",
    )


def _list_heights(
    problem: CollisionAvoidance, s: Array, actions: Sequence[int], min_probability: float = 0.0
) -> tuple[Reals, Reals]:
    """Return the possible heights after these advisories, ascending, and their probabilities.

    States that are less probable than `min_probability` are left out.
    """
    states: Array = s[None]
    probabilities: Array = np.ones(1)
    for action in actions:
        rows, p, outcome = enumerate_possible_outcomes(
            problem, states, np.full((len(states), 1), action)
        )
        states = outcome.state.round(ROUND_DECIMALS)
        # Only heights and rates differ; numpy sorts complex numbers much faster than rows.
        _, first, places = np.unique(
            states[:, 0] + 1j * states[:, 1], return_index=True, return_inverse=True
        )
        states, probabilities = states[first], np.bincount(places, probabilities[rows] * p)
        likely = probabilities >= min_probability
        states, probabilities = states[likely], probabilities[likely]
    return states[:, 0], probabilities


def _sum_collisions(heights: Reals, probabilities: Reals) -> float:
    """Return the probability of a height at which the aircraft collide."""
    return float(probabilities[np.abs(heights) < COLLISION_DISTANCE].sum())


def _find_probability(problem: CollisionAvoidance, s: Array, plan: Sequence[int]) -> float:
    """Return the probability of a collision after these advisories, one for each second."""
    return _sum_collisions(*_list_heights(problem, s, plan, MIN_STATE_PROBABILITY))


def _find_present_advisory(s: Array) -> int:
    """Return the advisory of the last turn, which costs nothing to keep."""
    return int(np.flatnonzero(s[2] == ADVISED_RATES)[0])


def _describe_advisories(
    problem: CollisionAvoidance, s: Array, action: int, labels: Labels
) -> Iterator[str]:
    """Yield the probability of a collision with each advisory that is kept, or a second later."""
    count, present = round(float(s[3])), _find_present_advisory(s)
    plans = [[advisory] * count for advisory in range(len(labels))]
    cases = [_list_heights(problem, s, plan, MIN_STATE_PROBABILITY) for plan in plans]
    chances = [_sum_collisions(*case) for case in cases]
    for label, (heights, p) in zip(labels, cases, strict=True):
        if p[heights * s[0] < 0].sum() >= MIN_CROSSING_PROBABILITY:
            yield f"Kept until the pass, {label} crosses the height of A."
    if max(chances) < MIN_PROBABILITY:
        limit = f"a probability under {MIN_PROBABILITY:g}"
        yield f"Each advisory, kept until the pass, collides with {limit}."
    else:
        texts = [f"{label} {number:.3f}" for label, number in zip(labels, chances, strict=True)]
        probabilities = join_words(texts).replace(" ", " collides with probability ", 1)
        yield f"Kept until the pass, {probabilities}."
    safest = int(np.argmin(chances))
    if chances[action] - chances[safest] >= MIN_PROBABILITY:
        later = [action, *[safest] * (count - 1)]
        probability = _find_probability(problem, s, later)
        can_wait = action == present and probability - chances[safest] < MIN_PROBABILITY
        yield (
            f"One second of {labels[action]} and then {labels[safest]} collides with probability "
            f"{probability:.3f}{', so the change can wait' * can_wait}."
        )


def give_reasons(position: Position, action: int) -> list[str]:
    """Return the height at the pass, the probabilities of a collision, and the costs."""
    problem, labels = position.problem, position.labels
    assert isinstance(problem, CollisionAvoidance)
    height, rate, advised, seconds = position.state.tolist()
    count, present = round(seconds), labels[_find_present_advisory(position.state)]
    pass_height = height + rate * count
    side, distance = "above" if pass_height > 0 else "below", f"{abs(pass_height):.0f} m"
    limit = f"a collision is under {COLLISION_DISTANCE:g} m"
    is_clear = abs(pass_height) >= COLLISION_DISTANCE
    ends_before = position.turns_left is not None and position.turns_left <= count
    if count <= 1 and not ends_before:  # the rate of this second is given
        time = "in 1 second" if count == 1 else "now"
        reasons = [f"You pass {time} at {distance}: no advisory changes that any more; {limit}."]
    else:
        reasons = [
            f"Without gusts and advisories you pass {distance} {side} aircraft A in "
            f"{format_count(count, 'second')}{is_clear * ', which is clear'}; {limit}."
        ]
    if ends_before:
        reasons.append("The game ends before the pass, so it has no collision.")
    elif count > 1:
        reasons += _describe_advisories(problem, position.state, action, labels)
    present_text = f"The advisory is now {present}" if advised else "There is no advisory now"
    costs_text = f"a change costs {ADVISORY_CHANGE_COST:g}, and a collision {COLLISION_COST:g}"
    reasons.append(f"{present_text}: {costs_text}.")
    return reasons


ARGUMENT_BOUNDS = {"height": (-1e4, 1e4), "rate": (-1e3, 1e3), "seconds": (0, 40)}
REASONS = give_reasons
QUANTITIES = {"collision-probability": Quantity(collision_probability, ARGUMENT_BOUNDS)}
