"""The beliefs that a hidden problem leads to, each with two bounds of its value.

From below by vectors of plans that can be followed; from above by the values of single beliefs,
between which a convex function lies below their means (the sawtooth). What was looked at once for a
belief is never looked at again: only the plans and the points that are new since. Without end all
beliefs share one layer of bounds; of a number of turns, those with as many to go do.
"""

from dataclasses import dataclass

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Ints, Reals
from dmplay.solvers.hidden_rows import HiddenRows

ALIKE = 12  # decimals: beliefs that agree so far are one
WITHIN = 1.0 - 1e-9  # of a point's mass where a belief has some
TOLD = 1e6  # operations, of which there are thousands a second
BYTES = 40.0  # of a number of a belief in the tree, with all that is known of it


class Columns:
    """Vectors over the states, one beside the other."""

    def __init__(self, states: int) -> None:
        self.count = 0
        self._room = np.zeros((states, 16))

    @property
    def all(self) -> Reals:
        """Those that there are `[S, N]`."""
        return self._room[:, : self.count]

    def add(self, vector: Reals) -> int:
        """Takes one more; its place."""
        if self.count == self._room.shape[1]:
            self._room = np.hstack([self._room, np.zeros_like(self._room)])
        self._room[:, self.count] = vector
        self.count += 1
        return self.count - 1


class Layer:
    """What bounds the values of beliefs, with as many turns to go."""

    def __init__(self, lowest: Reals, highest: Reals) -> None:
        """Begins with vectors `[A, S]` from below and from above."""
        states = lowest.shape[1]
        self.highest, self.corners = highest, highest.max(axis=0)
        self.plans, self.points = Columns(states), Columns(states)
        self.actions: list[int] = []  # of the plans, their first
        self.deficits: list[float] = []  # of the points, how far they lie below the corners
        for action, vector in enumerate(lowest):
            self.plan(vector, action)

    def plan(self, vector: Reals, action: int) -> int:
        """Takes a plan; its place."""
        self.actions.append(action)
        return self.plans.add(vector)

    def point(self, belief: Reals, value: float) -> None:
        """Takes a belief `[S]` that is worth no more."""
        self.deficits.append(value - float(belief @ self.corners))
        self.points.add(belief)


@dataclass(eq=False)
class Branch:
    """What an action leads to from a belief: K observations, and the beliefs after them."""

    reward: float
    seen: Ints  # [K]
    likely: Reals  # [K]
    states: Ints  # [U], those that any of the beliefs holds possible
    beliefs: Reals  # [K, U]
    nodes: Ints  # [K], where the tree has the beliefs
    plans: int = 0  # looked at so far
    points: int = 0


class BeliefTree:
    """Beliefs by number, each known once, with what is known of their values."""

    def __init__(self, model: HiddenRows, layers: list[Layer], budget: Budget) -> None:
        """A tree of no belief but those at the start."""
        self.model, self.layers, self._budget = model, layers, budget
        self._owed = 0.0
        self.low, self.high = np.full(1024, -np.inf), np.full(1024, np.inf)  # [nodes]
        self.plan = np.zeros(1024, np.int64)  # [nodes], that gives the lower bound
        self.left: list[int] = []  # [nodes], turns to go
        self.branches: dict[int, list[Branch]] = {}  # of the beliefs that were expanded
        self._from: list[tuple[Branch, int]] = []
        self._known: dict[tuple[int, bytes, bytes], int] = {}
        self._size = 0
        sights = np.arange(len(model.start))
        self.root = self._branch(model.start, sights, 0.0, len(layers) - 1)

    def spend(self, work: float) -> None:
        """Counts work, told of only when it has come to something."""
        self._owed += work
        if self._owed >= TOLD:
            owed, self._owed = self._owed, 0.0
            self._budget.spend(owed)

    def layer(self, left: int) -> Layer:
        """The bounds with so many turns to go."""
        return self.layers[left if len(self.layers) > 1 else 0]

    def belief(self, node: int) -> tuple[Ints, Reals]:
        """The states that a belief holds possible `[U]`, and how likely they are."""
        branch, row = self._from[node]
        some = np.flatnonzero(branch.beliefs[row])
        return branch.states[some], branch.beliefs[row, some]

    def whole(self, node: int) -> Reals:
        """A belief over all states `[S]`."""
        dense = np.zeros(self.model.states)
        states, likely = self.belief(node)
        dense[states] = likely
        return dense

    def expanded(self, node: int) -> list[Branch]:
        """What each action leads to from a belief."""
        if node not in self.branches:
            states, likely = self.belief(node)
            left, actions = self.left[node] - 1, range(len(self.model.rewards))
            self.branches[node] = [self._after(states, likely, a, left) for a in actions]
        return self.branches[node]

    def _after(self, states: Ints, likely: Reals, action: int, left: int) -> Branch:
        """What an action leads to, with so many turns to go then."""
        model, size = self.model, self.model.states
        places, which = model.joint.places(action * size + states)
        self.spend(4 * ROUND + 12.0 * len(places) + model.kinds * size)
        weight = model.joint.values[places] * likely[which]
        cells = np.bincount(model.joint.columns[places], weight, model.kinds * size)
        joint = cells.astype(float).reshape(model.kinds, size)
        seen = np.unique(model.seen[places])
        reward = float(likely @ model.rewards[action, states])
        return self._branch(joint[seen], seen, reward, left)

    def _branch(self, joint: Reals, seen: Ints, reward: float, left: int) -> Branch:
        """The beliefs of joint probabilities `[K, S]` of what is seen and a state."""
        states = np.flatnonzero(joint.any(axis=0))
        likely = joint.sum(axis=1)
        beliefs = joint[:, states] / likely[:, None]
        self._size += beliefs.size + 4 * len(beliefs)
        self._budget.hold(BYTES * self._size)
        self.spend(len(beliefs) * ROUND)
        branch = Branch(reward, seen, likely, states, beliefs, np.zeros(len(seen), np.int64))
        branch.nodes[:] = [self._node(branch, row, left) for row in range(len(seen))]
        highest = (beliefs @ self.layer(left).highest[:, states].T).max(axis=1)
        np.minimum.at(self.high, branch.nodes, highest)
        self.raised(branch, left)
        return branch

    def _node(self, branch: Branch, row: int, left: int) -> int:
        """The number of a belief with so many turns to go."""
        likely = branch.beliefs[row]
        some = likely > 0
        alike = np.round(likely[some], ALIKE).tobytes()
        key = left * (len(self.layers) > 1), branch.states[some].tobytes(), alike
        node = self._known.setdefault(key, len(self._from))
        if node == len(self._from):
            self._from.append((branch, row))
            self.left.append(left)
            if node == len(self.low):
                self.low = np.append(self.low, np.full(node, -np.inf))
                self.high = np.append(self.high, np.full(node, np.inf))
                self.plan = np.append(self.plan, np.zeros(node, np.int64))
        return node

    def raised(self, branch: Branch, left: int) -> None:
        """Lower bounds after a branch, by the plans that are new."""
        layer, first = self.layer(left), branch.plans
        if first == layer.plans.count:
            return
        fresh = layer.plans.all[branch.states, first:]
        self.spend(ROUND + fresh.size * (1.0 + len(branch.seen) / 4))
        worth = branch.beliefs @ fresh
        best = worth.argmax(axis=1)
        value = worth[np.arange(len(best)), best]
        better = value > self.low[branch.nodes]
        self.low[branch.nodes[better]] = value[better]
        self.plan[branch.nodes[better]] = best[better] + first
        branch.plans = layer.plans.count

    def lowered(self, branch: Branch, left: int) -> bool:
        """Upper bounds after a branch, by the points that are new; whether there were any."""
        layer, first = self.layer(left), branch.points
        if first == layer.points.count:
            return False
        fresh, deficits = layer.points.all[branch.states, first:], np.array(layer.deficits[first:])
        self.spend(2 * ROUND + len(branch.seen) * (ROUND / 4 + 3.0 * fresh.size))
        base = branch.beliefs @ layer.corners[branch.states]
        possible = branch.beliefs > 0
        inside = possible @ fresh >= WITHIN
        for k in np.flatnonzero(inside.any(axis=1)):
            some, may = possible[k], inside[k]
            part = fresh[:, may] if some.all() else fresh[np.ix_(some, may)]
            with np.errstate(divide="ignore"):
                share = (branch.beliefs[k, some, None] / part).min(axis=0)
            value, node = base[k] + (share * deficits[may]).min(), branch.nodes[k]
            self.high[node] = min(self.high[node], value)
        branch.points = layer.points.count
        return True

    def at_least(self, branch: Branch) -> float:
        """What an action is worth from below."""
        later = self.model.discount * float(branch.likely @ self.low[branch.nodes])
        return branch.reward + later

    def at_most(self, branch: Branch) -> float:
        """What an action is worth from above."""
        later = float(branch.likely @ self.high[branch.nodes])
        return branch.reward + self.model.discount * later
