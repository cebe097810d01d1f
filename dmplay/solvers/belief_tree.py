"""The beliefs that a hidden problem leads to, each with two bounds of its value.

What was looked at once for a belief is never looked at again: only the plans and the points that
are new since. Without end all beliefs share one layer of bounds; of a number of turns, those with
as many to go do.
"""

from dataclasses import dataclass
from hashlib import blake2b

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Ints, Reals
from dmplay.solvers.belief_bounds import Beliefs, Layer
from dmplay.solvers.hidden_rows import HiddenRows

ALIKE = 12  # decimals: beliefs that agree so far are one
TOLD = 1e6  # operations, of which there are thousands a second
BYTES = 16.0  # of a number that is held, with the room that is kept for more
EACH = 30  # numbers that a belief in the tree takes beside its own


@dataclass(eq=False)
class Branch:
    """What an action leads to from a belief: K observations, and the beliefs after them."""

    reward: float
    seen: Ints  # [K]
    likely: Reals  # [K]
    after: Beliefs
    nodes: Ints  # [K], where the tree has them
    plans: int = 0  # looked at so far
    points: int = 0


class BeliefTree:
    """Beliefs by number, each known once, with what is known of their values."""

    def __init__(self, model: HiddenRows, layers: list[Layer], budget: Budget) -> None:
        """A tree of no belief but those at the start."""
        self.model, self.layers, self._budget = model, layers, budget
        self._owed = self.work = 0.0
        self.low, self.high = np.full(1024, -np.inf), np.full(1024, np.inf)  # [nodes]
        self.plan = np.zeros(1024, np.int64)  # [nodes], that gives the lower bound
        self.left: list[int] = []  # [nodes], turns to go
        self.branches: dict[int, list[Branch]] = {}  # of the beliefs that were expanded
        self._from: list[tuple[Beliefs, int]] = []
        self._known: dict[tuple[int, bytes], int] = {}
        self._size = 0
        self.full = False  # whether it could not hold what it was to
        sights = np.arange(len(model.start))
        self.root = self._branch(model.start, sights, 0.0, len(layers) - 1)

    def spend(self, work: float) -> None:
        """Counts work, told of only when it has come to something."""
        self._owed += work
        self.work += work
        if self._owed >= TOLD:
            owed, self._owed = self._owed, 0.0
            self._budget.spend(owed)

    def hold(self, numbers: int) -> None:
        """Refuses so many numbers more, before they are held."""
        self.full = BYTES * (self._size + numbers) > self._budget.memory
        self._budget.hold(BYTES * (self._size + numbers))
        self._size += numbers

    def layer(self, left: int) -> Layer:
        """The bounds with so many turns to go."""
        return self.layers[left if len(self.layers) > 1 else 0]

    def belief(self, node: int) -> tuple[Ints, Reals]:
        """The states that a belief holds possible `[U]`, and how likely they are."""
        among, row = self._from[node]
        some = np.flatnonzero(among.likely[row])
        return among.states[some], among.likely[row, some]

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
        self.spend(5 * ROUND + 20.0 * len(places) + model.kinds * size)
        weight = model.joint.values[places] * likely[which]
        cells = np.bincount(model.joint.columns[places], weight, model.kinds * size)
        joint = cells.astype(float).reshape(model.kinds, size)
        seen = np.flatnonzero(joint.any(axis=1))
        reward = float(likely @ model.rewards[action, states])
        return self._branch(joint[seen], seen, reward, left)

    def _branch(self, joint: Reals, seen: Ints, reward: float, left: int) -> Branch:
        """The beliefs of joint probabilities `[K, S]` of what is seen and a state."""
        states = np.flatnonzero(joint.any(axis=0))
        likely = joint.sum(axis=1)
        beliefs = joint[:, states] / likely[:, None]
        self.hold(beliefs.size + EACH * (1 + len(beliefs)))
        self.spend(len(beliefs) * ROUND / 2)
        after = Beliefs(states, beliefs)
        nodes = np.array([self._node(after, row, left) for row in range(len(seen))])
        branch = Branch(reward, seen, likely, after, nodes)
        np.minimum.at(self.high, nodes, self.layer(left).informed(after).max(axis=1))
        return branch

    def _node(self, after: Beliefs, row: int, left: int) -> int:
        """The number of a belief with so many turns to go."""
        likely = after.likely[row]
        some = likely > 0
        alike = np.round(likely[some], ALIKE).tobytes()
        told = blake2b(after.states[some].tobytes() + alike, digest_size=16)
        key = left * (len(self.layers) > 1), told.digest()
        node = self._known.setdefault(key, len(self._from))
        if node == len(self._from):
            self._from.append((after, row))
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
        branch.plans = layer.plans.count
        here = len(branch.after.states) * (0.5 + len(branch.seen) / 20)
        self.spend(2 * ROUND + here * (branch.plans - first))
        worth = layer.followed(branch.after, first)
        best = worth.argmax(axis=1)
        value = worth[np.arange(len(best)), best]
        better = value > self.low[branch.nodes]
        self.low[branch.nodes[better]] = value[better]
        self.plan[branch.nodes[better]] = first + best[better]

    def lowered(self, branch: Branch, left: int) -> bool:
        """Upper bounds after a branch, by the points that are new; whether there were any."""
        layer, first = self.layer(left), branch.points
        if first == layer.points.count:
            return False
        branch.points = layer.points.count
        self.spend(5 * ROUND + 20.0 * len(branch.seen) * (branch.points - first))
        high, work = layer.lowered(branch.after, self.high[branch.nodes], first)
        self.spend(work)
        np.minimum.at(self.high, branch.nodes, high)
        return True

    def pruned(self) -> None:
        """Forgets plans that are the best for no belief looked at.

        Who would go on with one goes on with what is now best where it was made.
        """
        nodes = np.fromiter(self.branches, int, len(self.branches))
        of = np.array(self.left) if len(self.layers) > 1 else np.zeros(len(self.left), int)
        kept, now, later = [], [], []
        for left, layer in enumerate(self.layers):
            first = np.arange(len(layer.highest))
            used = np.union1d(first, self.plan[nodes[of[nodes] == left]])
            place = np.full(layer.plans.count, -1)
            place[used] = np.arange(len(used))
            newest, made = place.copy(), layer.makers >= 0
            newest[made] = place[self.plan[layer.makers[made]]]
            kept.append(used)
            later.append(newest)
            now.append(np.where(place < 0, newest, place))
        for left, layer in enumerate(self.layers):
            here = np.flatnonzero(of == left)
            self.plan[here] = now[left][self.plan[here]]
            self.hold((len(kept[left]) - layer.plans.count) * self.model.states)
            layer.keep(kept[left], later[left - 1 if left else 0])
        for node, branches in self.branches.items():
            left = self.left[node] - 1 if len(self.layers) > 1 else 0
            for branch in branches:
                branch.plans = int(np.searchsorted(kept[left], branch.plans))

    def at_least(self, branch: Branch) -> float:
        """What an action is worth from below."""
        later = self.model.discount * float(branch.likely @ self.low[branch.nodes])
        return branch.reward + later

    def at_most(self, branch: Branch) -> float:
        """What an action is worth from above."""
        later = float(branch.likely @ self.high[branch.nodes])
        return branch.reward + self.model.discount * later
