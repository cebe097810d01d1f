"""The upper envelope of linear functions over a simplex, with all its corners.

The maximum of alpha vectors is a convex function of the belief. The points above its graph form a
polyhedron, and a vector is needed exactly if it rises above a corner of the vectors before it.
"""

import itertools
import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Bools, Ints, Reals
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.solvers.double_description import (
    BORDER_TOLERANCE,
    Cone,
    cut_cone,
    find_facets,
    make_simplicial_cone,
)

# larger values are scaled down, because BORDER_TOLERANCE is meant for values of about 1
MAX_VALUE_BITS = 10

Line = tuple[float, float, int]  # values in the first and the second state, and the vector's index


class UpperEnvelope(NamedTuple):
    """The vectors that form the upper envelope, and its corners."""

    # [N], ascending indices of vectors that are greatest on a set of positive measure
    needed_vectors: Ints
    corner_beliefs: Reals  # [V, S]
    corner_values: Reals  # [V]
    touching_vectors: Bools  # [V, N], whether a needed vector is greatest at a corner


def compute_upper_envelope(vectors: Reals, budget: Budget | None = None) -> UpperEnvelope:
    """Return the upper envelope of vectors `[C, S]`; of equal vectors it contains one.

    A vector that rises above no corner is not tried again, because it never will. Large values are
    divided by a power of 2, which changes no digit, so that rounding errors stay below the
    tolerance.
    """
    budget = budget or Budget("upper envelope", "try fewer vectors")
    state_count, exponent = vectors.shape[1], math.frexp(float(abs(vectors).max()))[1]
    if exponent > MAX_VALUE_BITS:
        scale = 2.0 ** (exponent - MAX_VALUE_BITS)
        result = compute_upper_envelope(vectors / scale, budget)
        return result._replace(corner_values=result.corner_values * scale)
    if state_count == 2:
        return _compute_line_envelope(vectors, budget)
    chosen = [int(np.argmax(vectors.sum(axis=1)))]
    if (vectors - vectors[chosen] <= BORDER_TOLERANCE).all():
        everywhere = np.ones((state_count, 1), bool)
        return UpperEnvelope(np.array(chosen), np.eye(state_count), vectors[chosen[0]], everywhere)
    # (belief, value): the corners of the simplex, and the upward direction
    rays = np.eye(state_count + 1)
    rays[:state_count, state_count] = vectors[chosen[0]]
    cone = make_simplicial_cone(rays)
    candidates = np.arange(len(vectors))
    while True:
        is_corner = cone.rays[:, :state_count].any(axis=1)
        beliefs, values = cone.rays[is_corner, :state_count], cone.rays[is_corner, state_count]
        size = len(candidates) * len(beliefs)
        budget.check_memory(16.0 * size)
        budget.spend_work(5 * ARRAY_CALL_WORK + (4 + state_count) * size)
        gains = (vectors[candidates] @ beliefs.T - values).max(axis=1)
        is_above = gains > BORDER_TOLERANCE
        if not is_above.any():
            break
        highest = int(candidates[np.argmax(gains)])
        candidates = candidates[is_above]
        cone = _normalize_beliefs(cut_cone(cone, np.append(-vectors[highest], 1.0), budget))
        chosen.append(highest)
    rays, borders = cone.tight_borders.shape
    budget.spend_work(ARRAY_CALL_WORK + rays * borders * (2 + borders / 4))
    needed = find_facets(cone)[state_count:]
    order = np.argsort(np.array(chosen)[needed])
    touching = cone.tight_borders[is_corner, state_count:][:, needed][:, order]
    return UpperEnvelope(np.array(chosen)[needed][order], beliefs, values, touching)


def _compute_line_envelope(vectors: Reals, budget: Budget) -> UpperEnvelope:
    """Return the upper envelope for two states, where each vector is a line, in order of slope."""
    budget.check_memory(96.0 * len(vectors))
    budget.spend_work(ARRAY_CALL_WORK + 100 * len(vectors))
    lines: list[Line] = [(*end_values, index) for index, end_values in enumerate(vectors.tolist())]
    lines.sort(key=lambda line: (line[1] - line[0], line[0]))
    upper_lines: list[Line] = []
    for line in lines:
        if not upper_lines or line[1] > upper_lines[-1][1]:
            while (
                upper_lines
                and _compute_rise_above_neighbors(upper_lines[-2:-1], upper_lines[-1], [line])
                <= 0.0
            ):
                upper_lines.pop()
            upper_lines.append(line)
    _drop_negligible_lines(upper_lines)
    crossings = np.array([0.0, *itertools.starmap(_find_crossing, pairwise(upper_lines)), 1.0])
    beliefs = np.stack([1.0 - crossings, crossings], axis=1)
    chosen = np.array([line[2] for line in upper_lines])
    values = (beliefs * vectors[[*chosen, chosen[-1]]]).sum(axis=1)
    corner = np.arange(len(crossings))[:, None]
    index = np.arange(len(upper_lines))
    order = np.argsort(chosen)
    touching = (corner == index) | (corner == index + 1)
    return UpperEnvelope(chosen[order], beliefs, values, touching[:, order])


def _drop_negligible_lines(lines: list[Line]) -> None:
    """Delete lines that rise above their neighbors' crossing by at most the tolerance, in place."""
    rises = [_compute_rise_of_line(index, lines) for index in range(len(lines))]
    while min(rises) <= BORDER_TOLERANCE:
        lowest = rises.index(min(rises))
        del lines[lowest], rises[lowest]
        for index in range(max(lowest - 1, 0), min(lowest + 1, len(lines))):
            rises[index] = _compute_rise_of_line(index, lines)


def _compute_rise_of_line(index: int, lines: list[Line]) -> float:
    """Return the height of the line at an index above the crossing of its neighbors."""
    return _compute_rise_above_neighbors(
        lines[max(index - 1, 0) : index], lines[index], lines[index + 1 : index + 2]
    )


def _compute_rise_above_neighbors(
    previous_line: list[Line], line: Line, next_line: list[Line]
) -> float:
    """Return the height of a line above the crossing of its neighbors; inf without neighbors.

    The neighbors are lists of at most one line. With one neighbor, the height is that at the end of
    the line's side.
    """
    if not (previous_line or next_line):
        return math.inf
    position = 1.0 if previous_line else 0.0
    if previous_line and next_line:
        position = _find_crossing(previous_line[0], next_line[0])
    neighbor = (previous_line or next_line)[0]
    return (1.0 - position) * (line[0] - neighbor[0]) + position * (line[1] - neighbor[1])


def _find_crossing(first: Line, second: Line) -> float:
    """Return the probability of the second state at which the second, steeper line gets greater."""
    first_lead, second_lead = first[0] - second[0], second[1] - first[1]
    return first_lead / (first_lead + second_lead)


def _normalize_beliefs(cone: Cone) -> Cone:
    """Return the same cone with each ray scaled so that its belief sums to 1."""
    totals = cone.rays[:, :-1].sum(axis=1, keepdims=True)
    totals[totals <= 0] = 1.0
    return Cone(cone.rays / totals, cone.tight_borders)
