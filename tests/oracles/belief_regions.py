"""Regions in the triangle of beliefs over three states in which an action is best."""

from collections import Counter
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.errors import BadParameter
from dmplay.solvers.double_description import BORDER_TOLERANCE
from dmplay.solvers.pomdp.exact_pomdp import AlphaVectorStage
from dmplay.solvers.pomdp.upper_envelope import UpperEnvelope, compute_upper_envelope

Edge = frozenset[int]  # indices of two corners of the envelope


class Piece(NamedTuple):
    """A connected part of a region; parts that share a single point are separate pieces."""

    cells: tuple[int, ...]  # indices of the vectors that are best in the piece
    touches: frozenset[int]  # indices of the envelope's corners in the piece
    outline: Reals  # beliefs [K, 3] at which the border bends
    share: float  # share of the triangle's area


def find_pieces(stage: AlphaVectorStage, a: int) -> list[Piece]:
    """Return the pieces of the region where an action is best, largest first."""
    if stage.alpha_vectors.shape[1] != 3:
        raise BadParameter(f"got {stage.alpha_vectors.shape[1]} states, expected 3")
    cells = compute_upper_envelope(stage.alpha_vectors)
    rings = {
        k: _order_corners(cells, k) for k in np.flatnonzero(stage.first_action_mask[:, a]).tolist()
    }
    result = []
    while rings:
        piece = _grow_piece(rings, [min(rings)])
        result.append(_make_piece(cells, {k: rings.pop(k) for k in piece}))
    return sorted(result, key=lambda piece: -round(piece.share, 9))


def _order_corners(cells: UpperEnvelope, k: int) -> list[int]:
    """Return the corners of a cell in the order of a walk around it."""
    corners = np.flatnonzero(cells.touching_vectors[:, k])
    x, y = (cells.corner_beliefs[corners, :2] - cells.corner_beliefs[corners, :2].mean(axis=0)).T
    return [int(corner) for corner in corners[np.argsort(np.arctan2(y, x))]]


def _list_edges(ring: list[int]) -> list[Edge]:
    return [frozenset(pair) for pair in zip(ring, ring[1:] + ring[:1], strict=True)]


def _grow_piece(rings: dict[int, list[int]], piece: list[int]) -> list[int]:
    """Extend a piece with all cells that are connected to it by edges."""
    for k in piece:  # the list grows during the loop
        border = set(_list_edges(rings[k]))
        piece += [
            other
            for other in rings
            if other not in piece and border & set(_list_edges(rings[other]))
        ]
    return piece


def _make_piece(cells: UpperEnvelope, rings: dict[int, list[int]]) -> Piece:
    border = Counter(edge for ring in rings.values() for edge in _list_edges(ring))
    outside = [sorted(edge) for edge, edge_count in border.items() if edge_count == 1]
    bends = [
        corner
        for corner in _list_corners(outside)
        if _is_bend(cells.corner_beliefs, outside, corner)
    ]
    return Piece(
        tuple(rings),
        frozenset(corner for ring in rings.values() for corner in ring),
        cells.corner_beliefs[bends],
        sum(_triangle_share(cells.corner_beliefs[ring]) for ring in rings.values()),
    )


def _list_corners(edges: list[list[int]]) -> list[int]:
    return sorted({corner for edge in edges for corner in edge})


def _is_bend(beliefs: Reals, edges: list[list[int]], corner: int) -> bool:
    """Return whether the border bends at a corner, so that its two edges are not in line."""
    ends = np.array([b if a == corner else a for a, b in edges if corner in (a, b)])
    return len(ends) > 2 or _triangle_share(beliefs[[ends[0], corner, ends[1]]]) > BORDER_TOLERANCE


def _triangle_share(ring: Reals) -> float:
    """Return the area inside a ring of beliefs `[K, 3]` as a share of the triangle's area."""
    (x, y), (x2, y2) = ring[:, :2].T, np.roll(ring[:, :2], -1, axis=0).T
    return float(abs(np.sum(x * y2 - x2 * y)))
