"""The nodes of a search: what is known of them, what is tried there, and what follows."""

from collections.abc import Iterator

import numpy as np

from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Interval, Outcome
from dmplay.solvers.search_tree import GOLDEN, Asked, Tree

HALVED = 4  # actions near the best after which the next are twice as near
SORTED = 20_000  # bounds that are sorted in one go
SHARE = 8  # times as many numbers as are wanted are quicker sorted than sifted first


class Nodes:
    """The trees of a batch, one a row, as they grow."""

    def __init__(self, tree: Tree, asked: Asked) -> None:
        self.tree = tree
        rows = len(asked.left)
        self.nodes = tree.nodes
        many, slots = rows * self.nodes, tree.slots
        self.visits = np.zeros((many, slots))
        self.sums = np.zeros((many, slots))
        self.children = np.zeros((many, slots * tree.kinds), np.int64)  # 0, a root, where none is
        self.free = np.arange(rows) * self.nodes + 1
        self.low, self.high = np.full(rows, np.inf), np.full(rows, -np.inf)
        if tree.widens:
            self.offers = np.zeros(many, np.int64)
            self.offered = np.zeros((many, slots), tree.suggested(np.zeros(1, np.int64)).dtype)
            self.steps = np.zeros(many, np.int64)
        if not tree.seen:
            self.keys = np.zeros((many * slots, tree.kinds), np.int64)  # of each edge
            self.kin = np.zeros(many * slots, np.int64)  # how many of them
            if tree.places:
                self.kept = np.empty((many, *asked.roots.shape[2:]), asked.roots.dtype)
                self.paid = np.zeros(many)

    @property
    def known(self) -> list[Array]:
        """What is known of each node by itself."""
        parts: list[Array] = [self.visits, self.sums]
        parts += [self.offers, self.offered, self.steps] if self.tree.widens else []
        return parts + ([self.kept, self.paid] if self.tree.places else [])

    def fresh(self, node: Ints) -> Ints:
        """The first lane `[K]` in each node that offers nothing yet."""
        new = np.flatnonzero(self.offers[node] == 0)
        return np.asarray(new[np.unique(node[new], return_index=True)[1]])

    def offer(self, node: Ints, action: Array) -> None:
        """Has these nodes, which offer nothing yet, offer an action each."""
        self.offered[node, 0] = action
        self.offers[node] = 1

    def selected(self, node: Ints, legal: Bools | None) -> tuple[Ints, Ints]:
        """The slots `[N]` of greatest bound, and how often each was chosen before.

        Lanes at one node choose as if one after another: as a bound falls with each visit, the
        first m choices are the m greatest bounds.
        """
        order = np.argsort(node, kind="stable")
        nodes = node[order]
        first = _changes(nodes)
        start, lanes = np.flatnonzero(first), np.bincount(np.cumsum(first) - 1)
        here = nodes[start]
        able = None if legal is None else legal[order[start]]
        if self.tree.widens:
            self._widen(here, lanes, able)
            offers = self.offers[here]
            able = np.arange(offers.max()) < offers[:, None]
        chosen, nth = np.empty(len(node), np.int64), np.empty(len(node), np.int64)
        for some, most in self._alike(lanes):
            mine = None if able is None else able[some]
            slots, before = self._greatest(here[some], lanes[some], most, mine)
            rank = np.arange(most)
            taken = rank < lanes[some][:, None]
            at = order[(start[some][:, None] + rank)[taken]]
            chosen[at], nth[at] = slots[taken], before[taken]
        return chosen, nth

    def _alike(self, lanes: Ints) -> Iterator[tuple[Ints | slice, int]]:
        """Nodes with about as many lanes each `[H]`, and how many at most."""
        most = int(lanes.max())
        if len(lanes) * most * self.tree.slots <= SORTED or lanes.min() == most:
            yield slice(None), most
            return
        size = np.ceil(np.log2(lanes)).astype(np.int64)
        for one in np.unique(size):
            some = np.flatnonzero(size == one)
            yield some, int(lanes[some].max())

    def _greatest(
        self, here: Ints, lanes: Ints, most: int, able: Bools | None
    ) -> tuple[Ints, Ints]:
        """The slots `[H, most]` that follow one another, and their visits before."""
        slots = self.tree.slots if able is None else able.shape[1]
        visits, row = self.visits[here, :slots], here // self.nodes
        span = np.maximum(self.high[row] - self.low[row], 1e-9)[:, None]
        with np.errstate(invalid="ignore"):  # before the first return the least is infinite
            means = self.sums[here, :slots] / np.maximum(visits, 1)
            scaled = (means - self.low[row][:, None]) / span
        worth = np.where(visits > 0, scaled, 0.5)
        n = visits[:, :, None] + np.arange(most)
        total = np.log(visits.sum(axis=1) + lanes + 1)[:, None, None]
        bound = worth[:, :, None] + self.tree.exploration * np.sqrt(total / np.maximum(n, 1))
        bound[n == 0] = np.inf
        if able is not None:
            bound[~able] = -np.inf
        flat = bound.reshape(len(here), -1)
        best = np.argmax(flat, axis=1)[:, None] if most == 1 else _largest(flat, most)
        slots = best // most
        before = visits[np.arange(len(here))[:, None], slots].astype(np.int64) + best % most
        return slots, before

    def _widen(self, here: Ints, lanes: Ints, legal: Bools | None) -> None:
        """Offers more actions where there were visits enough."""
        visits = self.visits[here].sum(axis=1) + lanes
        wanted = np.minimum(np.ceil(np.sqrt(visits)).astype(np.int64), self.tree.slots)
        while True:
            more = wanted - self.offers[here]
            if self.tree.choices:
                more = np.minimum(more, self.tree.choices - self.steps[here])
            short = np.flatnonzero(more > 0)
            if not len(short):
                return
            self._try(here[short], more[short], None if legal is None else legal[short])

    def _try(self, at: Ints, many: Ints, legal: Bools | None) -> None:
        """Tries the next so many actions `[H]` of nodes: offers those that are new and allowed."""
        nth = np.arange(many.max())
        place = self.steps[at][:, None] + nth
        new = nth < many[:, None]
        if self.tree.choices:
            action = self.tree.suggested(place)
            new &= (self.offered[at, :1] != action) | (self.offers[at, None] == 0)
            if legal is not None:
                new &= np.take_along_axis(legal, action, axis=1)
        else:
            action = self._near(at, place)
        slot = self.offers[at][:, None] + np.cumsum(new, axis=1) - 1
        node, which = np.nonzero(new)
        self.offered[at[node], slot[node, which]] = action[node, which]
        self.offers[at] += new.sum(axis=1)
        self.steps[at] += many

    def _near(self, at: Ints, place: Ints) -> Array:
        """The next numbers to try: evenly spread ones, and between them some near the best."""
        tree = self.tree
        own = tree.problem.actions[tree.seat]
        assert isinstance(own, Interval)
        visits = self.visits[at]
        mean = np.where(visits > 0, self.sums[at] / np.maximum(visits, 1), -np.inf)
        best = self.offered[at, np.argmax(mean, axis=1)][:, None]
        far = (own.high - own.low) * 0.5 ** (1 + place / HALVED)
        near = own.nearest(best + far * (2 * (place * GOLDEN % 1.0) - 1))
        visited = visits.any(axis=1, keepdims=True)
        return np.where((place % 2 == 1) & visited, near, tree.suggested(place))

    def child(self, node: Ints, edge: Ints) -> tuple[Ints, Bools]:
        """The node that each lane comes to, and whether it was there before this turn."""
        child = self.children[node, edge]
        known = child > 0
        new = np.flatnonzero(~known)
        if len(new):
            keys = node[new] * self.children.shape[1] + edge[new]
            new = new[np.argsort(keys, kind="stable")]
            first = _changes(edge[new]) | _changes(node[new])
            one = new[first]
            fresh = self._fresh(node[one])
            self.children[node[one], edge[one]] = fresh
            child[new] = fresh[np.cumsum(first) - 1]
        return child, known

    def _fresh(self, above: Ints) -> Ints:
        """New nodes below these `[N]`, which rise."""
        row = above // self.nodes
        fresh = self.free[row] + np.arange(len(row)) - np.searchsorted(row, row)
        np.add.at(self.free, row, 1)
        return np.asarray(fresh)

    def one_of_some(
        self, node: Ints, slot: Ints, key: Ints, u: Reals, outcome: Outcome
    ) -> tuple[Ints, Bools]:
        """The same where an edge tells few things apart: what is new may count as one of them."""
        edge = node * self.tree.slots + slot
        before = self.kin[edge]
        place, known = self._placed(edge, key)
        new = np.flatnonzero(~known)
        if len(new):
            self._told_apart(node, edge, key, new, outcome)
            place[new], found = self._placed(edge[new], key[new])
            other = (u[new] * self.kin[edge[new]]).astype(np.int64)
            place[new] = np.where(found, place[new], other)
        return self.children.reshape(-1, self.tree.kinds)[edge, place], place < before

    def _placed(self, edge: Ints, key: Ints) -> tuple[Ints, Bools]:
        """Where each edge has a thing seen, and whether it has it."""
        each = np.arange(self.tree.kinds)
        fits = (self.keys[edge] == key[:, None]) & (each < self.kin[edge][:, None])
        return np.argmax(fits, axis=1), fits.any(axis=1)

    def _told_apart(self, node: Ints, edge: Ints, key: Ints, new: Ints, outcome: Outcome) -> None:
        """Makes nodes of the new things seen, as many as the visits of an edge allow."""
        used, lanes = np.unique(edge, return_counts=True)
        order = new[np.lexsort((key[new], edge[new]))]
        lane = order[_changes(edge[order]) | _changes(key[order])]  # one for each thing
        at = edge[lane]
        place = self.kin[at] + np.arange(len(at)) - np.searchsorted(at, at)
        visits = self.visits.reshape(-1)[at] + lanes[np.searchsorted(used, at)]
        made = place < np.minimum(np.ceil(np.sqrt(visits)), self.tree.kinds)
        lane, at, place = lane[made], at[made], place[made]
        fresh = self._fresh(node[lane])
        self.children.reshape(-1, self.tree.kinds)[at, place] = fresh
        self.keys[at, place] = key[lane]
        np.add.at(self.kin, at, 1)
        if self.tree.places:
            self.kept[fresh] = outcome.state[lane]
            self.paid[fresh] = outcome.rewards[lane, self.tree.seat]

    def learn(self, node: Ints, slot: Ints, gain: Reals) -> None:
        """Adds the returns `[N]` of what was done in these nodes."""
        row = node // self.nodes
        np.add.at(self.visits, (node, slot), 1)
        np.add.at(self.sums, (node, slot), gain)
        np.minimum.at(self.low, row, gain)
        np.maximum.at(self.high, row, gain)


def _changes(ordered: Ints) -> Bools:
    """Which of these differ from the one before; the first does."""
    changes = np.ones(len(ordered), bool)
    np.not_equal(ordered[1:], ordered[:-1], out=changes[1:])
    return changes


def _largest(numbers: Reals, many: int) -> Ints:
    """The places `[H, many]` of the largest of each row, falling; of equal ones the first."""
    if numbers.shape[1] <= SHARE * many:
        return np.argsort(-numbers, axis=1, kind="stable")[:, :many]
    least = np.partition(numbers, -many, axis=1)[:, -many, None]
    row, place = np.nonzero(numbers >= least)
    order = np.lexsort((-numbers[row, place], row))
    start = np.searchsorted(row, np.arange(len(numbers)))
    return np.asarray(place[order][start[:, None] + np.arange(many)])
