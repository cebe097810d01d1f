"""What is likely in the middle of a joint plan: where each agent is in its own, and what is so.

Histories that leave an agent the same expectations of the state and of all others are one node: no
joint plan loses by it (lossless clustering; Oliehoek, Whiteson and Spaan, AAMAS 2009).
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dmplay.chance import Ints, Reals
from dmplay.solvers.team import CERTAIN


class Occupancy(NamedTuple):
    """The J joint nodes that can be, each with its pooled belief."""

    nodes: Ints  # [J, n]
    belief: Ints  # [J], the place of what all agents' observations together say
    p: Reals  # [J]

    @property
    def counts(self) -> tuple[int, ...]:
        """How many nodes each agent has."""
        return tuple((self.nodes.max(axis=0) + 1).tolist())

    @property
    def key(self) -> bytes:
        """The same for occupancies that are equal."""
        shares = np.round(self.p, CERTAIN) + 0.0
        return self.nodes.tobytes() + self.belief.tobytes() + shares.tobytes()


class Merged(NamedTuple):
    """An occupancy of fewer nodes, and which of them stands for each of before."""

    occupancy: Occupancy
    place: list[Ints]  # [K before] of each agent, -1 where nobody comes


def merged(occupancy: Occupancy, counts: tuple[int, ...]) -> Merged:
    """One node for all histories that promise the same, in an order that depends on it alone."""
    place = []
    for seat, many in enumerate(counts):
        come, own = np.unique(occupancy.nodes[:, seat], return_inverse=True)
        occupancy = _renamed(occupancy, seat, own.reshape(-1))
        place.append(np.full(many, -1))
        place[seat][come] = np.arange(len(come))
    seat = same = 0
    while same < len(counts):
        alike = _alike(occupancy, seat)
        same = same + 1 if alike.max() + 1 == len(alike) else 1
        if same == 1:
            occupancy = _summed(_renamed(occupancy, seat, alike[occupancy.nodes[:, seat]]))
            place[seat] = _through(alike, place[seat])
        seat = (seat + 1) % len(counts)
    for seat in range(len(counts)):
        order = _order(occupancy, seat)
        occupancy = _renamed(occupancy, seat, order[occupancy.nodes[:, seat]])
        place[seat] = _through(order, place[seat])
    return Merged(_summed(occupancy), place)


def _through(names: Ints, place: Ints) -> Ints:
    """The new names of the nodes that are places."""
    return np.where(place < 0, -1, names[place])


def _renamed(occupancy: Occupancy, seat: int, names: Ints) -> Occupancy:
    nodes = occupancy.nodes.copy()
    nodes[:, seat] = names
    return occupancy._replace(nodes=nodes)


def _summed(occupancy: Occupancy) -> Occupancy:
    """Each joint node once, in order."""
    cells = np.ravel_multi_index(tuple(occupancy.nodes.T), occupancy.counts)
    _, first, place = np.unique(cells, return_index=True, return_inverse=True)
    p = np.bincount(place.reshape(-1), occupancy.p, len(first)).astype(float)
    return Occupancy(occupancy.nodes[first], occupancy.belief[first], p)


def _alike(occupancy: Occupancy, seat: int) -> Ints:
    """A name `[K]` for each node of an agent, the same for those that promise the same."""
    nodes, belief, p = occupancy
    order = np.lexsort([*np.delete(nodes, seat, axis=1).T[::-1], nodes[:, seat]])
    own, others = nodes[order, seat], np.delete(nodes[order], seat, axis=1)
    mass = np.bincount(own, p[order])
    shares = np.round(p[order] / mass[own], CERTAIN) + 0.0
    belief = belief[order]
    names: dict[bytes, int] = {}
    ends = np.searchsorted(own, np.arange(len(mass) + 1)).tolist()
    return np.array([
        names.setdefault(
            others[a:b].tobytes() + belief[a:b].tobytes() + shares[a:b].tobytes(), len(names)
        )
        for a, b in pairwise(ends)
    ])  # fmt: skip


def _order(occupancy: Occupancy, seat: int) -> Ints:
    """The rank `[K]` of each node of an agent by what it meets."""
    own, shares = occupancy.nodes[:, seat], np.round(occupancy.p, CERTAIN)
    order = np.lexsort([shares, occupancy.belief, own])
    ends = np.searchsorted(own[order], np.arange(own.max() + 2)).tolist()
    met = [
        (occupancy.belief[order[a:b]].tolist(), shares[order[a:b]].tolist())
        for a, b in pairwise(ends)
    ]
    rank = np.empty(len(met), np.int64)
    rank[sorted(range(len(met)), key=met.__getitem__)] = np.arange(len(met))
    return rank
