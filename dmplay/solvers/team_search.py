"""Multi-agent A*: of all joint plans that are begun, the one that promises most is gone on with.

What each node of each agent does is chosen one by one, the last agent's nodes after all others, and
a plan promises what it has earned and what one planner who pools all observations would still earn
(GMAA*-ICE; Oliehoek, Spaan, Amato and Whiteson, JAIR 46, 2013; in small steps: Koops, Jansen,
Junges and Simão, IJCAI 2023). The first plan that is finished is the best.
"""

import heapq
from dataclasses import dataclass
from itertools import count
from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Ints, Reals
from dmplay.solvers.occupancy import Occupancy, merged
from dmplay.solvers.pooled_beliefs import Pooled
from dmplay.solvers.team import Layer, Plan, joined, nodes

STEP = 10 * ROUND  # work of looking at what one node may do
ENTRY = 400  # bytes of a plan to go on with
TINY = 1e-12  # by which two plans earn the same


@dataclass(frozen=True, eq=False)
class Stage:
    """A joint plan of the turns so far."""

    turn: int
    occupancy: Occupancy
    earned: float
    before: "Stage | None" = None
    layers: tuple[Layer, ...] = ()  # of each agent, for the turn before


class Found(NamedTuple):
    """The best joint plan, None where that takes too long; none is worth more than `bound`."""

    plans: tuple[Plan, ...] | None
    bound: float


class _Open(NamedTuple):
    """A plan to go on with, the least first: what some nodes do is given, others are free."""

    least: float  # what it promises, below 0
    depth: int
    number: int  # of those alike the one that was opened first
    stage: Stage
    given: tuple[int, ...]  # actions: of `_Game.slots`, then of the last agent's nodes


class _Game:
    """The choice of a turn: a game of one reward in which each node is a type of its agent."""

    def __init__(self, stage: Stage, pooled: Pooled) -> None:
        many, occupancy = pooled.team.actions, stage.occupancy
        self.counts, self.nodes = occupancy.counts, occupancy.nodes
        self.many, self.others = many, nodes(many[:-1])  # [B, n - 1]
        weight = pooled.team.discount**stage.turn * occupancy.p
        worth = pooled.worth(stage.turn, occupancy.belief) * weight[:, None]
        self.worth = worth.reshape(len(weight), len(self.others), many[-1])
        self.last = (self.nodes[:, -1] == np.arange(self.counts[-1])[:, None]).astype(float)
        self.slots: list[tuple[int, int]] = []  # nodes of all agents but the last, likely first
        for seat, size in enumerate(self.counts[:-1]):
            mass = np.bincount(self.nodes[:, seat], occupancy.p, size)
            self.slots += [(seat, int(node)) for node in np.argsort(-mass, kind="stable")]

    def best(self, given: tuple[int, ...] = ()) -> Reals:
        """The most that each action of the last agent's nodes promises `[K, A]`."""
        return np.asarray(self.last @ self._able(given).max(axis=1))

    def _able(self, given: tuple[int, ...]) -> Reals:
        """The worth `[J, B, A]` of joint actions, minus infinity of those not given."""
        able = np.ones(self.worth.shape[:2], bool)
        for (seat, node), action in zip(self.slots, given, strict=False):
            able[self.nodes[:, seat] == node] &= self.others[:, seat] == action
        return np.where(able[:, :, None], self.worth, -np.inf)

    def extended(self, given: tuple[int, ...]) -> Reals:
        """What the plan promises with each action `[A]` of the next slot."""
        able = self._able(given)
        seat, node = self.slots[len(given)]
        here = np.flatnonzero(self.nodes[:, seat] == node)
        free = able.max(axis=1)
        promised = self.last @ free
        found = np.empty(self.many[seat])
        for action in range(len(found)):
            taken = able[here][:, self.others[:, seat] == action].max(axis=1)
            more = self.last[:, here] @ (taken - free[here])
            found[action] = (promised + more).max(axis=1).sum()
        return found

    def rules(self, given: tuple[int, ...], last: Ints) -> tuple[Ints, ...]:
        """What each node `[K]` of each agent does."""
        rules = [np.zeros(size, np.int64) for size in self.counts[:-1]]
        for (seat, node), action in zip(self.slots, given, strict=False):
            rules[seat][node] = action
        return (*rules, last)


class Search:
    """The search for the best joint plan of so many turns."""

    def __init__(self, pooled: Pooled, budget: Budget) -> None:
        self.pooled, self.team, self.budget = pooled, pooled.team, budget
        self._open: list[_Open] = []
        self._earned: dict[tuple[int, bytes], float] = {}
        self._number, self._held = count(), 0.0

    def run(self) -> Found:
        """The best plan and its value; where the budget ends before, what none exceeds."""
        seats, bound = len(self.team.actions), self.pooled.most
        start = Occupancy(np.zeros((1, seats), np.int64), np.zeros(1, np.int64), np.ones(1))
        finished = None
        with self.budget.to_its_end():
            self._begin(Stage(0, start, 0.0), bound)
            while not finished:
                one = heapq.heappop(self._open)
                bound = min(bound, -one.least)
                finished = self._gone_on(one)
        return Found(_plans(finished), finished.earned) if finished else Found(None, bound)

    def _begin(self, stage: Stage, most: float) -> None:
        """Opens a stage of which nothing is given."""
        ahead = _Game(stage, self.pooled).best().max(axis=1).sum()
        self._push(stage, min(most, stage.earned + ahead))

    def _push(self, stage: Stage, promise: float, given: tuple[int, ...] = ()) -> None:
        depth = -(len(given) + 10_000 * stage.turn)
        self._held += ENTRY
        one = _Open(-float(promise), depth, next(self._number), stage, given)
        heapq.heappush(self._open, one)

    def _gone_on(self, one: _Open) -> Stage | None:
        """One step; the stage behind the last turn if that finishes a plan."""
        stage, given = one.stage, one.given
        game = _Game(stage, self.pooled)
        self.budget.spend(STEP + 8.0 * game.worth.size)
        self.budget.hold(self._held)
        if len(given) < len(game.slots):
            for action, most in enumerate(game.extended(given).tolist()):
                self._push(stage, min(-one.least, stage.earned + most), (*given, action))
            return None
        worth, free = game.best(given), len(given) - len(game.slots)
        rule = np.append(given[len(game.slots) :], worth[free:].argmax(axis=1)).astype(np.int64)
        self._rivals(one, worth, rule, free)
        after = self._taken(stage, game.rules(given, rule))
        if after.turn < self.pooled.turns:
            self._entered(after, -one.least)
            return None
        return after

    def _rivals(self, one: _Open, worth: Reals, rule: Ints, free: int) -> None:
        """Opens what else the last agent may do: another action at each node that is free."""
        chosen = worth[np.arange(len(rule)), rule]
        given = one.given[: len(one.given) - free]
        promise = np.minimum(one.stage.earned + chosen.sum() - chosen[:, None] + worth, -one.least)
        for node in range(free, len(rule)):
            for action in np.flatnonzero(np.arange(worth.shape[1]) != rule[node]).tolist():
                others = (*given, *rule[:node].tolist(), action)
                self._push(one.stage, promise[node, action], others)

    def _taken(self, stage: Stage, rules: tuple[Ints, ...]) -> Stage:
        """The stage after these actions."""
        turn, (nodes, belief, p) = stage.turn, stage.occupancy
        seen, pooled = self.team.observations, self.pooled
        each = [rule[own] for rule, own in zip(rules, nodes.T, strict=True)]
        actions = joined(each, self.team.actions)
        paid = float(p @ pooled.paid(turn, belief, actions))
        earned = stage.earned + self.team.discount**turn * paid
        if turn + 1 == pooled.turns:
            ends = [
                Layer(rule, np.zeros((len(rule), k), np.int64))
                for rule, k in zip(rules, seen, strict=True)
            ]
            return Stage(turn + 1, stage.occupancy, earned, stage, tuple(ends))
        after, likely = pooled.after(turn, belief, actions)
        row, kind = np.nonzero(likely)
        grown = nodes[row] * np.array(seen) + self.team.joint_observations[kind]
        many = tuple(len(rule) * k for rule, k in zip(rules, seen, strict=True))
        reached = Occupancy(grown, after[row, kind], p[row] * likely[row, kind])
        found, places = merged(reached, many)
        layers = [
            Layer(rule, np.maximum(place, 0).reshape(len(rule), -1))
            for rule, place in zip(rules, places, strict=True)
        ]
        return Stage(turn + 1, found, earned, stage, tuple(layers))

    def _entered(self, stage: Stage, promise: float) -> None:
        """Opens a stage, unless another way there has earned as much."""
        key = stage.turn, stage.occupancy.key
        if self._earned.get(key, -np.inf) < stage.earned - TINY:
            self._earned[key] = stage.earned
            self._held += 4.0 * len(key[1])
            self._begin(stage, promise)


def _plans(stage: Stage) -> tuple[Plan, ...]:
    """The plan of each agent that leads here."""
    layers = []
    while stage.before:
        layers.append(stage.layers)
        stage = stage.before
    return tuple(zip(*reversed(layers), strict=True))
