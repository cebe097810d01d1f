"""Occupancy states: distributions over the joint nodes of a joint plan and over beliefs.

Histories of an agent that imply the same expectations of the state and of all other agents are
merged into one node. No joint plan loses value by it (lossless clustering; Oliehoek, Whiteson and
Spaan, AAMAS 2009).
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.solvers.decpomdp.dec_pomdp_model import PROBABILITY_DECIMALS


class OccupancyState(NamedTuple):
    """The J joint nodes of positive probability, each with its pooled belief.

    The pooled belief is that of all agents' observations together.
    """

    joint_nodes: Ints  # [J, n], a node of each agent
    belief_indices: Ints  # [J], index of the belief given all agents' observations
    probabilities: Reals  # [J]

    @property
    def node_counts(self) -> tuple[int, ...]:
        """The number of nodes of each agent."""
        return tuple((self.joint_nodes.max(axis=0) + 1).tolist())

    @property
    def key(self) -> bytes:
        """A key that is equal for equal occupancy states."""
        shares = np.round(self.probabilities, PROBABILITY_DECIMALS) + 0.0
        return self.joint_nodes.tobytes() + self.belief_indices.tobytes() + shares.tobytes()


class MergedOccupancy(NamedTuple):
    """An occupancy state with merged nodes, and the merged node of each former node."""

    occupancy: OccupancyState
    merged_nodes: list[Ints]  # [K before] of each agent; -1 for nodes of probability 0


def merge_equivalent_histories(
    occupancy: OccupancyState, node_counts: tuple[int, ...]
) -> MergedOccupancy:
    """Merge equivalent histories of each agent, and number the nodes in a canonical order."""
    merged_nodes = []
    for seat, node_count in enumerate(node_counts):
        present, new_numbers = np.unique(occupancy.joint_nodes[:, seat], return_inverse=True)
        occupancy = _rename_nodes(occupancy, seat, new_numbers.reshape(-1))
        merged_nodes.append(np.full(node_count, -1))
        merged_nodes[seat][present] = np.arange(len(present))
    seat = unchanged_count = 0
    while unchanged_count < len(node_counts):
        labels = _label_equivalent_nodes(occupancy, seat)
        unchanged_count = unchanged_count + 1 if labels.max() + 1 == len(labels) else 1
        if unchanged_count == 1:
            occupancy = _rename_nodes(occupancy, seat, labels[occupancy.joint_nodes[:, seat]])
            occupancy = _merge_equal_joint_nodes(occupancy)
            merged_nodes[seat] = _translate_nodes(labels, merged_nodes[seat])
        seat = (seat + 1) % len(node_counts)
    for seat in range(len(node_counts)):
        ranks = _rank_nodes(occupancy, seat)
        occupancy = _rename_nodes(occupancy, seat, ranks[occupancy.joint_nodes[:, seat]])
        merged_nodes[seat] = _translate_nodes(ranks, merged_nodes[seat])
    return MergedOccupancy(_merge_equal_joint_nodes(occupancy), merged_nodes)


def _translate_nodes(new_names: Ints, places: Ints) -> Ints:
    """Return the nodes under their new names; -1 stays."""
    return np.where(places < 0, -1, new_names[places])


def _rename_nodes(occupancy: OccupancyState, seat: int, new_names: Ints) -> OccupancyState:
    """Return the occupancy state with an agent's nodes renamed."""
    nodes = occupancy.joint_nodes.copy()
    nodes[:, seat] = new_names
    return occupancy._replace(joint_nodes=nodes)


def _merge_equal_joint_nodes(occupancy: OccupancyState) -> OccupancyState:
    """Return the occupancy state with each joint node once, in sorted order."""
    cells = np.ravel_multi_index(tuple(occupancy.joint_nodes.T), occupancy.node_counts)
    _, first, inverse = np.unique(cells, return_index=True, return_inverse=True)
    p = np.bincount(inverse.reshape(-1), occupancy.probabilities, len(first)).astype(float)
    return OccupancyState(occupancy.joint_nodes[first], occupancy.belief_indices[first], p)


def _label_equivalent_nodes(occupancy: OccupancyState, seat: int) -> Ints:
    """Return a label `[K]` for each node of an agent, equal for equivalent nodes."""
    nodes, belief_indices, p = occupancy
    order = np.lexsort([*np.delete(nodes, seat, axis=1).T[::-1], nodes[:, seat]])
    seat_nodes, others = nodes[order, seat], np.delete(nodes[order], seat, axis=1)
    mass = np.bincount(seat_nodes, p[order])
    shares = np.round(p[order] / mass[seat_nodes], PROBABILITY_DECIMALS) + 0.0
    belief_indices = belief_indices[order]
    labels: dict[bytes, int] = {}
    ends = np.searchsorted(seat_nodes, np.arange(len(mass) + 1)).tolist()
    keys = (
        b"".join(array[a:b].tobytes() for array in (others, belief_indices, shares))
        for a, b in pairwise(ends)
    )
    return np.array([labels.setdefault(key, len(labels)) for key in keys])


def _rank_nodes(occupancy: OccupancyState, seat: int) -> Ints:
    """Return the rank `[K]` of each node of an agent by its beliefs and their probabilities."""
    seat_nodes = occupancy.joint_nodes[:, seat]
    shares = np.round(occupancy.probabilities, PROBABILITY_DECIMALS)
    order = np.lexsort([shares, occupancy.belief_indices, seat_nodes])
    ends = np.searchsorted(seat_nodes[order], np.arange(seat_nodes.max() + 2)).tolist()
    signatures = [
        (occupancy.belief_indices[order[a:b]].tolist(), shares[order[a:b]].tolist())
        for a, b in pairwise(ends)
    ]
    rank = np.empty(len(signatures), np.int64)
    rank[sorted(range(len(signatures)), key=signatures.__getitem__)] = np.arange(len(signatures))
    return rank
