"""A batch of search trees: action selection, widening, child lookup and return statistics."""

from collections.abc import Iterator

import numpy as np

from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.problem import Outcome
from dmplay.core.spaces import Interval
from dmplay.solvers.search.search_config import GOLDEN_RATIO, SearchConfig, SearchRequest

ACTIONS_PER_HALVING = 4  # suggestions near the best action after which their distance is halved
MIN_RETURN_SPAN = 1e-9  # of the returns of a tree, at a scale of 1
MAX_SORTED_BOUNDS = 20_000  # bounds sorted in one array
# Rows of at most this many times the wanted count are sorted without a partition first.
FULL_SORT_FACTOR = 8


class TreeBatch:
    """The search trees of a batch, one per row, with all nodes in shared arrays."""

    def __init__(self, config: SearchConfig, request: SearchRequest) -> None:
        self.config = config
        row_count = len(request.turns_left)
        self.nodes_per_tree = config.nodes_per_tree
        node_count, slots = row_count * self.nodes_per_tree, config.action_slots
        self.visits = np.zeros((node_count, slots))
        self.return_sums = np.zeros((node_count, slots))
        # 0, a root, if there is no child
        self.children = np.zeros((node_count, slots * config.observation_slots), np.int64)
        self.next_free_nodes = np.arange(row_count) * self.nodes_per_tree + 1
        self.min_returns, self.max_returns = np.full(row_count, np.inf), np.full(row_count, -np.inf)
        if config.widens_actions:
            self.offered_counts = np.zeros(node_count, np.int64)
            action_type = config.suggest_actions(np.zeros(1, np.int64)).dtype
            self.offered_actions = np.zeros((node_count, slots), action_type)
            self.suggestion_counts = np.zeros(node_count, np.int64)
        if not config.observation_count:  # of each edge
            edge_count = node_count * slots
            self.observation_keys = np.zeros((edge_count, config.observation_slots), np.int64)
            self.observation_counts = np.zeros(edge_count, np.int64)
            if config.stores_states:
                state_shape, state_type = request.root_states.shape[2:], request.root_states.dtype
                self.node_states = np.empty((node_count, *state_shape), state_type)
                self.node_rewards = np.zeros(node_count)

    def find_lanes_at_new_nodes(self, node: Ints) -> Ints:
        """Return the first lane `[K]` at each node that does not offer an action yet."""
        unopened = np.flatnonzero(self.offered_counts[node] == 0)
        return np.asarray(unopened[np.unique(node[unopened], return_index=True)[1]])

    def offer_actions(self, node: Ints, action: Array) -> None:
        """Offer one action at each of these nodes, which do not offer any yet."""
        self.offered_actions[node, 0] = action
        self.offered_counts[node] = 1

    def select_slots(self, node: Ints, legal_actions_mask: Bools | None) -> tuple[Ints, Ints]:
        """Return the action slots `[N]` of greatest bound, and how often each was chosen before.

        Lanes at the same node choose as if one after another: since a bound falls with each visit,
        the first m choices are the m greatest bounds.
        """
        order = np.argsort(node, kind="stable")
        sorted_nodes = node[order]
        is_first = _mark_changes(sorted_nodes)
        starts, lanes = np.flatnonzero(is_first), np.bincount(np.cumsum(is_first) - 1)
        unique_nodes = sorted_nodes[starts]
        mask = None if legal_actions_mask is None else legal_actions_mask[order[starts]]
        if self.config.widens_actions:
            self._widen_actions(unique_nodes, lanes, mask)
            offers = self.offered_counts[unique_nodes]
            mask = np.arange(offers.max()) < offers[:, None]
        lane_slots, visit_numbers = np.empty(len(node), np.int64), np.empty(len(node), np.int64)
        for group, max_lanes in self._group_by_lane_count(lanes):
            group_mask = None if mask is None else mask[group]
            slots, previous_visits = self._select_greatest_bounds(
                unique_nodes[group], lanes[group], max_lanes, group_mask
            )
            rank = np.arange(max_lanes)
            used = rank < lanes[group][:, None]
            lane_indices = order[(starts[group][:, None] + rank)[used]]
            lane_slots[lane_indices] = slots[used]
            visit_numbers[lane_indices] = previous_visits[used]
        return lane_slots, visit_numbers

    def _group_by_lane_count(self, lanes: Ints) -> Iterator[tuple[Ints | slice, int]]:
        """Yield groups of nodes `[H]` with similar lane counts, and each group's maximum."""
        max_lanes = int(lanes.max())
        bound_count = len(lanes) * max_lanes * self.config.action_slots
        if bound_count <= MAX_SORTED_BOUNDS or lanes.min() == max_lanes:
            yield slice(None), max_lanes
            return
        exponents = np.ceil(np.log2(lanes)).astype(np.int64)
        for exponent in np.unique(exponents):
            group = np.flatnonzero(exponents == exponent)
            yield group, int(lanes[group].max())

    def _select_greatest_bounds(
        self, nodes: Ints, lanes: Ints, max_lanes: int, legal_actions_mask: Bools | None
    ) -> tuple[Ints, Ints]:
        """Return each node's slots `[H, max_lanes]` of greatest bound and the visits before each.

        The bound is UCB1 on mean returns scaled to 0 to 1 by the returns of the tree; it is
        infinite for a slot without visits. A slot repeats if its bound with one more visit is still
        the greatest.
        """
        slot_count = self.config.action_slots
        if legal_actions_mask is not None:
            slot_count = legal_actions_mask.shape[1]
        visits, rows = self.visits[nodes, :slot_count], nodes // self.nodes_per_tree
        min_span = MIN_RETURN_SPAN * self.config.problem.reward_scale
        span = np.maximum(self.max_returns[rows] - self.min_returns[rows], min_span)[:, None]
        with np.errstate(invalid="ignore"):  # Before the first return the minimum is infinite.
            means = self.return_sums[nodes, :slot_count] / np.maximum(visits, 1)
            scaled = (means - self.min_returns[rows][:, None]) / span
        values = np.where(visits > 0, scaled, 0.5)
        n = visits[:, :, None] + np.arange(max_lanes)
        total = np.log(visits.sum(axis=1) + lanes + 1)[:, None, None]
        bounds = values[:, :, None] + self.config.ucb_constant * np.sqrt(total / np.maximum(n, 1))
        bounds[n == 0] = np.inf
        if legal_actions_mask is not None:
            bounds[~legal_actions_mask] = -np.inf
        flat = bounds.reshape(len(nodes), -1)
        is_single = max_lanes == 1
        best = flat.argmax(axis=1)[:, None] if is_single else _find_largest(flat, max_lanes)
        slots = best // max_lanes
        visits_before = visits[np.arange(len(nodes))[:, None], slots].astype(np.int64)
        return slots, visits_before + best % max_lanes

    def _widen_actions(self, nodes: Ints, lanes: Ints, legal_actions_mask: Bools | None) -> None:
        """Offer more actions at nodes, up to the square root of their visits."""
        visits = self.visits[nodes].sum(axis=1) + lanes
        root_counts = np.ceil(np.sqrt(visits)).astype(np.int64)
        target_counts = np.minimum(root_counts, self.config.action_slots)
        while True:
            missing_counts = target_counts - self.offered_counts[nodes]
            if self.config.action_count:
                remaining_counts = self.config.action_count - self.suggestion_counts[nodes]
                missing_counts = np.minimum(missing_counts, remaining_counts)
            lacking = np.flatnonzero(missing_counts > 0)
            if not len(lacking):
                return
            mask = None if legal_actions_mask is None else legal_actions_mask[lacking]
            self._offer_suggested_actions(nodes[lacking], missing_counts[lacking], mask)

    def _offer_suggested_actions(
        self, nodes: Ints, action_count: Ints, legal_actions_mask: Bools | None
    ) -> None:
        """Offer the next suggested actions of nodes, skipping repeated and illegal ones.

        `action_count` `[H]` is the number of suggestions to try at each node.
        """
        offsets = np.arange(action_count.max())
        positions = self.suggestion_counts[nodes][:, None] + offsets
        accepted = offsets < action_count[:, None]
        if self.config.action_count:
            actions = self.config.suggest_actions(positions)
            is_unopened = self.offered_counts[nodes, None] == 0
            accepted &= (self.offered_actions[nodes, :1] != actions) | is_unopened
            if legal_actions_mask is not None:
                accepted &= np.take_along_axis(legal_actions_mask, actions, axis=1)
        else:
            actions = self._suggest_next_numbers(nodes, positions)
        slots = self.offered_counts[nodes][:, None] + np.cumsum(accepted, axis=1) - 1
        row, column = np.nonzero(accepted)
        self.offered_actions[nodes[row], slots[row, column]] = actions[row, column]
        self.offered_counts[nodes] += accepted.sum(axis=1)
        self.suggestion_counts[nodes] += action_count

    def _suggest_next_numbers(self, nodes: Ints, positions: Ints) -> Array:
        """Return the next numbers to try: evenly spread ones, and every other one near the best."""
        tree = self.config
        interval = tree.problem.actions[tree.seat]
        assert isinstance(interval, Interval)
        visits = self.visits[nodes]
        means = np.where(visits > 0, self.return_sums[nodes] / np.maximum(visits, 1), -np.inf)
        best_actions = self.offered_actions[nodes, np.argmax(means, axis=1)][:, None]
        distance = (interval.high - interval.low) * 0.5 ** (1 + positions / ACTIONS_PER_HALVING)
        offsets = distance * (2 * (positions * GOLDEN_RATIO % 1.0) - 1)
        near_best = interval.clip_actions(best_actions + offsets)
        is_near = (positions % 2 == 1) & visits.any(axis=1, keepdims=True)
        return np.where(is_near, near_best, tree.suggest_actions(positions))

    def find_or_add_child(self, node: Ints, edge: Ints) -> tuple[Ints, Bools]:
        """Return the child node of each lane and whether it existed before this call."""
        children = self.children[node, edge]
        existed = children > 0
        new_lanes = np.flatnonzero(~existed)
        if len(new_lanes):
            keys = node[new_lanes] * self.children.shape[1] + edge[new_lanes]
            new_lanes = new_lanes[np.argsort(keys, kind="stable")]
            is_first = _mark_changes(edge[new_lanes]) | _mark_changes(node[new_lanes])
            first_lanes = new_lanes[is_first]
            new_nodes = self._add_nodes(node[first_lanes])
            self.children[node[first_lanes], edge[first_lanes]] = new_nodes
            children[new_lanes] = new_nodes[np.cumsum(is_first) - 1]
        return children, existed

    def _add_nodes(self, parents: Ints) -> Ints:
        """Return newly allocated nodes `[N]`, one below each of the sorted `parents` `[N]`."""
        rows = parents // self.nodes_per_tree
        new_nodes = self.next_free_nodes[rows] + np.arange(len(rows)) - np.searchsorted(rows, rows)
        np.add.at(self.next_free_nodes, rows, 1)
        return np.asarray(new_nodes)

    def find_or_widen_child(
        self, node: Ints, slot: Ints, key: Ints, u: Reals, outcome: Outcome
    ) -> tuple[Ints, Bools]:
        """Return the child of each lane under observation widening, and whether it existed before.

        An edge stores few observations. A new observation that it may not add is replaced by a
        stored one, chosen by the uniforms `u` `[N]`.
        """
        edges = node * self.config.action_slots + slot
        previous_counts = self.observation_counts[edges]
        positions, existed = self._find_observation_slots(edges, key)
        new_lanes = np.flatnonzero(~existed)
        if len(new_lanes):
            self._widen_observations(node, edges, key, new_lanes, outcome)
            new_edges = edges[new_lanes]
            stored, is_stored = self._find_observation_slots(new_edges, key[new_lanes])
            replacements = (u[new_lanes] * self.observation_counts[new_edges]).astype(np.int64)
            positions[new_lanes] = np.where(is_stored, stored, replacements)
        children = self.children.reshape(-1, self.config.observation_slots)
        return children[edges, positions], positions < previous_counts

    def _find_observation_slots(self, edge: Ints, key: Ints) -> tuple[Ints, Bools]:
        """Return the position of an observation in each edge, and whether the edge stores it."""
        positions = np.arange(self.config.observation_slots)
        matches = self.observation_keys[edge] == key[:, None]
        matches &= positions < self.observation_counts[edge][:, None]
        return np.argmax(matches, axis=1), matches.any(axis=1)

    def _widen_observations(
        self, node: Ints, edge: Ints, key: Ints, new_lanes: Ints, outcome: Outcome
    ) -> None:
        """Add child nodes for new observations, up to the square root of each edge's visits."""
        visited_edges, lane_counts = np.unique(edge, return_counts=True)
        order = new_lanes[np.lexsort((key[new_lanes], edge[new_lanes]))]
        # one for each observation
        first_lanes = order[_mark_changes(edge[order]) | _mark_changes(key[order])]
        lane_edges = edge[first_lanes]
        ranks = np.arange(len(lane_edges)) - np.searchsorted(lane_edges, lane_edges)
        positions = self.observation_counts[lane_edges] + ranks
        new_visits = lane_counts[np.searchsorted(visited_edges, lane_edges)]
        visits = self.visits.reshape(-1)[lane_edges] + new_visits
        allowed = positions < np.minimum(np.ceil(np.sqrt(visits)), self.config.observation_slots)
        first_lanes, lane_edges, positions = (
            array[allowed] for array in (first_lanes, lane_edges, positions)
        )
        new_nodes = self._add_nodes(node[first_lanes])
        self.children.reshape(-1, self.config.observation_slots)[lane_edges, positions] = new_nodes
        self.observation_keys[lane_edges, positions] = key[first_lanes]
        np.add.at(self.observation_counts, lane_edges, 1)
        if self.config.stores_states:
            self.node_states[new_nodes] = outcome.state[first_lanes]
            self.node_rewards[new_nodes] = outcome.rewards[first_lanes, self.config.seat]

    def add_returns(self, node: Ints, slot: Ints, returns: Reals) -> None:
        """Add the returns `[N]` of the actions in these slots to the nodes' statistics."""
        rows = node // self.nodes_per_tree
        np.add.at(self.visits, (node, slot), 1)
        np.add.at(self.return_sums, (node, slot), returns)
        np.minimum.at(self.min_returns, rows, returns)
        np.maximum.at(self.max_returns, rows, returns)


def _mark_changes(ordered: Ints) -> Bools:
    """Return a mask of the elements that differ from the one before; the first is marked."""
    changes = np.ones(len(ordered), bool)
    np.not_equal(ordered[1:], ordered[:-1], out=changes[1:])
    return changes


def _find_largest(numbers: Reals, largest_count: int) -> Ints:
    """Return the indices `[H, largest_count]` of the largest numbers of each row.

    They are in descending order; of equal numbers the first comes first.
    """
    if numbers.shape[1] <= FULL_SORT_FACTOR * largest_count:
        return np.argsort(-numbers, axis=1, kind="stable")[:, :largest_count]
    thresholds = np.partition(numbers, -largest_count, axis=1)[:, -largest_count, None]
    rows, columns = np.nonzero(numbers >= thresholds)
    order = np.lexsort((-numbers[rows, columns], rows))
    row_starts = np.searchsorted(rows, np.arange(len(numbers)))
    return np.asarray(columns[order][row_starts[:, None] + np.arange(largest_count)])
