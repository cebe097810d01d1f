"""The upper envelope of linear functions over a simplex, with all its corners.

The greatest of some alpha vectors is a convex function of the belief. What lies above its graph is
a polyhedron, and a vector is needed exactly where it rises above a corner of those before it.
"""

import itertools
import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Bools, Ints, Reals
from dmplay.solvers.double_description import (
    BORDER_TOLERANCE,
    Cone,
    cut_cone,
    find_facets,
    make_simplicial_cone,
)

MAX_VALUE_BITS = 10  # binary digits of values that are of the order of 1, as SLACK has it

Line = tuple[float, float, int]  # its values in the first and the second state, and its place


class UpperEnvelope(NamedTuple):
    """Where each of the needed vectors is the greatest: the hull of its corners."""

    needed_vectors: Ints  # [N], rising: the vectors greatest on a set of positive measure
    corner_beliefs: Reals  # [V, S], the corners
    corner_values: Reals  # [V]
    touching_vectors: Bools  # [V, N], which of the needed vectors are greatest at a corner


def compute_upper_envelope(vectors: Reals, budget: Budget | None = None) -> UpperEnvelope:
    """The upper envelope of vectors `[C, S]`; of equal ones it needs one.

    What rises above no corner never does again, and is not tried again. Large values are scaled
    down, by a power of 2 which changes no digit, so that their rounding is less than the slack.
    """
    budget = budget or Budget("an envelope", "try fewer vectors")
    states, digits = vectors.shape[1], math.frexp(float(abs(vectors).max()))[1]
    if digits > MAX_VALUE_BITS:
        scale = 2.0 ** (digits - MAX_VALUE_BITS)
        found = compute_upper_envelope(vectors / scale, budget)
        return found._replace(corner_values=found.corner_values * scale)
    if states == 2:
        return _compute_line_envelope(vectors, budget)
    chosen = [int(np.argmax(vectors.sum(axis=1)))]
    if (vectors - vectors[chosen] <= BORDER_TOLERANCE).all():
        everywhere = np.ones((states, 1), bool)
        return UpperEnvelope(np.array(chosen), np.eye(states), vectors[chosen[0]], everywhere)
    rays = np.eye(states + 1)  # (belief, value): the corners of the simplex, and straight up
    rays[:states, states] = vectors[chosen[0]]
    cone = make_simplicial_cone(rays)
    rising = np.arange(len(vectors))
    while True:
        low = cone.rays[:, :states].any(axis=1)
        beliefs, values = cone.rays[low, :states], cone.rays[low, states]
        size = len(rising) * len(beliefs)
        budget.check_memory(16.0 * size)
        budget.spend_work(5 * ARRAY_CALL_WORK + (4 + states) * size)
        gain = (vectors[rising] @ beliefs.T - values).max(axis=1)
        above = gain > BORDER_TOLERANCE
        if not above.any():
            break
        highest = int(rising[np.argmax(gain)])
        rising = rising[above]
        cone = _normalize_beliefs(cut_cone(cone, np.append(-vectors[highest], 1.0), budget))
        chosen.append(highest)
    rays, borders = cone.tight_borders.shape
    budget.spend_work(ARRAY_CALL_WORK + rays * borders * (2 + borders / 4))
    needed = find_facets(cone)[states:]
    order = np.argsort(np.array(chosen)[needed])
    touching = cone.tight_borders[low, states:][:, needed][:, order]
    return UpperEnvelope(np.array(chosen)[needed][order], beliefs, values, touching)


def _compute_line_envelope(vectors: Reals, budget: Budget) -> UpperEnvelope:
    """The same of two states, where each function is a line: taken as their slope rises."""
    budget.check_memory(96.0 * len(vectors))
    budget.spend_work(ARRAY_CALL_WORK + 100 * len(vectors))
    lines: list[Line] = [(*ends, nth) for nth, ends in enumerate(vectors.tolist())]
    lines.sort(key=lambda line: (line[1] - line[0], line[0]))
    top: list[Line] = []
    for line in lines:
        if not top or line[1] > top[-1][1]:
            while top and _compute_rise_above_neighbors(top[-2:-1], top[-1], [line]) <= 0.0:
                top.pop()
            top.append(line)
    _drop_negligible_lines(top)
    share = np.array([0.0, *itertools.starmap(_find_crossing, pairwise(top)), 1.0])
    beliefs = np.stack([1.0 - share, share], axis=1)
    chosen = np.array([line[2] for line in top])
    values = (beliefs * vectors[[*chosen, chosen[-1]]]).sum(axis=1)
    corner, nth, order = np.arange(len(share))[:, None], np.arange(len(top)), np.argsort(chosen)
    touching = (corner == nth) | (corner == nth + 1)
    return UpperEnvelope(chosen[order], beliefs, values, touching[:, order])


def _drop_negligible_lines(lines: list[Line]) -> None:
    """Leaves out lines that rise above those beside them by no more than rounding may."""
    rises = [_compute_rise_at(nth, lines) for nth in range(len(lines))]
    while min(rises) <= BORDER_TOLERANCE:
        least = rises.index(min(rises))
        del lines[least], rises[least]
        for nth in range(max(least - 1, 0), min(least + 1, len(lines))):
            rises[nth] = _compute_rise_at(nth, lines)


def _compute_rise_at(index: int, lines: list[Line]) -> float:
    return _compute_rise_above_neighbors(
        lines[max(index - 1, 0) : index], lines[index], lines[index + 1 : index + 2]
    )


def _compute_rise_above_neighbors(
    previous_line: list[Line], line: Line, next_line: list[Line]
) -> float:
    """How high a line is where those before and after it meet, above them; inf alone."""
    if not (previous_line or next_line):
        return math.inf
    at = (
        0.0
        if not previous_line
        else 1.0
        if not next_line
        else _find_crossing(previous_line[0], next_line[0])
    )
    beside = (previous_line or next_line)[0]
    return (1.0 - at) * (line[0] - beside[0]) + at * (line[1] - beside[1])


def _find_crossing(first: Line, second: Line) -> float:
    """The share at which the steeper line comes to be the greater."""
    behind, ahead = first[0] - second[0], second[1] - first[1]
    return behind / (behind + ahead)


def _normalize_beliefs(cone: Cone) -> Cone:
    """The same cone with beliefs of sum 1."""
    total = cone.rays[:, :-1].sum(axis=1, keepdims=True)
    total[total <= 0] = 1.0
    return Cone(cone.rays / total, cone.tight_borders)
