"""Monte Carlo tree search by upper confidence bounds (UCT, section 9.6), through `step` alone.

A node is what the seat did and saw since the root: states where they are seen, else observations
(POMCP; Silver and Veness, 2010). Where they are many or real, an edge tells some apart, as many as
the root of its visits (double progressive widening; Couetoux and others, 2011), and so a node has
some of many actions. Simulations run in waves, side by side: those of one wave that meet in a node
count each other as visits, so that they part. The n-th simulation of each first action has the same
dice and the same start, so that actions are compared on equal luck.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from math import ceil, gcd, sqrt
from typing import NamedTuple
from zlib import crc32

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Interval, Memory, Outcome, Policy, Problem

FIRST, SHARE, WIDEST = 50, 1, 1024  # simulations of the first wave; of later ones: 1 / SHARE done
FEW_SEEN = 64  # things to see that nodes tell apart from the start;
SOME_SEEN = 16  # of more, so many
FEW_ACTIONS = 32  # actions that a node tries from the start; of more, the root of its visits
SURE = 2.0  # standard errors by which another action is better than the usual one
GOLDEN = (sqrt(5) - 1) / 2  # whose multiples fill an interval evenly
HALVED = 4  # actions near the best after which the next are twice as near
WORK = 1e10
ENTRIES = 4_000_000  # of the table of children, which bounds the rows searched together
SORTED = 20_000  # bounds that are sorted in one go

Cast = tuple[Policy | None, ...]  # who acts in a seat; None for any action, each as likely
Worth = Callable[[Array, Memory, Ints], Reals]  # of states, by the own memory and the turns left


@dataclass(frozen=True)
class Tree:
    """A search for one seat.

    `cast` plays the others, and what is simulated beyond the tree; its own entry is not asked
    where `worth` knows what a state is worth.
    """

    problem: Problem
    seat: int
    simulations: int
    depth: int
    exploration: float
    cast: Cast = ()
    worth: Worth | None = field(default=None, compare=False)

    @cached_property
    def played(self) -> Cast:
        """Who acts in each seat."""
        return self.cast or (None,) * len(self.problem.agents)

    @cached_property
    def choices(self) -> int:
        """How many actions the seat has to choose from; 0 where it chooses a number."""
        return self.problem.action_counts[self.seat]

    @cached_property
    def slots(self) -> int:
        """How many actions a node has room for."""
        if 0 < self.choices <= FEW_ACTIONS:
            return self.choices
        most = ceil(sqrt(self.simulations)) + 1
        return min(most, self.choices or most)

    @property
    def widens(self) -> bool:
        """Whether a node begins with few of its actions."""
        return not 0 < self.choices <= FEW_ACTIONS

    @cached_property
    def seen(self) -> int:
        """How many things the seat can see after a turn; 0 where they are too many."""
        problem = self.problem
        many = problem.observation_counts[self.seat] if problem.hidden else problem.states
        return many if isinstance(many, int) and many <= FEW_SEEN else 0

    @property
    def kinds(self) -> int:
        """How many things seen after an action a node tells apart."""
        return self.seen or SOME_SEEN

    @property
    def rows(self) -> int:
        """How many rows can be searched together."""
        return max(1, ENTRIES // ((self.simulations + 1) * self.slots * self.kinds))

    @cached_property
    def places(self) -> tuple[slice, ...]:
        """Which uniforms of a turn are whose: those of each seat, then nature's."""
        each = [1 if one is None else one.draws for one in self.played]
        each[self.seat] = max(each[self.seat], 1)  # within the tree they are the tree's own
        ends = np.cumsum([0, *each, self.problem.draws.step]).tolist()
        return tuple(slice(a, b) for a, b in pairwise(ends))

    @property
    def draws(self) -> int:
        """How many uniforms one row consumes."""
        return self.simulations * self.depth * int(self.places[-1].stop)

    @cached_property
    def waves(self) -> list[range]:
        """The simulations of each wave: few at first, as they know little."""
        found, done = [], 0
        while done < self.simulations:
            end = min(done + min(max(FIRST, done // SHARE), WIDEST), self.simulations)
            found.append(range(done, end))
            done = end
        return found

    def budget(self, rows: int) -> Budget:
        """What a search of so many rows may cost; refuses one that would be too much."""
        budget = Budget("search", "try fewer simulations, or a smaller depth", WORK)
        table = (self.simulations + 1) * self.slots * (2 + 2 * self.kinds)
        budget.hold(8.0 * rows * (table + 2 * self.draws))
        budget.expect(sum(self.depth * self._turn(rows, wave) for wave in self.waves))
        return budget

    def _turn(self, rows: int, wave: range) -> float:
        """What one turn of one wave takes."""
        return 10 * ROUND + 1000.0 * rows * len(wave)

    def values(self, asked: "Asked", u: Reals) -> "Found":
        """What is found out about each action, by uniforms `[B, draws]`."""
        rows = len(u)
        grown = _Grown(self, asked, self.budget(rows))
        told = u.reshape(rows, self.simulations, self.depth, -1)
        for wave in self.waves:
            grown.wave(len(wave), told, self._turn(rows, wave))
        return grown.found()

    def suggested(self, place: Ints) -> Array:
        """The actions of the slots `[N]` of a node where it has few of them: spread evenly."""
        own = self.problem.actions[self.seat]
        if isinstance(own, Interval):
            share = ((place * GOLDEN + 0.5) % 1.0).astype(float)
            return own.nearest(own.low + (own.high - own.low) * share)
        return (place * self._stride + self.choices // 2) % self.choices

    @cached_property
    def _stride(self) -> int:
        """A step through the actions that comes to each of them, far from the last."""
        steps = range(max(round(self.choices * GOLDEN), 1), self.choices + 1)
        return next((one for one in steps if gcd(one, self.choices) == 1), 1)


class Asked(NamedTuple):
    """From where it is searched, for B rows."""

    roots: Array  # [B, simulations, ...], the states that simulations start from
    left: Ints  # [B], turns to come
    memories: tuple[Memory, ...]  # of each of the cast
    legal: Bools | None = None  # [B, A]


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


class _Grown:
    """The trees of a batch, one a row, as they grow."""

    def __init__(self, tree: Tree, asked: Asked, budget: Budget) -> None:
        self.tree, self.asked, self.budget = tree, asked, budget
        rows = len(asked.left)
        self.nodes = tree.simulations + 1  # of one row: a simulation adds at most one
        many, slots = rows * self.nodes, tree.slots
        self.visits = np.zeros((many, slots))
        self.sums = np.zeros((many, slots))
        self.squares = np.zeros((rows, slots))  # of the returns of the roots' actions
        self.children = np.full((many, slots * tree.kinds), -1)
        self.free = np.arange(rows) * self.nodes + 1
        self.low, self.high = np.full(rows, np.inf), np.full(rows, -np.inf)
        if tree.widens:
            self.offers = np.zeros(many, np.int64)
            self.offered = np.zeros((many, slots), tree.suggested(np.zeros(1, np.int64)).dtype)
            self.steps = np.zeros(many, np.int64)
        if not tree.seen:
            self.keys = np.zeros((many, slots * tree.kinds), np.int64)
            self.kin = np.zeros((many, slots), np.int64)
            if not tree.problem.hidden:
                self.kept = np.empty((many, *asked.roots.shape[2:]), asked.roots.dtype)
                self.paid = np.zeros(many)

    def found(self) -> Found:
        """What is known of the actions at the roots."""
        visits = self.visits[:: self.nodes]
        means: Reals = np.full(visits.shape, -np.inf)
        np.divide(self.sums[:: self.nodes], visits, out=means, where=visits > 0)
        errors: Reals = np.full(visits.shape, np.inf)
        spread = self.squares - np.where(visits > 1, means, 0.0) ** 2 * visits
        np.divide(spread, visits * (visits - 1), out=errors, where=visits > 1)
        errors = np.maximum(errors, 0.0)
        actions = np.arange(visits.shape[1])[None].repeat(len(visits), axis=0)
        return Found(self.offered[:: self.nodes] if self.tree.widens else actions, means, errors)

    def wave(self, many: int, told: Reals, cost: float) -> None:
        """Runs so many simulations of every row and learns from them."""
        tree, asked = self.tree, self.asked
        row = np.repeat(np.arange(len(asked.left)), many)
        node = row * self.nodes
        legal = None if asked.legal is None else asked.legal[row]
        memories = tuple(tuple(part[row] for part in memory) for memory in asked.memories)
        if tree.widens:
            self._opened(node, memories, legal, told[row, 0, 0])
        slot, nth = self._selected(node, legal)
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
            slot, _ = self._selected(node, legal)
        outside.append(lanes.those(going & known))  # at the greatest depth
        gain = self._beyond(_together(outside), u, cost)
        self._learn(row, path, gain)

    def _opened(
        self, node: Ints, memories: tuple[Memory, ...], legal: Bools | None, u: Reals
    ) -> None:
        """Offers in nodes that are come to first what the seat's part of the cast would do."""
        tree = self.tree
        actor, place = tree.played[tree.seat], tree.places[tree.seat]
        new = np.flatnonzero(self.offers[node] == 0)
        if actor is None or not len(new):
            return
        _, first = np.unique(node[new], return_index=True)
        new = new[first]
        memory = tuple(part[new] for part in memories[tree.seat])
        able = None if legal is None else legal[new]
        self.offered[node[new], 0] = actor.choose(memory, able, u[new][:, place][:, : actor.draws])
        self.offers[node[new]] = 1

    def _selected(self, node: Ints, legal: Bools | None) -> tuple[Ints, Ints]:
        """The slots `[N]` of greatest bound, and how often each was chosen before.

        Lanes at one node choose as if one after another: as a bound falls with each visit, the
        first m choices are the m greatest bounds.
        """
        order = np.argsort(node, kind="stable")
        here, start, lanes = np.unique(node[order], return_index=True, return_counts=True)
        able = None if legal is None else legal[order[start]]
        if self.tree.widens:
            self._widen(here, lanes, able)
            able = np.arange(self.tree.slots) < self.offers[here][:, None]
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
        visits, row = self.visits[here], here // self.nodes
        span = np.maximum(self.high[row] - self.low[row], 1e-9)[:, None]
        with np.errstate(invalid="ignore"):  # before the first return the least is infinite
            scaled = (self.sums[here] / np.maximum(visits, 1) - self.low[row][:, None]) / span
        worth = np.where(visits > 0, scaled, 0.5)
        n = visits[:, :, None] + np.arange(most)
        total = np.log(visits.sum(axis=1) + lanes + 1)[:, None, None]
        bound = worth[:, :, None] + self.tree.exploration * np.sqrt(total / np.maximum(n, 1))
        bound[n == 0] = np.inf
        if able is not None:
            bound[~able] = -np.inf
        flat = bound.reshape(len(here), -1)
        if most == 1:
            best = np.argmax(flat, axis=1)[:, None]
        else:
            best = np.argsort(-flat, axis=1, kind="stable")[:, :most]
        slots = best // most
        before = np.take_along_axis(visits, slots, axis=1).astype(np.int64) + best % most
        return slots, before

    def _widen(self, here: Ints, lanes: Ints, legal: Bools | None) -> None:
        """Offers more actions where there were visits enough."""
        visits = self.visits[here].sum(axis=1) + lanes
        wanted = np.minimum(np.ceil(np.sqrt(visits)).astype(np.int64), self.tree.slots)
        while True:
            short = np.flatnonzero(self.offers[here] < wanted)
            if not len(short):
                return
            at = here[short]
            action = (
                self._near(at) if not self.tree.choices else self.tree.suggested(self.steps[at])
            )
            fits = np.ones(len(at), bool)
            if self.tree.choices:
                fits = (self.offered[at, 0] != action) | (self.offers[at] == 0)
                if legal is not None:
                    fits &= legal[short, action]
                wanted[short[self.steps[at] >= self.tree.choices]] = 0
            self.steps[at] += 1
            at, action = at[fits], action[fits]
            self.offered[at, self.offers[at]] = action
            self.offers[at] += 1

    def _near(self, at: Ints) -> Array:
        """The next numbers to try: evenly spread ones, and between them some near the best."""
        tree, place = self.tree, self.steps[at]
        own = tree.problem.actions[tree.seat]
        assert isinstance(own, Interval)
        visits = self.visits[at]
        mean = np.where(visits > 0, self.sums[at] / np.maximum(visits, 1), -np.inf)
        best = self.offered[at, np.argmax(mean, axis=1)]
        far = (own.high - own.low) * 0.5 ** (1 + place / HALVED)
        near = own.nearest(best + far * (2 * (place * GOLDEN % 1.0) - 1))
        return np.where((place % 2 == 1) & (visits > 0).any(axis=1), near, tree.suggested(place))

    def _acted(self, lanes: _Lanes, own: Array | None, u: Reals) -> Array:
        """Joint actions `[N, n]`: the seat's where they are given, else as the cast acts."""
        tree, problem = self.tree, self.tree.problem
        legal = problem.legal(lanes.state)
        columns: list[Array] = []
        for seat, actor in enumerate(tree.played):
            able = None if legal is None else legal[:, seat]
            now = u[:, tree.places[seat]]
            if seat == tree.seat and own is not None:
                column = own
                if able is not None and tree.choices:  # where unlike states share a node
                    fits = able[np.arange(len(own)), own]
                    column = np.where(fits, own, problem.actions[seat].draw(now[:, 0], able))
            elif actor is None:
                column = problem.actions[seat].draw(now[:, 0], able)
            else:
                column = actor.choose(lanes.memories[seat], able, now[:, : actor.draws])
            columns.append(column)
        joint = np.stack(columns, axis=1)
        if legal is not None and any(tree.played):
            for seat, waits in enumerate(problem.waiting(lanes.state).T):
                if waits.any():
                    joint[waits, seat] = problem.waits(seat)
        return joint

    def _stepped(self, lanes: _Lanes, joint: Array, u: Reals) -> Outcome:
        return self.tree.problem.step(lanes.state, joint, u[:, self.tree.places[-1]])

    def _after(self, lanes: _Lanes, joint: Array, outcome: Outcome) -> _Lanes:
        """The lanes once a turn is done."""
        problem = self.tree.problem
        memories = tuple(
            () if actor is None else actor.update(memory, problem.percept(seat, joint, outcome))
            for seat, (actor, memory) in enumerate(
                zip(self.tree.played, lanes.memories, strict=True)
            )
        )
        return lanes._replace(state=outcome.state, memories=memories, turn=lanes.turn + 1)

    def _followed(
        self, lanes: _Lanes, node: Ints, slot: Ints, u: Reals
    ) -> tuple[_Lanes, Ints, Bools, Reals]:
        """The lanes after a turn, the nodes they come to, which are known, and what it paid."""
        tree = self.tree
        joint = self._acted(lanes, self.offered[node, slot] if tree.widens else slot, u)
        outcome = self._stepped(lanes, joint, u)
        sights = outcome.observations[:, tree.seat] if tree.problem.hidden else outcome.state
        if tree.seen:
            sight = sights if tree.problem.hidden else tree.problem.index(outcome.state)
            child, known = self._child(node, slot * tree.kinds + sight)
        else:
            child, known = self._one_of_some(
                node, slot, _key(tree.problem, sights), u[:, tree.places[tree.seat].start], outcome
            )
            if not tree.problem.hidden:
                state, rewards = self.kept[child], outcome.rewards.copy()
                rewards[:, tree.seat] = self.paid[child]
                outcome = Outcome(state, rewards, state)
        return self._after(lanes, joint, outcome), child, known, outcome.rewards[:, tree.seat]

    def _child(self, node: Ints, edge: Ints) -> tuple[Ints, Bools]:
        """The node that each lane comes to, and whether it was there before this turn."""
        child = self.children[node, edge]
        known = child >= 0
        new = np.flatnonzero(~known)
        if len(new):
            keys = node[new] * self.children.shape[1] + edge[new]
            _, first, which = np.unique(keys, return_index=True, return_inverse=True)
            fresh = self._fresh(node[new][first])
            self.children[node[new][first], edge[new][first]] = fresh
            child[new] = fresh[which.reshape(-1)]
        return child, known

    def _fresh(self, above: Ints) -> Ints:
        """New nodes below these `[N]`, which rise."""
        row = above // self.nodes
        fresh = self.free[row] + np.arange(len(row)) - np.searchsorted(row, row)
        np.add.at(self.free, row, 1)
        return np.asarray(fresh)

    def _one_of_some(
        self, node: Ints, slot: Ints, key: Ints, u: Reals, outcome: Outcome
    ) -> tuple[Ints, Bools]:
        """The same where an edge tells few things apart: what is new may count as one of them."""
        kinds, slots = self.tree.kinds, self.tree.slots
        kin, children = self.kin.reshape(-1), self.children.reshape(-1, kinds)
        keys = self.keys.reshape(-1, kinds)
        edge = node * slots + slot
        fits = (keys[edge] == key[:, None]) & (np.arange(kinds) < kin[edge][:, None])
        place, known = np.argmax(fits, axis=1), fits.any(axis=1)
        new = np.flatnonzero(~known)
        if len(new):
            lanes, before = np.unique(edge, return_counts=True), kin[edge[new]]
            order = new[np.lexsort((key[new], edge[new]))]
            first = np.ones(len(order), bool)
            first[1:] = (np.diff(edge[order]) != 0) | (np.diff(key[order]) != 0)
            pair = order[first]
            at = edge[pair]
            nth = kin[at] + np.arange(len(at)) - np.searchsorted(at, at)
            visits = self.visits.reshape(-1)[at] + lanes[1][np.searchsorted(lanes[0], at)]
            made = nth < np.minimum(np.ceil(np.sqrt(visits)), kinds)
            pair, at, nth = pair[made], at[made], nth[made]
            fresh = self._fresh(node[pair])
            children[at, nth], keys[at, nth] = fresh, key[pair]
            np.add.at(kin, at, 1)
            if not self.tree.problem.hidden:
                self.kept[fresh] = outcome.state[pair]
                self.paid[fresh] = outcome.rewards[pair, self.tree.seat]
            here = edge[new]
            fits = (keys[here] == key[new][:, None]) & (np.arange(kinds) < kin[here][:, None])
            other = (u[new] * kin[here]).astype(np.int64)
            place[new] = np.where(fits.any(axis=1), np.argmax(fits, axis=1), other)
            known[new] = place[new] < before
        return children[edge, place], known

    def _beyond(self, lanes: _Lanes, u: Reals, cost: float) -> Reals:
        """What simulations `[N]` of a wave earn after they left the tree."""
        tree, problem = self.tree, self.tree.problem
        gain, weight = np.zeros(len(u)), 1.0
        if tree.worth is not None:
            own = lanes.memories[tree.seat]
            gain[lanes.lane] = tree.worth(lanes.state, own, lanes.left - lanes.turn)
            return gain
        while True:
            lanes = lanes.those(lanes.turn < np.minimum(lanes.left, tree.depth))
            if not len(lanes.lane):
                return gain
            self.budget.spend(cost)
            now = u[lanes.lane, lanes.turn]
            joint = self._acted(lanes, None, now)
            outcome = self._stepped(lanes, joint, now)
            gain[lanes.lane] += weight * outcome.rewards[:, tree.seat]
            weight *= problem.discount
            lanes = self._after(lanes, joint, outcome).those(~problem.terminal(outcome.state))

    def _learn(self, row: Ints, path: list[tuple[Ints, Ints, Ints, Reals]], gain: Reals) -> None:
        """Adds the returns from each node on to its sums."""
        discount = self.tree.problem.discount
        for lane, node, slot, paid in path[::-1]:
            gain[lane] = paid + discount * gain[lane]
            np.add.at(self.visits, (node, slot), 1)
            np.add.at(self.sums, (node, slot), gain[lane])
            np.minimum.at(self.low, row[lane], gain[lane])
            np.maximum.at(self.high, row[lane], gain[lane])
        np.add.at(self.squares, (row, path[0][2]), gain**2)


def _key(problem: Problem, sights: Array) -> Ints:
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
