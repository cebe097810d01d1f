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
from dmplay.solvers.search_nodes import Nodes
from dmplay.solvers.search_tree import Tree

NOWHERE = -2  # a slot of no node


def packed(nodes: Nodes) -> Memory:
    """The trees as a memory."""
    rows, edges = len(nodes.free), nodes.children.shape[1]
    node, edge = np.nonzero(nodes.children)
    child = nodes.children[node, edge]
    hangs = np.full(len(nodes.children), -1)
    hangs[child] = node % nodes.nodes * edges + edge
    keys = np.zeros_like(hangs)
    if not nodes.tree.seen:
        keys[child] = nodes.keys.reshape(-1, edges)[node, edge]
    parts = (hangs, keys, *nodes.known)
    return tuple(part.reshape(rows, nodes.nodes, *part.shape[1:]) for part in parts)


def planted(nodes: Nodes, kept: Memory) -> None:
    """Has nodes that were just made begin with trees that were kept."""
    hangs, keys, *known = kept
    edges = nodes.children.shape[1]
    row, place = np.nonzero(hangs >= 0)
    node, edge = np.divmod(hangs[row, place] + row * nodes.nodes * edges, edges)
    nodes.children[node, edge] = row * nodes.nodes + place
    nodes.free += (hangs >= 0).sum(axis=1)
    if not nodes.tree.seen:
        nodes.keys.reshape(-1, edges)[node, edge] = keys[row, place]
        np.add.at(nodes.kin, node * nodes.tree.slots + edge // nodes.tree.kinds, 1)
    for mine, part in zip(nodes.known, known, strict=True):
        mine[:] = part.reshape(mine.shape)
    visits, sums = known[:2]
    means, been = sums / np.maximum(visits, 1), visits > 0
    nodes.low = np.where(been, means, np.inf).min(axis=(1, 2))
    nodes.high = np.where(been, means, -np.inf).max(axis=(1, 2))


def under(tree: Tree, kept: Memory, did: Array, saw: Ints) -> Memory:
    """What is kept below the actions `[B]` and what was seen then; nothing where that is new.

    Of a large tree those nodes stay that were there first.
    """
    hangs, keys, *known = kept
    edges, slot = tree.slots * tree.kinds, did
    if tree.widens:
        offers, offered = known[2:4]
        fits = (offered[:, 0] == did[:, None]) & (np.arange(tree.slots) < offers[:, :1])
        slot = np.where(fits.any(axis=1), np.argmax(fits, axis=1), NOWHERE)
    if tree.seen:
        root = hangs == (slot * tree.kinds + saw)[:, None]
    else:
        root = (hangs // tree.kinds == slot[:, None]) & (keys == saw[:, None])
    inside, above = root, hangs // edges
    while ((more := root | (np.take_along_axis(inside, above, 1) & (hangs >= 0))) > inside).any():
        inside = more
    label = np.cumsum(inside, axis=1) - 1
    row, place = np.nonzero(inside & (label < tree.simulations))
    to = label[row, place]
    moved = label[row, above[row, place]] * edges + hangs[row, place] % edges
    found = [np.full_like(hangs, -1), *(np.zeros_like(part) for part in (keys, *known))]
    for mine, part in zip(found[1:], (keys, *known), strict=True):
        mine[row, to] = part[row, place]
    found[0][row, to] = np.where(to > 0, moved, -1)
    for part in found[2:4]:
        part[:, 0] = 0.0
    return tuple(found)
