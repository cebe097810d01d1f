"""Where in the triangle of beliefs over three states an action is best: pieces, outlines, areas."""

from collections import Counter
from typing import NamedTuple

import numpy as np

from dmplay.chance import Reals
from dmplay.errors import BadParameter
from dmplay.solvers.alpha_vectors import AlphaVectorStage
from dmplay.solvers.double_description import BORDER_TOLERANCE
from dmplay.solvers.envelope import UpperEnvelope, compute_upper_envelope

Edge = frozenset[int]  # two corners of the envelope


class Piece(NamedTuple):
    """A connected part of a region; parts that share no more than a point are two."""

    cells: tuple[int, ...]  # the vectors that are best in it
    touches: frozenset[int]  # the corners of the envelope in it
    outline: Reals  # [K, 3], where its border bends
    share: float  # of the area of the triangle


def pieces(stage: AlphaVectorStage, a: int) -> list[Piece]:
    """The pieces of the region where an action is best, largest first."""
    if stage.alpha_vectors.shape[1] != 3:
        raise BadParameter(f"got {stage.alpha_vectors.shape[1]} states, expected 3")
    cells = compute_upper_envelope(stage.alpha_vectors)
    rings = {k: _ring(cells, k) for k in np.flatnonzero(stage.first_action_mask[:, a]).tolist()}
    found = []
    while rings:
        piece = _grown(rings, [min(rings)])
        found.append(_piece(cells, {k: rings.pop(k) for k in piece}))
    return sorted(found, key=lambda piece: -round(piece.share, 9))


def _ring(cells: UpperEnvelope, k: int) -> list[int]:
    """The corners of a cell, in the order of a walk around it."""
    corners = np.flatnonzero(cells.touching_vectors[:, k])
    x, y = (cells.corner_beliefs[corners, :2] - cells.corner_beliefs[corners, :2].mean(axis=0)).T
    return [int(corner) for corner in corners[np.argsort(np.arctan2(y, x))]]


def _edges(ring: list[int]) -> list[Edge]:
    return [frozenset(pair) for pair in zip(ring, ring[1:] + ring[:1], strict=True)]


def _grown(rings: dict[int, list[int]], piece: list[int]) -> list[int]:
    """The cells that hang together with those of a piece by edges."""
    for k in piece:  # grows as it is walked
        border = set(_edges(rings[k]))
        piece += [o for o in rings if o not in piece and border & set(_edges(rings[o]))]
    return piece


def _piece(cells: UpperEnvelope, rings: dict[int, list[int]]) -> Piece:
    border = Counter(edge for ring in rings.values() for edge in _edges(ring))
    outside = [sorted(edge) for edge, times in border.items() if times == 1]
    bends = [
        corner for corner in _corners(outside) if _bends(cells.corner_beliefs, outside, corner)
    ]
    return Piece(
        tuple(rings),
        frozenset(corner for ring in rings.values() for corner in ring),
        cells.corner_beliefs[bends],
        sum(_share(cells.corner_beliefs[ring]) for ring in rings.values()),
    )


def _corners(edges: list[list[int]]) -> list[int]:
    return sorted({corner for edge in edges for corner in edge})


def _bends(beliefs: Reals, edges: list[list[int]], corner: int) -> bool:
    """Whether the border turns in a corner: the other ends of its edges do not lie opposite."""
    ends = np.array([b if a == corner else a for a, b in edges if corner in (a, b)])
    return len(ends) > 2 or _share(beliefs[[ends[0], corner, ends[1]]]) > BORDER_TOLERANCE


def _share(ring: Reals) -> float:
    """The area inside a ring of beliefs `[K, 3]`, as a share of the triangle's."""
    (x, y), (x2, y2) = ring[:, :2].T, np.roll(ring[:, :2], -1, axis=0).T
    return float(abs(np.sum(x * y2 - x2 * y)))
