"""Search trees that are reused from turn to turn, packed as a memory of B rows of N nodes.

The action and the observation of a turn lead from the root to a node, and the tree below it keeps
growing (Silver and Veness, 2010). Only the statistics of the new root start from zero: actions are
compared there on common random numbers, which is more informative than earlier visits. A memory of
trees holds the position of each node in the table of children `[B, N]`, -1 for none; the key of
the observation there `[B, N]`; and the arrays with one entry per node `[B, N, ...]`, visits and
return sums first.
"""

import numpy as np

from dmplay.chance import Array, Ints
from dmplay.core import Memory
from dmplay.solvers.search_config import SearchConfig
from dmplay.solvers.search_tree_batch import TreeBatch

NO_SLOT = -2  # matches no node


def pack_trees(trees: TreeBatch) -> Memory:
    """Return the trees of a batch, packed as a memory."""
    row_count, edge_count = len(trees.next_free_nodes), trees.children.shape[1]
    parents, edges = np.nonzero(trees.children)
    children = trees.children[parents, edges]
    parent_edges = np.full(len(trees.children), -1)
    parent_edges[children] = parents % trees.nodes_per_tree * edge_count + edges
    keys = np.zeros_like(parent_edges)
    if not trees.config.observation_count:
        keys[children] = trees.observation_keys.reshape(-1, edge_count)[parents, edges]
    parts = (parent_edges, keys, *trees.node_arrays)
    return tuple(part.reshape(row_count, trees.nodes_per_tree, *part.shape[1:]) for part in parts)


def restore_trees(trees: TreeBatch, packed_trees: Memory) -> None:
    """Fill a new batch of trees from packed trees, in place."""
    parent_edges, keys, *node_arrays = packed_trees
    edge_count = trees.children.shape[1]
    rows, positions = np.nonzero(parent_edges >= 0)
    parents, edges = np.divmod(
        parent_edges[rows, positions] + rows * trees.nodes_per_tree * edge_count, edge_count
    )
    trees.children[parents, edges] = rows * trees.nodes_per_tree + positions
    trees.next_free_nodes += (parent_edges >= 0).sum(axis=1)
    if not trees.config.observation_count:
        trees.observation_keys.reshape(-1, edge_count)[parents, edges] = keys[rows, positions]
        np.add.at(
            trees.observation_counts,
            parents * trees.config.action_slots + edges // trees.config.observation_slots,
            1,
        )
    for target, source in zip(trees.node_arrays, node_arrays, strict=True):
        target[:] = source.reshape(target.shape)
    visits, sums = node_arrays[:2]
    means, is_visited = sums / np.maximum(visits, 1), visits > 0
    trees.min_returns = np.where(is_visited, means, np.inf).min(axis=(1, 2))
    trees.max_returns = np.where(is_visited, means, -np.inf).max(axis=(1, 2))


def extract_subtrees(
    config: SearchConfig, packed_trees: Memory, actions: Array, observations: Ints
) -> Memory:
    """Return the packed subtrees below the actions `[B]` and observations `[B]`.

    A row is empty if its action or observation is not in the tree. Of a large subtree, only the
    oldest nodes are kept, as many as the simulations of a search.
    """
    parent_edges, keys, *node_arrays = packed_trees
    edge_count, slots = config.action_slots * config.observation_slots, actions
    if config.widens_actions:
        offer_counts, offered_actions = node_arrays[2:4]
        matches = (offered_actions[:, 0] == actions[:, None]) & (
            np.arange(config.action_slots) < offer_counts[:, :1]
        )
        slots = np.where(matches.any(axis=1), np.argmax(matches, axis=1), NO_SLOT)
    if config.observation_count:
        is_root = parent_edges == (slots * config.observation_slots + observations)[:, None]
    else:
        is_root = (parent_edges // config.observation_slots == slots[:, None]) & (
            keys == observations[:, None]
        )
    inside, parents = is_root, parent_edges // edge_count
    while (
        (grown := is_root | (np.take_along_axis(inside, parents, 1) & (parent_edges >= 0))) > inside
    ).any():
        inside = grown
    labels = np.cumsum(inside, axis=1) - 1
    rows, positions = np.nonzero(inside & (labels < config.simulations))
    targets = labels[rows, positions]
    new_edges = (
        labels[rows, parents[rows, positions]] * edge_count
        + parent_edges[rows, positions] % edge_count
    )
    result = [
        np.full_like(parent_edges, -1),
        *(np.zeros_like(source) for source in (keys, *node_arrays)),
    ]
    for target, source in zip(result[1:], (keys, *node_arrays), strict=True):
        target[rows, targets] = source[rows, positions]
    result[0][rows, targets] = np.where(targets > 0, new_edges, -1)
    for source in result[2:4]:
        source[:, 0] = 0.0
    return tuple(result)
