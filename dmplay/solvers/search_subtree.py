"""The trees of a search as they are kept from turn to turn, for B rows of N nodes each.

What was done and seen leads from the root to a node, and what is below it goes on growing (Silver
and Veness, 2010). Only the new root begins anew: there actions are compared on equal luck, which
tells more than the visits that it had. A memory of trees is the place in the table of children
where each node hangs `[B, N]`, -1 for nowhere; the key of what was seen there `[B, N]`; and what
is known of each node by itself `[B, N, ...]`, its visits and their sums first.
"""

import numpy as np

from dmplay.chance import Array, Ints
from dmplay.core import Memory
from dmplay.solvers.search_nodes import TreeBatch
from dmplay.solvers.search_tree import SearchConfig

NO_SLOT = -2  # a slot of no node


def pack_trees(trees: TreeBatch) -> Memory:
    """The trees as a memory."""
    rows, edges = len(trees.next_free_nodes), trees.children.shape[1]
    node, edge = np.nonzero(trees.children)
    child = trees.children[node, edge]
    hangs = np.full(len(trees.children), -1)
    hangs[child] = node % trees.nodes_per_tree * edges + edge
    keys = np.zeros_like(hangs)
    if not trees.config.observation_count:
        keys[child] = trees.observation_keys.reshape(-1, edges)[node, edge]
    parts = (hangs, keys, *trees.node_arrays)
    return tuple(part.reshape(rows, trees.nodes_per_tree, *part.shape[1:]) for part in parts)


def restore_trees(trees: TreeBatch, packed_trees: Memory) -> None:
    """Has nodes that were just made begin with trees that were kept."""
    hangs, keys, *known = packed_trees
    edges = trees.children.shape[1]
    row, place = np.nonzero(hangs >= 0)
    node, edge = np.divmod(hangs[row, place] + row * trees.nodes_per_tree * edges, edges)
    trees.children[node, edge] = row * trees.nodes_per_tree + place
    trees.next_free_nodes += (hangs >= 0).sum(axis=1)
    if not trees.config.observation_count:
        trees.observation_keys.reshape(-1, edges)[node, edge] = keys[row, place]
        np.add.at(
            trees.observation_counts,
            node * trees.config.action_slots + edge // trees.config.observation_slots,
            1,
        )
    for mine, part in zip(trees.node_arrays, known, strict=True):
        mine[:] = part.reshape(mine.shape)
    visits, sums = known[:2]
    means, been = sums / np.maximum(visits, 1), visits > 0
    trees.min_returns = np.where(been, means, np.inf).min(axis=(1, 2))
    trees.max_returns = np.where(been, means, -np.inf).max(axis=(1, 2))


def extract_subtrees(
    config: SearchConfig, packed_trees: Memory, actions: Array, observations: Ints
) -> Memory:
    """What is kept below the actions `[B]` and what was seen then; nothing where that is new.

    Of a large tree those nodes stay that were there first.
    """
    hangs, keys, *known = packed_trees
    edges, slot = config.action_slots * config.observation_slots, actions
    if config.widens_actions:
        offers, offered = known[2:4]
        fits = (offered[:, 0] == actions[:, None]) & (
            np.arange(config.action_slots) < offers[:, :1]
        )
        slot = np.where(fits.any(axis=1), np.argmax(fits, axis=1), NO_SLOT)
    if config.observation_count:
        root = hangs == (slot * config.observation_slots + observations)[:, None]
    else:
        root = (hangs // config.observation_slots == slot[:, None]) & (
            keys == observations[:, None]
        )
    inside, above = root, hangs // edges
    while ((more := root | (np.take_along_axis(inside, above, 1) & (hangs >= 0))) > inside).any():
        inside = more
    label = np.cumsum(inside, axis=1) - 1
    row, place = np.nonzero(inside & (label < config.simulations))
    to = label[row, place]
    moved = label[row, above[row, place]] * edges + hangs[row, place] % edges
    found = [np.full_like(hangs, -1), *(np.zeros_like(part) for part in (keys, *known))]
    for mine, part in zip(found[1:], (keys, *known), strict=True):
        mine[row, to] = part[row, place]
    found[0][row, to] = np.where(to > 0, moved, -1)
    for part in found[2:4]:
        part[:, 0] = 0.0
    return tuple(found)
