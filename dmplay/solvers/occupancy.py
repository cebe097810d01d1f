"""What is likely in the middle of a joint plan: where each agent is in its own, and what is so.

Histories that leave an agent the same expectations of the state and of all others are one node: no
joint plan loses by it (lossless clustering; Oliehoek, Whiteson and Spaan, AAMAS 2009).
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dmplay.chance import Ints, Reals
from dmplay.solvers.team import PROBABILITY_DECIMALS


class OccupancyState(NamedTuple):
    """The J joint nodes that can be, each with its pooled belief."""

    joint_nodes: Ints  # [J, n]
    belief_indices: Ints  # [J], the place of what all agents' observations together say
    probabilities: Reals  # [J]

    @property
    def node_counts(self) -> tuple[int, ...]:
        """How many nodes each agent has."""
        return tuple((self.joint_nodes.max(axis=0) + 1).tolist())

    @property
    def key(self) -> bytes:
        """The same for occupancies that are equal."""
        shares = np.round(self.probabilities, PROBABILITY_DECIMALS) + 0.0
        return self.joint_nodes.tobytes() + self.belief_indices.tobytes() + shares.tobytes()


class MergedOccupancy(NamedTuple):
    """An occupancy of fewer nodes, and which of them stands for each of before."""

    occupancy: OccupancyState
    merged_nodes: list[Ints]  # [K before] of each agent, -1 where nobody comes


def merge_equivalent_histories(
    occupancy: OccupancyState, node_counts: tuple[int, ...]
) -> MergedOccupancy:
    """One node for all histories that promise the same, in an order that depends on it alone."""
    place = []
    for seat, many in enumerate(node_counts):
        come, own = np.unique(occupancy.joint_nodes[:, seat], return_inverse=True)
        occupancy = _rename_nodes(occupancy, seat, own.reshape(-1))
        place.append(np.full(many, -1))
        place[seat][come] = np.arange(len(come))
    seat = same = 0
    while same < len(node_counts):
        alike = _label_equivalent_nodes(occupancy, seat)
        same = same + 1 if alike.max() + 1 == len(alike) else 1
        if same == 1:
            occupancy = _merge_equal_joint_nodes(
                _rename_nodes(occupancy, seat, alike[occupancy.joint_nodes[:, seat]])
            )
            place[seat] = _rename_places(alike, place[seat])
        seat = (seat + 1) % len(node_counts)
    for seat in range(len(node_counts)):
        order = _rank_nodes(occupancy, seat)
        occupancy = _rename_nodes(occupancy, seat, order[occupancy.joint_nodes[:, seat]])
        place[seat] = _rename_places(order, place[seat])
    return MergedOccupancy(_merge_equal_joint_nodes(occupancy), place)


def _rename_places(new_names: Ints, places: Ints) -> Ints:
    """The new names of the nodes that are places."""
    return np.where(places < 0, -1, new_names[places])


def _rename_nodes(occupancy: OccupancyState, seat: int, new_names: Ints) -> OccupancyState:
    nodes = occupancy.joint_nodes.copy()
    nodes[:, seat] = new_names
    return occupancy._replace(joint_nodes=nodes)


def _merge_equal_joint_nodes(occupancy: OccupancyState) -> OccupancyState:
    """Each joint node once, in order."""
    cells = np.ravel_multi_index(tuple(occupancy.joint_nodes.T), occupancy.node_counts)
    _, first, place = np.unique(cells, return_index=True, return_inverse=True)
    p = np.bincount(place.reshape(-1), occupancy.probabilities, len(first)).astype(float)
    return OccupancyState(occupancy.joint_nodes[first], occupancy.belief_indices[first], p)


def _label_equivalent_nodes(occupancy: OccupancyState, seat: int) -> Ints:
    """A name `[K]` for each node of an agent, the same for those that promise the same."""
    nodes, belief, p = occupancy
    order = np.lexsort([*np.delete(nodes, seat, axis=1).T[::-1], nodes[:, seat]])
    own, others = nodes[order, seat], np.delete(nodes[order], seat, axis=1)
    mass = np.bincount(own, p[order])
    shares = np.round(p[order] / mass[own], PROBABILITY_DECIMALS) + 0.0
    belief = belief[order]
    names: dict[bytes, int] = {}
    ends = np.searchsorted(own, np.arange(len(mass) + 1)).tolist()
    return np.array([
        names.setdefault(
            others[a:b].tobytes() + belief[a:b].tobytes() + shares[a:b].tobytes(), len(names)
        )
        for a, b in pairwise(ends)
    ])  # fmt: skip


def _rank_nodes(occupancy: OccupancyState, seat: int) -> Ints:
    """The rank `[K]` of each node of an agent by what it meets."""
    own, shares = (
        occupancy.joint_nodes[:, seat],
        np.round(occupancy.probabilities, PROBABILITY_DECIMALS),
    )
    order = np.lexsort([shares, occupancy.belief_indices, own])
    ends = np.searchsorted(own[order], np.arange(own.max() + 2)).tolist()
    met = [
        (occupancy.belief_indices[order[a:b]].tolist(), shares[order[a:b]].tolist())
        for a, b in pairwise(ends)
    ]
    rank = np.empty(len(met), np.int64)
    rank[sorted(range(len(met)), key=met.__getitem__)] = np.arange(len(met))
    return rank
