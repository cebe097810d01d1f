"""Monte Carlo tree search by upper confidence bounds (UCT, section 9.6), through `step` alone.

A node is what the seat did and saw since the root: the states where they are finite and seen, the
observations where states are hidden (as in POMCP), else the actions only. Simulations run side by
side, a few of each row at a time; those of one such wave that meet in a node count each other as
visits, so that they part.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Array, Bools, Ints, Reals, anyone
from dmplay.core import Problem

WAVE = 20  # simulations of a row at a time
MOST_SEEN = 200  # states that nodes tell apart; of more, none
WORK = 1e10
ENTRIES = 4_000_000  # of the table of children, which bounds the rows searched together


@dataclass(frozen=True)
class Tree:
    """A search for one seat; the others act uniformly at random."""

    problem: Problem
    seat: int
    simulations: int
    depth: int
    exploration: float

    @cached_property
    def actions(self) -> Array:
        """The seat's actions `[A]`: indices, or a grid of an interval."""
        return self.problem.actions[self.seat].grid()

    @cached_property
    def seen(self) -> int:
        """How many things the seat can see after a turn, as far as nodes tell them apart."""
        problem = self.problem
        if problem.hidden:
            return problem.observation_counts[self.seat]
        if isinstance(problem.states, int) and problem.states <= MOST_SEEN:
            return problem.states
        return 1

    @property
    def rows(self) -> int:
        """How many rows can be searched together."""
        return max(1, ENTRIES // ((self.simulations + 1) * len(self.actions) * self.seen))

    @property
    def _each(self) -> int:
        """The uniforms of one turn of one simulation: the agents' actions, then nature's draws."""
        return len(self.problem.agents) + self.problem.draws.step

    @property
    def draws(self) -> int:
        """How many uniforms one row consumes."""
        return self.simulations * self.depth * self._each

    def budget(self, rows: int) -> Budget:
        """What a search of so many rows may cost; refuses one that would be too much."""
        budget = Budget("search", "try fewer simulations, or a smaller depth", WORK)
        table = (self.simulations + 1) * len(self.actions) * (2 + self.seen)
        budget.hold(8.0 * rows * (table + 2 * self.draws))
        budget.expect(-(-self.simulations // WAVE) * self.depth * self._turn(rows))
        return budget

    def _turn(self, rows: int) -> float:
        """What one turn of one wave takes."""
        return 10 * ROUND + 1000.0 * rows * min(self.simulations, WAVE)

    def values(self, roots: Array, u: Reals) -> Reals:
        """The mean return `[B, A]` of each action; -inf where it was never tried.

        `roots` `[B, simulations, ...]` are the states that simulations start from, and `u`
        `[B, draws]`.
        """
        grown = _Grown(self, len(roots), self.budget(len(roots)))
        told = u.reshape(len(roots), self.simulations, self.depth, self._each)
        for first in range(0, self.simulations, WAVE):
            now = slice(first, min(first + WAVE, self.simulations))
            grown.wave(roots[:, now], told[:, now])
        means: Reals = np.full((len(roots), len(self.actions)), -np.inf)
        visits = grown.visits[:: grown.nodes]
        np.divide(grown.sums[:: grown.nodes], visits, out=means, where=visits > 0)
        return means

    def sights(self, state: Array, observations: Array) -> Ints:
        """What the seat sees `[N]`, as the index that nodes go by."""
        if self.problem.hidden:
            return np.asarray(observations[:, self.seat])
        return self.problem.index(state) if self.seen > 1 else np.zeros(len(state), np.int64)


class _Grown:
    """The trees of a batch, one a row, as they grow."""

    def __init__(self, tree: Tree, rows: int, budget: Budget) -> None:
        self.tree = tree
        self.budget = budget
        self.turn = tree._turn(rows)
        self.nodes = tree.simulations + 1  # of one row: a simulation adds at most one
        many, actions = rows * self.nodes, len(tree.actions)
        self.visits = np.zeros((many, actions))
        self.sums = np.zeros((many, actions))
        self.children = np.full((many, actions * tree.seen), -1)
        self.free = np.arange(rows) * self.nodes + 1
        self.low, self.high = np.full(rows, np.inf), np.full(rows, -np.inf)

    def wave(self, roots: Array, u: Reals) -> None:
        """Runs some simulations of every row and learns from them."""
        tree, problem = self.tree, self.tree.problem
        rows, lanes = u.shape[:2]
        s = roots.reshape(-1, *roots.shape[2:])
        told = u.reshape(rows * lanes, tree.depth, -1)
        agents = len(problem.agents)
        row = np.repeat(np.arange(rows), lanes)
        node = row * self.nodes
        inside = ~problem.terminal(s)
        path: list[tuple[Ints, Ints, Ints]] = []  # the lanes inside, their nodes and actions
        rewards: Reals = np.zeros((tree.depth, len(s)))
        for turn in range(tree.depth):
            self.budget.spend(self.turn)
            legal = problem.legal(s)
            joint = self._at_random(legal, told[:, turn, :agents])
            on = np.flatnonzero(inside)
            if len(on):
                own = self._selected(node[on], None if legal is None else legal[on, tree.seat])
                joint[on, tree.seat] = tree.actions[own]
                path.append((on, node[on], own))
            outcome = problem.step(s, joint, told[:, turn, agents:])
            s, rewards[turn] = outcome.state, outcome.rewards[:, tree.seat]
            if len(on):
                sight = tree.sights(s[on], outcome.observations[on])
                node[on], inside[on] = self._followed(node[on], own * tree.seen + sight)
                inside &= ~problem.terminal(s)
            elif problem.terminal(s).all():
                break
        self._learn(row, path, rewards)

    def _at_random(self, legal: Bools | None, u: Reals) -> Array:
        """Joint actions `[N, n]`, each agent's uniform over what it may do."""
        columns: list[Array] = []
        own = self.tree.actions
        for seat, known in enumerate(self.tree.problem.actions):
            able = None if legal is None else legal[:, seat]
            if seat == self.tree.seat:
                columns.append(own[anyone(len(own), u[:, seat], able)])
            else:
                columns.append(known.draw(u[:, seat], able))
        return np.stack(columns, axis=1)

    def _selected(self, node: Ints, legal: Bools | None) -> Ints:
        """The actions `[N]` of greatest bound; lanes at one node choose one after another."""
        order = np.argsort(node, kind="stable")
        here, start, place = np.unique(node[order], return_index=True, return_inverse=True)
        rank = np.arange(len(node)) - start[place]
        visits, row = self.visits[here], here // self.nodes
        tried = visits > 0
        span = np.maximum(self.high[row] - self.low[row], 1e-9)[:, None]
        with np.errstate(invalid="ignore"):  # before the first return the least is infinite
            scaled = (self.sums[here] / np.maximum(visits, 1) - self.low[row][:, None]) / span
        worth = np.where(tried, scaled, 0.5)
        chosen = np.empty(len(node), np.int64)
        for turn in range(int(rank.max()) + 1):
            lanes = np.flatnonzero(rank == turn)
            at = place[lanes]
            n = visits[at]
            bonus = np.sqrt(np.log(n.sum(axis=1, keepdims=True) + 1) / np.maximum(n, 1))
            bound = np.where(n > 0, worth[at] + self.tree.exploration * bonus, np.inf)
            if legal is not None:
                bound = np.where(legal[order[lanes]], bound, -np.inf)
            own = np.argmax(bound, axis=1)
            visits[at, own] += 1
            chosen[order[lanes]] = own
        return chosen

    def _followed(self, node: Ints, edge: Ints) -> tuple[Ints, Bools]:
        """The node that each lane comes to, and whether it was there before this turn."""
        child = self.children[node, edge]
        known = child >= 0
        new = np.flatnonzero(~known)
        if len(new):
            keys = node[new] * self.children.shape[1] + edge[new]
            _, first, which = np.unique(keys, return_index=True, return_inverse=True)
            row = node[new][first] // self.nodes  # rising: the keys are sorted
            rank = np.arange(len(row)) - np.searchsorted(row, row)
            fresh = self.free[row] + rank
            np.add.at(self.free, row, 1)
            self.children[node[new][first], edge[new][first]] = fresh
            child[new] = fresh[which.reshape(-1)]
        return child, known

    def _learn(self, row: Ints, path: list[tuple[Ints, Ints, Ints]], rewards: Reals) -> None:
        """Adds the returns from each node on to its sums."""
        discount = self.tree.problem.discount
        gain = rewards
        for turn in range(len(rewards) - 2, -1, -1):
            gain[turn] += discount * gain[turn + 1]
        for turn, (on, node, own) in enumerate(path):
            np.add.at(self.visits, (node, own), 1)
            np.add.at(self.sums, (node, own), gain[turn, on])
            np.minimum.at(self.low, row[on], gain[turn, on])
            np.maximum.at(self.high, row[on], gain[turn, on])
