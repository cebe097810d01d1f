"""Monte Carlo tree search by upper confidence bounds (UCT, section 9.6), through `step` alone.

A node is what the seat did and saw since the root: states where they are seen, else observations
(POMCP; Silver and Veness, 2010). Where they are many or real, an edge tells some apart, as many as
the root of its visits (double progressive widening; Couetoux and others, 2011), and so a node has
some of many actions. Simulations run in waves, side by side: those of one wave that meet in a node
count each other as visits, so that they part. The n-th simulation of each first action has the same
dice and the same start, so that actions are compared on equal luck.
"""

from typing import NamedTuple
from zlib import crc32

import numpy as np

from dmplay.budget import Budget
from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, Outcome, Problem
from dmplay.solvers.cast import Cast
from dmplay.solvers.search_nodes import Nodes
from dmplay.solvers.search_subtree import planted
from dmplay.solvers.search_tree import Asked, Tree

SURE = 3.0  # standard errors by which another action is better than the usual one


class Found(NamedTuple):
    """What a search found out about each action that it tried, for B rows."""

    actions: Array  # [B, K]
    means: Reals  # [B, K], the mean return; -inf where it was never tried
    errors: Reals  # [B, K], of the means, squared; infinite where there are none

    def kept(self, able: Bools, usual: Array) -> Bools:
        """The actions marked `[B, K]`, or the usual one `[B]` unless they are surely better."""
        row = np.arange(len(usual))
        same = self.actions == usual[:, None]
        own, best = np.argmax(same, axis=1), np.argmax(able, axis=1)
        lead = self.means[row, best] - self.means[row, own]
        doubt = SURE * np.sqrt(self.errors[row, best] + self.errors[row, own])
        stays = same.any(axis=1) & ~(lead > doubt)
        return np.where(stays[:, None], same, able)


def search(tree: Tree, asked: Asked, u: Reals) -> tuple[Found, Nodes]:
    """What is found out about each action, by uniforms `[B, draws]`, and the trees that grew."""
    rows = len(u)
    grown = _Search(tree, asked, tree.budget(rows))
    told = u.reshape(rows, tree.simulations, tree.depth, -1)
    for wave in tree.waves:
        grown.wave(len(wave), told, tree.turn(rows, wave))
    return grown.found(), grown.nodes


class _Lanes(NamedTuple):
    """Simulations under way."""

    lane: Ints  # [N], of the wave
    state: Array  # [N, ...]
    memories: tuple[Memory, ...]  # of each of the cast
    turn: Ints  # [N], turns done
    left: Ints  # [N], turns that they may do

    def those(self, able: Bools) -> "_Lanes":
        """Some of them."""
        if able.all():
            return self
        lane, state, memories, turn, left = self
        kept = tuple(tuple(part[able] for part in memory) for memory in memories)
        return _Lanes(lane[able], state[able], kept, turn[able], left[able])


def _together(parts: list[_Lanes]) -> _Lanes:
    """Lanes put aside one after the other."""
    if len(parts) == 1:
        return parts[0]
    lane, state, memories, turn, left = zip(*parts, strict=True)
    each = tuple(
        tuple(np.concatenate(part) for part in zip(*memory, strict=True))
        for memory in zip(*memories, strict=True)
    )
    joined = [np.concatenate(part) for part in (lane, state, turn, left)]
    return _Lanes(joined[0], joined[1], each, joined[2], joined[3])


class _Search:
    """The simulations of a batch."""

    def __init__(self, tree: Tree, asked: Asked, budget: Budget) -> None:
        self.tree, self.asked, self.budget = tree, asked, budget
        self.nodes = Nodes(tree, asked)
        if asked.trees:
            planted(self.nodes, asked.trees)
        self.squares = np.zeros((len(asked.left), tree.slots))  # of the returns of first actions

    def found(self) -> Found:
        """What is known of the actions at the roots."""
        nodes = self.nodes
        visits = nodes.visits[:: nodes.nodes]
        means: Reals = np.full(visits.shape, -np.inf)
        np.divide(nodes.sums[:: nodes.nodes], visits, out=means, where=visits > 0)
        errors: Reals = np.full(visits.shape, np.inf)
        spread = self.squares - np.where(visits > 1, means, 0.0) ** 2 * visits
        np.divide(spread, visits * (visits - 1), out=errors, where=visits > 1)
        errors = np.maximum(errors, 0.0)
        actions = np.arange(visits.shape[1])[None].repeat(len(visits), axis=0)
        return Found(nodes.offered[:: nodes.nodes] if self.tree.widens else actions, means, errors)

    def wave(self, many: int, told: Reals, cost: float) -> None:
        """Runs so many simulations of every row and learns from them."""
        tree, asked, nodes = self.tree, self.asked, self.nodes
        row = np.repeat(np.arange(len(asked.left)), np.where(asked.left > 0, many, 0))
        if not len(row):
            return
        node = row * nodes.nodes
        legal = None if asked.legal is None else asked.legal[row]
        if tree.widens:
            begun = tuple(tuple(part[row, 0] for part in memory) for memory in asked.memories)
            self._opened(node, begun, legal, told[row, 0, 0])
        slot, nth = nodes.selected(node, legal)
        memories = tuple(tuple(part[row, nth] for part in memory) for memory in asked.memories)
        u = told[row, nth]  # the n-th of each action has the n-th dice
        start = np.zeros(len(row), np.int64)
        lanes = _Lanes(np.arange(len(row)), asked.roots[row, nth], memories, start, asked.left[row])
        path: list[tuple[Ints, Ints, Ints, Reals]] = []  # lanes, their nodes, slots and rewards
        outside: list[_Lanes] = []
        while True:
            self.budget.spend(cost)
            now = u[lanes.lane, lanes.turn]
            lanes, child, known, paid = self._followed(lanes, node, slot, now)
            path.append((lanes.lane, node, slot, paid))
            going = ~tree.problem.terminal(lanes.state) & (lanes.turn < lanes.left)
            outside.append(lanes.those(going & ~known))
            on = going & known & (lanes.turn < tree.depth)
            if not on.any():
                break
            lanes, node = lanes.those(on), child[on]
            able = tree.problem.legal(lanes.state)
            legal = None if able is None else able[:, tree.seat]
            if tree.widens:
                self._opened(node, lanes.memories, legal, u[lanes.lane, lanes.turn])
            slot, _ = nodes.selected(node, legal)
        outside.append(lanes.those(going & known))  # at the greatest depth
        gain = self._beyond(_together(outside), u, cost)
        self._learn(row, path, gain)

    def _opened(
        self, node: Ints, memories: tuple[Memory, ...], legal: Bools | None, u: Reals
    ) -> None:
        """Offers in nodes that are come to first what the seat's part of the cast would do."""
        tree = self.tree
        actor, place = tree.cast.actors[tree.seat], tree.cast.places[tree.seat]
        new = self.nodes.fresh(node) if actor else node[:0]
        if actor is None or not len(new):
            return
        memory = tuple(part[new] for part in memories[tree.seat])
        able = None if legal is None else legal[new]
        self.nodes.offer(node[new], actor.choose(memory, able, u[new][:, place][:, : actor.draws]))

    def _followed(
        self, lanes: _Lanes, node: Ints, slot: Ints, u: Reals
    ) -> tuple[_Lanes, Ints, Bools, Reals]:
        """The lanes after a turn, the nodes they come to, which are known, and what it paid."""
        tree = self.tree
        own = self.nodes.offered[node, slot] if tree.widens else slot
        joint = tree.cast.acted(lanes.state, lanes.memories, own, u)
        outcome = tree.cast.stepped(lanes.state, joint, u)
        sights = outcome.observations[:, tree.seat] if tree.problem.hidden else outcome.state
        if tree.seen:
            sight = sights if tree.problem.hidden else tree.problem.index(outcome.state)
            child, known = self.nodes.child(node, slot * tree.kinds + sight)
        else:
            key, luck = key_of(tree.problem, sights), u[:, tree.cast.places[tree.seat].start]
            child, known = self.nodes.one_of_some(node, slot, key, luck, outcome)
            if not tree.problem.hidden:
                state, rewards = self.nodes.kept[child], outcome.rewards.copy()
                rewards[:, tree.seat] = self.nodes.paid[child]
                outcome = Outcome(state, rewards, state)
        return _after(tree.cast, lanes, joint, outcome), child, known, outcome.rewards[:, tree.seat]

    def _beyond(self, lanes: _Lanes, u: Reals, cost: float) -> Reals:
        """What simulations `[N]` of a wave earn after they left the tree."""
        tree, problem = self.tree, self.tree.problem
        gain, weight = np.zeros(len(u)), 1.0
        if tree.worth is not None:
            own = lanes.memories[tree.seat]
            gain[lanes.lane] = tree.worth(lanes.state, own, lanes.left - lanes.turn)
            return gain
        lanes = lanes._replace(left=np.minimum(lanes.left, tree.depth))
        lanes = lanes.those(lanes.turn < lanes.left)
        while len(lanes.lane):
            self.budget.spend(cost)
            now = u[lanes.lane, lanes.turn]
            joint = tree.cast.acted(lanes.state, lanes.memories, None, now)
            outcome = tree.cast.stepped(lanes.state, joint, now)
            gain[lanes.lane] += weight * outcome.rewards[:, tree.seat]
            weight *= problem.discount
            lanes = _after(tree.cast, lanes, joint, outcome)
            lanes = lanes.those((lanes.turn < lanes.left) & ~problem.terminal(lanes.state))
        return gain

    def _learn(self, row: Ints, path: list[tuple[Ints, Ints, Ints, Reals]], gain: Reals) -> None:
        """Adds the returns from each node on to what is known of it."""
        for lane, node, slot, paid in path[::-1]:
            gain[lane] = paid + self.tree.problem.discount * gain[lane]
            self.nodes.learn(node, slot, gain[lane])
        np.add.at(self.squares, (row, path[0][2]), gain**2)


def _after(cast: Cast, lanes: _Lanes, joint: Array, outcome: Outcome) -> _Lanes:
    """The lanes once a turn is done."""
    memories = cast.told(lanes.memories, joint, outcome)
    return _Lanes(lanes.lane, outcome.state, memories, lanes.turn + 1, lanes.left)


def key_of(problem: Problem, sights: Array) -> Ints:
    """A number `[N]` for each sight: of equal ones the same, of others hardly ever."""
    if sights.dtype.hasobject:  # states of a guest
        return np.array([crc32(problem.notation(one).encode()) for one in sights], np.int64)
    flat = np.ascontiguousarray(sights).reshape(len(sights), -1)
    raw = (flat + 0.0 if flat.dtype.kind == "f" else flat).view(np.uint8)
    words = np.zeros((len(raw), -(-raw.shape[1] // 8) * 8), np.uint8)
    words[:, : raw.shape[1]] = raw
    key = np.zeros(len(raw), np.uint64)
    for word in words.view(np.uint64).T:
        key = (key ^ word) * np.uint64(0x9E3779B97F4A7C15)
        key ^= key >> np.uint64(29)
    return key.view(np.int64)
