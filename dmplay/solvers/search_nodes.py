"""The nodes of a search: what is known of them, what is tried there, and what follows."""

from collections.abc import Iterator

import numpy as np

from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Interval, Outcome
from dmplay.solvers.search_tree import GOLDEN_RATIO, SearchConfig, SearchRequest

ACTIONS_PER_HALVING = 4  # actions near the best after which the next are twice as near
MAX_SORTED_BOUNDS = 20_000  # bounds that are sorted in one go
FULL_SORT_FACTOR = 8  # times as many numbers as are wanted are quicker sorted than sifted first


class TreeBatch:
    """The trees of a batch, one a row, as they grow."""

    def __init__(self, config: SearchConfig, request: SearchRequest) -> None:
        self.config = config
        rows = len(request.turns_left)
        self.nodes_per_tree = config.nodes_per_tree
        many, slots = rows * self.nodes_per_tree, config.action_slots
        self.visits = np.zeros((many, slots))
        self.return_sums = np.zeros((many, slots))
        self.children = np.zeros(
            (many, slots * config.observation_slots), np.int64
        )  # 0, a root, where none is
        self.next_free_nodes = np.arange(rows) * self.nodes_per_tree + 1
        self.min_returns, self.max_returns = np.full(rows, np.inf), np.full(rows, -np.inf)
        if config.widens_actions:
            self.offered_counts = np.zeros(many, np.int64)
            self.offered_actions = np.zeros(
                (many, slots), config.suggest_actions(np.zeros(1, np.int64)).dtype
            )
            self.suggestion_counts = np.zeros(many, np.int64)
        if not config.observation_count:
            self.observation_keys = np.zeros(
                (many * slots, config.observation_slots), np.int64
            )  # of each edge
            self.observation_counts = np.zeros(many * slots, np.int64)  # how many of them
            if config.stores_states:
                self.node_states = np.empty(
                    (many, *request.root_states.shape[2:]), request.root_states.dtype
                )
                self.node_rewards = np.zeros(many)

    @property
    def node_arrays(self) -> list[Array]:
        """What is known of each node by itself."""
        parts: list[Array] = [self.visits, self.return_sums]
        parts += (
            [self.offered_counts, self.offered_actions, self.suggestion_counts]
            if self.config.widens_actions
            else []
        )
        return parts + ([self.node_states, self.node_rewards] if self.config.stores_states else [])

    def find_unopened_lanes(self, node: Ints) -> Ints:
        """The first lane `[K]` in each node that offers nothing yet."""
        new = np.flatnonzero(self.offered_counts[node] == 0)
        return np.asarray(new[np.unique(node[new], return_index=True)[1]])

    def offer_actions(self, node: Ints, action: Array) -> None:
        """Has these nodes, which offer nothing yet, offer an action each."""
        self.offered_actions[node, 0] = action
        self.offered_counts[node] = 1

    def select_slots(self, node: Ints, legal_actions_mask: Bools | None) -> tuple[Ints, Ints]:
        """The slots `[N]` of greatest bound, and how often each was chosen before.

        Lanes at one node choose as if one after another: as a bound falls with each visit, the
        first m choices are the m greatest bounds.
        """
        order = np.argsort(node, kind="stable")
        nodes = node[order]
        first = _mark_changes(nodes)
        start, lanes = np.flatnonzero(first), np.bincount(np.cumsum(first) - 1)
        here = nodes[start]
        able = None if legal_actions_mask is None else legal_actions_mask[order[start]]
        if self.config.widens_actions:
            self._widen_actions(here, lanes, able)
            offers = self.offered_counts[here]
            able = np.arange(offers.max()) < offers[:, None]
        chosen, nth = np.empty(len(node), np.int64), np.empty(len(node), np.int64)
        for some, most in self._group_by_lane_count(lanes):
            mine = None if able is None else able[some]
            slots, before = self._select_greatest_bounds(here[some], lanes[some], most, mine)
            rank = np.arange(most)
            taken = rank < lanes[some][:, None]
            at = order[(start[some][:, None] + rank)[taken]]
            chosen[at], nth[at] = slots[taken], before[taken]
        return chosen, nth

    def _group_by_lane_count(self, lanes: Ints) -> Iterator[tuple[Ints | slice, int]]:
        """Nodes with about as many lanes each `[H]`, and how many at most."""
        most = int(lanes.max())
        if len(lanes) * most * self.config.action_slots <= MAX_SORTED_BOUNDS or lanes.min() == most:
            yield slice(None), most
            return
        size = np.ceil(np.log2(lanes)).astype(np.int64)
        for one in np.unique(size):
            some = np.flatnonzero(size == one)
            yield some, int(lanes[some].max())

    def _select_greatest_bounds(
        self, nodes: Ints, lanes: Ints, max_lanes: int, legal_actions_mask: Bools | None
    ) -> tuple[Ints, Ints]:
        """The slots `[H, most]` that follow one another, and their visits before."""
        slots = (
            self.config.action_slots if legal_actions_mask is None else legal_actions_mask.shape[1]
        )
        visits, row = self.visits[nodes, :slots], nodes // self.nodes_per_tree
        span = np.maximum(self.max_returns[row] - self.min_returns[row], 1e-9)[:, None]
        with np.errstate(invalid="ignore"):  # before the first return the least is infinite
            means = self.return_sums[nodes, :slots] / np.maximum(visits, 1)
            scaled = (means - self.min_returns[row][:, None]) / span
        worth = np.where(visits > 0, scaled, 0.5)
        n = visits[:, :, None] + np.arange(max_lanes)
        total = np.log(visits.sum(axis=1) + lanes + 1)[:, None, None]
        bound = worth[:, :, None] + self.config.ucb_constant * np.sqrt(total / np.maximum(n, 1))
        bound[n == 0] = np.inf
        if legal_actions_mask is not None:
            bound[~legal_actions_mask] = -np.inf
        flat = bound.reshape(len(nodes), -1)
        best = (
            np.argmax(flat, axis=1)[:, None] if max_lanes == 1 else _find_largest(flat, max_lanes)
        )
        slots = best // max_lanes
        before = visits[np.arange(len(nodes))[:, None], slots].astype(np.int64) + best % max_lanes
        return slots, before

    def _widen_actions(self, nodes: Ints, lanes: Ints, legal_actions_mask: Bools | None) -> None:
        """Offers more actions where there were visits enough."""
        visits = self.visits[nodes].sum(axis=1) + lanes
        wanted = np.minimum(np.ceil(np.sqrt(visits)).astype(np.int64), self.config.action_slots)
        while True:
            more = wanted - self.offered_counts[nodes]
            if self.config.action_count:
                more = np.minimum(more, self.config.action_count - self.suggestion_counts[nodes])
            short = np.flatnonzero(more > 0)
            if not len(short):
                return
            self._try_actions(
                nodes[short],
                more[short],
                None if legal_actions_mask is None else legal_actions_mask[short],
            )

    def _try_actions(
        self, nodes: Ints, action_count: Ints, legal_actions_mask: Bools | None
    ) -> None:
        """Tries the next so many actions `[H]` of nodes: offers those that are new and allowed."""
        nth = np.arange(action_count.max())
        place = self.suggestion_counts[nodes][:, None] + nth
        new = nth < action_count[:, None]
        if self.config.action_count:
            action = self.config.suggest_actions(place)
            new &= (self.offered_actions[nodes, :1] != action) | (
                self.offered_counts[nodes, None] == 0
            )
            if legal_actions_mask is not None:
                new &= np.take_along_axis(legal_actions_mask, action, axis=1)
        else:
            action = self._suggest_near_best(nodes, place)
        slot = self.offered_counts[nodes][:, None] + np.cumsum(new, axis=1) - 1
        node, which = np.nonzero(new)
        self.offered_actions[nodes[node], slot[node, which]] = action[node, which]
        self.offered_counts[nodes] += new.sum(axis=1)
        self.suggestion_counts[nodes] += action_count

    def _suggest_near_best(self, nodes: Ints, positions: Ints) -> Array:
        """The next numbers to try: evenly spread ones, and between them some near the best."""
        tree = self.config
        own = tree.problem.actions[tree.seat]
        assert isinstance(own, Interval)
        visits = self.visits[nodes]
        mean = np.where(visits > 0, self.return_sums[nodes] / np.maximum(visits, 1), -np.inf)
        best = self.offered_actions[nodes, np.argmax(mean, axis=1)][:, None]
        far = (own.high - own.low) * 0.5 ** (1 + positions / ACTIONS_PER_HALVING)
        near = own.clip_actions(best + far * (2 * (positions * GOLDEN_RATIO % 1.0) - 1))
        visited = visits.any(axis=1, keepdims=True)
        return np.where((positions % 2 == 1) & visited, near, tree.suggest_actions(positions))

    def find_or_add_child(self, node: Ints, edge: Ints) -> tuple[Ints, Bools]:
        """The node that each lane comes to, and whether it was there before this turn."""
        child = self.children[node, edge]
        known = child > 0
        new = np.flatnonzero(~known)
        if len(new):
            keys = node[new] * self.children.shape[1] + edge[new]
            new = new[np.argsort(keys, kind="stable")]
            first = _mark_changes(edge[new]) | _mark_changes(node[new])
            one = new[first]
            fresh = self._add_nodes(node[one])
            self.children[node[one], edge[one]] = fresh
            child[new] = fresh[np.cumsum(first) - 1]
        return child, known

    def _add_nodes(self, parents: Ints) -> Ints:
        """New nodes below these `[N]`, which rise."""
        row = parents // self.nodes_per_tree
        fresh = self.next_free_nodes[row] + np.arange(len(row)) - np.searchsorted(row, row)
        np.add.at(self.next_free_nodes, row, 1)
        return np.asarray(fresh)

    def find_or_widen_child(
        self, node: Ints, slot: Ints, key: Ints, u: Reals, outcome: Outcome
    ) -> tuple[Ints, Bools]:
        """The same where an edge tells few things apart: what is new may count as one of them."""
        edge = node * self.config.action_slots + slot
        before = self.observation_counts[edge]
        place, known = self._find_observation_slots(edge, key)
        new = np.flatnonzero(~known)
        if len(new):
            self._widen_observations(node, edge, key, new, outcome)
            place[new], found = self._find_observation_slots(edge[new], key[new])
            other = (u[new] * self.observation_counts[edge[new]]).astype(np.int64)
            place[new] = np.where(found, place[new], other)
        return self.children.reshape(-1, self.config.observation_slots)[edge, place], place < before

    def _find_observation_slots(self, edge: Ints, key: Ints) -> tuple[Ints, Bools]:
        """Where each edge has a thing seen, and whether it has it."""
        each = np.arange(self.config.observation_slots)
        fits = (self.observation_keys[edge] == key[:, None]) & (
            each < self.observation_counts[edge][:, None]
        )
        return np.argmax(fits, axis=1), fits.any(axis=1)

    def _widen_observations(
        self, node: Ints, edge: Ints, key: Ints, new_lanes: Ints, outcome: Outcome
    ) -> None:
        """Makes nodes of the new things seen, as many as the visits of an edge allow."""
        used, lanes = np.unique(edge, return_counts=True)
        order = new_lanes[np.lexsort((key[new_lanes], edge[new_lanes]))]
        lane = order[_mark_changes(edge[order]) | _mark_changes(key[order])]  # one for each thing
        at = edge[lane]
        place = self.observation_counts[at] + np.arange(len(at)) - np.searchsorted(at, at)
        visits = self.visits.reshape(-1)[at] + lanes[np.searchsorted(used, at)]
        made = place < np.minimum(np.ceil(np.sqrt(visits)), self.config.observation_slots)
        lane, at, place = lane[made], at[made], place[made]
        fresh = self._add_nodes(node[lane])
        self.children.reshape(-1, self.config.observation_slots)[at, place] = fresh
        self.observation_keys[at, place] = key[lane]
        np.add.at(self.observation_counts, at, 1)
        if self.config.stores_states:
            self.node_states[fresh] = outcome.state[lane]
            self.node_rewards[fresh] = outcome.rewards[lane, self.config.seat]

    def add_returns(self, node: Ints, slot: Ints, returns: Reals) -> None:
        """Adds the returns `[N]` of what was done in these nodes."""
        row = node // self.nodes_per_tree
        np.add.at(self.visits, (node, slot), 1)
        np.add.at(self.return_sums, (node, slot), returns)
        np.minimum.at(self.min_returns, row, returns)
        np.maximum.at(self.max_returns, row, returns)


def _mark_changes(ordered: Ints) -> Bools:
    """Which of these differ from the one before; the first does."""
    changes = np.ones(len(ordered), bool)
    np.not_equal(ordered[1:], ordered[:-1], out=changes[1:])
    return changes


def _find_largest(numbers: Reals, largest_count: int) -> Ints:
    """The places `[H, many]` of the largest of each row, falling; of equal ones the first."""
    if numbers.shape[1] <= FULL_SORT_FACTOR * largest_count:
        return np.argsort(-numbers, axis=1, kind="stable")[:, :largest_count]
    least = np.partition(numbers, -largest_count, axis=1)[:, -largest_count, None]
    row, place = np.nonzero(numbers >= least)
    order = np.lexsort((-numbers[row, place], row))
    start = np.searchsorted(row, np.arange(len(numbers)))
    return np.asarray(place[order][start[:, None] + np.arange(largest_count)])
