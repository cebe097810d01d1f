"""Values of a hidden problem of one agent between two bounds, at the beliefs that matter.

Trials bring the upper bound down: from the start by the action whose upper bound is the greatest
and the observation after which most is open, as deep as it weighs. Games bring the lower bound up:
by the plans that are known, with another action now and then, and what is observed drawn by its
chance, so that plans are made for the beliefs to which good play leads. On the way back bounds are
backed up. Where beliefs have become more, plans are valued anew that go on for ever with the best
ones, and the bounds of all beliefs are backed up. It can be stopped at any time. Source: Smith and
Simmons, Point-based POMDP algorithms: improved analysis and implementation (HSVI2, 2005);
Kurniawati, Hsu and Lee, SARSOP (2008), for the tree that is kept; Spaan and Vlassis, Perseus
(2005), for the beliefs of games; Ji, Parr, Li, Liao and Carin, Point-based policy iteration (2007),
for the values of plans that go on.
"""

from contextlib import suppress
from itertools import chain, product
from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Ints, Reals
from dmplay.core import Problem
from dmplay.dice import generator
from dmplay.errors import TooMuch
from dmplay.solvers.belief_bounds import Layer
from dmplay.solvers.belief_tree import BeliefTree, Branch
from dmplay.solvers.hidden_rows import HiddenRows, listed

WORK = 1e10  # operations
LEAST = 1e-6  # values so close are close enough, whatever share of them that is
DEEP = 0.9  # of what is open at the start: a trial ends where less is
FAINT = 1e-3  # of what is open: what moves a bound by less is no new plan or point
LONGEST = 500  # turns of a trial
UNSEEN = 0.02  # what the end of a game counts for
STRAYS, HOPES = 0.1, 0.1  # chances of any action, and of that which promises most, in a game
SOON, LATE = 1.2, 3.0  # times as many beliefs, after which what is known is brought to all
HASTE = 1.2  # by which that is done sooner, or later
SWEEPS = 20  # over plans, at most
WITNESSES = 30  # beliefs at which each action is given a plan

Plans = tuple[Reals, ...]  # of each first action, vectors [N, S]


class Bounds(NamedTuple):
    """What a problem is worth at the start, and plans that earn what is the least."""

    at_least: float
    at_most: float
    lower: Reals  # [A], of each first action
    upper: Reals  # [A]
    plans: tuple[Plans, ...]  # without end one; else by the turns to go
    beliefs: int  # from which was looked ahead
    close: bool  # whether the bounds are as close as they were to be
    full: bool = False  # whether memory ended the search, so that more work is of no use


def solved(problem: Problem, horizon: int | None, gap: float, work: float = WORK) -> Bounds:
    """The bounds of a problem without end, or of so many turns.

    It ends where they are apart by no more than this share of the value, or where the work is done.
    Raises TooMuch where there are no bounds before that.
    """
    cure = "try more work, fewer states or turns, or search"
    budget = Budget("a plan for what is believed", cure, work)
    search = PointBased(listed(problem, budget), horizon, budget)
    while search.apart > search.aim(gap) and search.tried(gap):
        pass
    return search.bounds(gap)


class PointBased:
    """A search between two bounds that goes on, trial by trial."""

    def __init__(self, model: HiddenRows, horizon: int | None, budget: Budget) -> None:
        """Finds the bounds to begin with."""
        self.model, self.budget = model, budget
        self.turns = horizon or 0
        self.tree = BeliefTree(model, _layers(model, horizon, budget), budget)
        self.tree.raised(self.tree.root, self.turns)
        for one in chain.from_iterable(map(self.tree.expanded, self.tree.root.nodes.tolist())):
            self.tree.raised(one, self.turns - 1)
        self._played = self._tried = 0.0
        self._settled, self._grown, self._since = 10, SOON, (self.apart, 0.0)
        self._random = generator(0)

    @property
    def at_least(self) -> float:
        """The value at the start, from below."""
        return float(self.tree.root.likely @ self.tree.low[self.tree.root.nodes])

    @property
    def at_most(self) -> float:
        """The value at the start, from above."""
        return float(self.tree.root.likely @ self.tree.high[self.tree.root.nodes])

    @property
    def apart(self) -> float:
        """What lies between them."""
        return self.at_most - self.at_least

    def aim(self, gap: float) -> float:
        """What may lie between them, as a share of the value."""
        return max(LEAST, gap * max(abs(self.at_least), abs(self.at_most)))

    def tried(self, gap: float) -> bool:
        """One more trial or game, to each as much work; whether there was work left for it."""
        tree, before = self.tree, self.tree.work
        try:
            self.budget.expect(self._reserved)
            if self._played <= self._tried:
                self._game()
                self._played += tree.work - before
            else:
                self._trial(max(self.aim(gap), DEEP * self.apart))
                self._tried += tree.work - before
            if len(tree.branches) > self._grown * self._settled:
                self._settle()
        except TooMuch:
            return False
        return True

    def _settle(self) -> None:
        """Brings what is known of some beliefs to all others, from the last to the first.

        Where that brings the bounds together in less work than trials and games do, it is done
        sooner the next time, else later.
        """
        tree = self.tree
        apart, work = self._since
        gained = (apart - self.apart) / (tree.work - work)
        apart, work = self.apart, tree.work
        for node in [*tree.branches][::-1]:
            self._lower(node)
        tree.pruned()
        if not self.turns:
            self._follow()
        for node in [*tree.branches][::-1]:
            self._raise(node)
        tree.pruned()
        sooner = apart - self.apart > gained * (tree.work - work)
        self._grown = min(max(self._grown * (1 / HASTE if sooner else HASTE), SOON), LATE)
        self._settled, self._since = len(tree.branches), (self.apart, tree.work)

    def _follow(self) -> None:
        """Values plans anew that go on with better ones than when they were made."""
        tree, layer = self.tree, self.tree.layers[0]
        actions, then = layer.actions, layer.then.T
        vectors = np.ascontiguousarray(layer.plans.all.T)
        numbers = len(vectors) * len(self.model.joint.values) / len(self.model.rewards)
        tree.hold(vectors.size)  # for a while
        for _ in range(SWEEPS):
            tree.spend(8 * ROUND + 6.0 * numbers)
            before, vectors = vectors, self.model.followed(vectors, actions, then)
            if (vectors - before).max() <= FAINT * self.apart:
                break
        tree.hold(-vectors.size)
        taken: dict[int, int] = {}
        for node in tree.branches:
            place = int(tree.plan[node])
            states, likely = tree.belief(node)
            value = float(likely @ vectors[place, states])
            if value > tree.low[node] + FAINT * self.apart:
                if place not in taken:
                    tree.hold(self.model.states)
                    action = int(actions[place])
                    taken[place] = layer.plan(vectors[place], action, then[place], node)
                tree.low[node], tree.plan[node] = value, taken[place]

    def _trial(self, aim: float) -> None:
        """One way down from the start, and back up."""
        tree, branch, left = self.tree, self.tree.root, self.turns
        path: list[int] = []
        while len(path) < LONGEST and (left or not self.turns):
            wide = tree.high[branch.nodes] - tree.low[branch.nodes] - aim
            k = int((branch.likely * wide).argmax())
            if path and wide[k] <= 0:
                break
            node = int(branch.nodes[k])
            branches = tree.expanded(node)
            path.append(node)
            left, aim = left - 1, aim / (self.model.discount or LEAST)
            branch = branches[self._promising(branches, left)]
            tree.raised(branch, left)
        for node in path[::-1]:
            self._raise(node)
            self._lower(node)

    def _game(self) -> None:
        """A game by the plans that are known, from whose end on better ones are made."""
        tree, branch, left, weight = self.tree, self.tree.root, self.turns, 1.0
        path: list[int] = []
        while weight > UNSEEN and len(path) < LONGEST and (left or not self.turns):
            observed, mood, any_one = self._random.random(3)
            below = branch.likely.cumsum()
            node = int(branch.nodes[np.searchsorted(below[:-1], observed * below[-1], "right")])
            if path and tree.high[node] - tree.low[node] <= FAINT * self.apart:
                break
            branches = tree.expanded(node)
            path.append(node)
            left, weight = left - 1, weight * self.model.discount
            if mood < STRAYS:
                branch = branches[int(any_one * len(branches))]
            elif mood < STRAYS + HOPES:
                branch = max(branches, key=tree.at_most)
            else:
                branch = branches[self._best_known(branches, left)]
        for node in path[::-1]:
            self._raise(node)

    def _promising(self, branches: list[Branch], left: int) -> int:
        """The action of the greatest upper bound, brought up to date."""
        while True:
            most = [self.tree.at_most(one) for one in branches]
            best = most.index(max(most))
            if not self.tree.lowered(branches[best], left):
                return best

    def _best_known(self, branches: list[Branch], left: int) -> int:
        """The action of the greatest lower bound, of those that may be better than it."""
        best, worth = 0, -np.inf
        most = [self.tree.at_most(one) for one in branches]
        for action in sorted(range(len(most)), key=most.__getitem__)[::-1]:
            if most[action] <= worth:
                break
            self.tree.raised(branches[action], left)
            least = self.tree.at_least(branches[action])
            if least > worth:
                best, worth = action, least
        return best

    def _raise(self, node: int) -> None:
        """The lower bound of a belief, by those of the beliefs that follow."""
        tree, branches = self.tree, self.tree.branches[node]
        tree.spend(2 * ROUND)
        best = self._best_known(branches, tree.left[node] - 1)
        if tree.at_least(branches[best]) > tree.low[node] + FAINT * self.apart:
            self._planned(node, best)

    def _lower(self, node: int) -> None:
        """The upper bound of a belief, by those of the beliefs that follow."""
        tree, branches, left = self.tree, self.tree.branches[node], self.tree.left[node]
        tree.spend(2 * ROUND)
        highest = tree.at_most(branches[self._promising(branches, left - 1)])
        if highest < tree.high[node] - FAINT * self.apart:
            tree.hold(self.model.states)
            tree.layer(left).point(node, tree.whole(node), highest)
        tree.high[node] = min(tree.high[node], highest)

    def _planned(self, node: int, action: int) -> None:
        """Takes the plan that begins with an action here, where it is better than any before."""
        tree, left = self.tree, self.tree.left[node]
        vector, then = self._plan(tree.branches[node][action], action, left)
        states, likely = tree.belief(node)
        value = float(likely @ vector[states])
        if value > tree.low[node]:
            tree.hold(self.model.states)
            tree.low[node] = value
            tree.plan[node] = tree.layer(left).plan(vector, action, then, node)

    def _plan(self, branch: Branch, action: int, left: int) -> tuple[Reals, Ints]:
        """The vector `[S]` of an action and the best plans after each observation.

        After what cannot be observed from here it is the plan for all that may follow together.
        """
        layer, here = self.tree.layer(left - 1), self.model.of_action(action)
        numbers = here.stop - here.start
        states, plans = branch.after.states, layer.plans.all
        self.tree.spend(4 * ROUND + 12.0 * numbers + 1.0 * layer.plans.count * len(states))
        mixed = branch.likely @ branch.after.likely
        chosen = np.full(self.model.kinds, int((mixed @ plans[states]).argmax()))
        chosen[branch.seen] = self.tree.plan[branch.nodes]
        after, seen = self.model.after[here], self.model.seen[here]
        return self.model.follow(action, plans[after, chosen[seen]]), chosen

    @property
    def _reserved(self) -> float:
        """The work that telling what is known takes."""
        many, numbers = len(self.model.rewards), len(self.model.joint.values)
        return min(WITNESSES, len(self.tree.branches)) * (8 * ROUND * many + 20.0 * numbers)

    def bounds(self, gap: float) -> Bounds:
        """What is known so far."""
        tree = self.tree
        lower, upper = np.zeros((2, len(self.model.rewards)))
        for node, likely in zip(tree.root.nodes.tolist(), tree.root.likely, strict=True):
            branches = tree.expanded(node)
            with suppress(TooMuch):
                for one in branches:
                    tree.raised(one, tree.left[node] - 1)
            lower += [likely * tree.at_least(one) for one in branches]
            upper += [likely * tree.at_most(one) for one in branches]
        plans = tuple(self._best(left) for left in range(len(tree.layers)))
        close = self.apart <= self.aim(gap)
        many = len(tree.branches)
        return Bounds(self.at_least, self.at_most, lower, upper, plans, many, close, tree.full)

    def _best(self, left: int) -> Plans:
        """The plans of a layer that are the best for some belief, and some of each action."""
        tree, layer = self.tree, self.tree.layer(left)
        many = len(self.model.rewards)
        here = np.array(tree.left) == left if self.turns else slice(len(tree.left))
        used = np.union1d(np.arange(many), tree.plan[: len(tree.left)][here])
        found = layer.plans.all.T[used]
        actions = layer.actions[used]
        plans = [found[actions == a] for a in range(many)]
        witnesses = [
            node
            for node in [*tree.branches][:WITNESSES]
            if tree.left[node] == left or not self.turns
        ]
        with suppress(TooMuch):
            for node, a in product(witnesses, range(many)):
                tree.raised(tree.branches[node][a], left - 1)
                vector, _ = self._plan(tree.branches[node][a], a, left)
                states, likely = tree.belief(node)
                if likely @ vector[states] > (plans[a][:, states] @ likely).max() + LEAST:
                    plans[a] = np.vstack([plans[a], vector])
        return tuple(plans)


def _layers(model: HiddenRows, horizon: int | None, budget: Budget) -> list[Layer]:
    """The first bounds: without end a layer, or one for each number of turns to go."""
    if horizon is None:
        return [Layer(model.lowest(budget), model.highest(budget), model.kinds)]
    many, numbers = len(model.rewards), len(model.joint.values)
    nothing = np.zeros((many, model.states))
    layers = [Layer(nothing, nothing, model.kinds)]
    while len(layers) <= horizon:
        budget.hold(16.0 * len(layers) * 16 * model.states)
        budget.spend(2 * ROUND + 8.0 * many * numbers)
        low, high = layers[-1].plans.all[:, :many].T, layers[-1].highest
        layers.append(Layer(model.blind(low), model.informed(high), model.kinds))
    return layers
