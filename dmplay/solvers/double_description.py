"""The corners of a polyhedral cone, found by cutting it with one half-space after another.

The double description method (Motzkin and others, 1953): of the rays that span a cone each
half-space keeps those on its side, and adds one where an edge crosses its border.
"""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Bools, Ints, Reals

BORDER_TOLERANCE = 1e-10  # a ray this close to a border lies on it


class Cone(NamedTuple):
    """The extreme rays of a cone, and on which of its borders each of them lies."""

    rays: Reals  # [N, d]
    tight_borders: Bools  # [N, M]


def make_simplicial_cone(rays: Reals) -> Cone:
    """The cone spanned by `d` independent rays `[d, d]`; border k lies opposite to ray k."""
    return Cone(rays, ~np.eye(len(rays), dtype=bool))


def cut_cone(cone: Cone, normal: Reals, budget: Budget | None = None) -> Cone:
    """The part of a cone where `normal @ x >= 0`; its border comes last."""
    budget = budget or Budget("a cone", "try fewer half-spaces")
    gap = cone.rays @ normal
    border = np.abs(gap) <= BORDER_TOLERANCE
    kept = gap >= -BORDER_TOLERANCE
    (inside,), (outside,) = (gap > BORDER_TOLERANCE).nonzero(), (~kept).nonzero()
    i, j, common = _find_crossing_edges(cone, inside, outside, budget)
    share = (gap[i] / (gap[i] - gap[j]))[:, None]
    crossings = (1.0 - share) * cone.rays[i] + share * cone.rays[j]
    rays = np.concatenate([cone.rays[kept], crossings])
    tight = np.ones((len(rays), cone.tight_borders.shape[1] + 1), bool)
    old = len(rays) - len(i)
    tight[:old, :-1], tight[:old, -1], tight[old:, :-1] = (
        cone.tight_borders[kept],
        border[kept],
        common,
    )
    return Cone(rays, tight)


def _find_crossing_edges(
    cone: Cone, inside: Ints, outside: Ints, budget: Budget
) -> tuple[Ints, Ints, Bools]:
    """The pairs of rays that span an edge, and the borders `[pairs, M]` that it lies on.

    Two rays do when no third one lies on all the borders that they share.
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
    """Which borders `[M]` are needed: those whose rays do not all lie on another one too."""
    on = cone.tight_borders.astype(float)
    inside = (on.T @ (1.0 - on)) == 0
    np.fill_diagonal(inside, False)
    return np.asarray(~inside.any(axis=1))
