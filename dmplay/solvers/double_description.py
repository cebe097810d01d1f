"""Extreme rays of a polyhedral cone by the double description method.

Source: Motzkin and others, 1953. Rays may be fractions, as arrays of objects; then nothing is
rounded. The cone is cut by one half-space after another: the rays on its
side are kept, and a new ray is added where an edge of the cone crosses its border.
"""

from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Bools, Ints, Reals
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget

BORDER_TOLERANCE = 1e-10  # distance within which a ray lies on a border


class Cone(NamedTuple):
    """The N extreme rays of a cone with M borders, and the borders on which each ray lies."""

    rays: Reals  # [N, d]
    tight_borders: Bools  # [N, M]


def make_simplicial_cone(rays: Reals) -> Cone:
    """Return the cone spanned by `d` independent rays `[d, d]`; border k lies opposite to ray k."""
    return Cone(rays, ~np.eye(len(rays), dtype=bool))


def cut_cone(cone: Cone, normal: Reals, budget: Budget | None = None) -> Cone:
    """Return the part of a cone where `normal @ x >= 0`; the new border is the last one."""
    budget = budget or Budget("vertex enumeration", "try fewer half-spaces")
    distances = cone.rays @ normal
    tolerance = 0 if distances.dtype == object else BORDER_TOLERANCE
    on_border = np.abs(distances) <= tolerance
    is_kept = distances >= -tolerance
    (inside,), (outside,) = (distances > tolerance).nonzero(), (~is_kept).nonzero()
    i, j, common = _find_crossing_edges(cone, inside, outside, budget)
    weights = (distances[i] / (distances[i] - distances[j]))[:, None]
    crossings = (1 - weights) * cone.rays[i] + weights * cone.rays[j]
    rays = np.concatenate([cone.rays[is_kept], crossings])
    tight = np.ones((len(rays), cone.tight_borders.shape[1] + 1), bool)
    kept_count = len(rays) - len(i)
    tight[:kept_count, :-1] = cone.tight_borders[is_kept]
    tight[:kept_count, -1] = on_border[is_kept]
    tight[kept_count:, :-1] = common
    return Cone(rays, tight)


def _find_crossing_edges(
    cone: Cone, inside: Ints, outside: Ints, budget: Budget
) -> tuple[Ints, Ints, Bools]:
    """Return the edges that cross the new border, as pairs of rays with the borders they lie on.

    Returns the rays inside, the rays outside, and the mask `[pairs, M]` of borders. Two rays span
    an edge if no third ray lies on all the borders that they share.
    """
    rays, borders = cone.tight_borders.shape
    pairs = float(len(inside) * len(outside))
    budget.check_memory(pairs * (16 + 2 * borders))
    budget.spend_work(4 * ARRAY_CALL_WORK + pairs * (4 + borders))
    i, j = np.repeat(inside, len(outside)), outside[None].repeat(len(inside), axis=0).ravel()
    common = cone.tight_borders[i] & cone.tight_borders[j]
    enough = common.sum(axis=1) >= cone.rays.shape[1] - 2
    i, j, common = i[enough], j[enough], common[enough]
    budget.check_memory(8.0 * (len(i) * (borders + 2 * rays) + rays * borders))
    budget.spend_work(len(i) * rays * (2 + borders / 4) + rays * borders)
    missed = common.astype(float) @ (~cone.tight_borders).astype(float).T
    edge = (missed == 0).sum(axis=1) == 2
    return i[edge], j[edge], common[edge]


def find_facets(cone: Cone) -> Bools:
    """Return the mask `[M]` of borders that are facets of the cone.

    The rays on a facet do not all lie on another border too.
    """
    is_tight = cone.tight_borders.astype(float)
    is_contained = (is_tight.T @ (1.0 - is_tight)) == 0
    np.fill_diagonal(is_contained, False)
    return np.asarray(~is_contained.any(axis=1))
