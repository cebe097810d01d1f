"""The beliefs that a hidden problem leads to, each with two bounds of its value.

What was looked at once for a belief is never looked at again: only the plans and the points that
are new since. Without end all beliefs share one layer of bounds; of a number of turns, those with
as many to go do.
"""

from dataclasses import dataclass
from hashlib import blake2b

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Ints, Reals
from dmplay.solvers.belief_bounds import BeliefBatch, BoundLayer
from dmplay.solvers.hidden_rows import SparsePomdp

BELIEF_DECIMALS = 12  # decimals: beliefs that agree so far are one
OPERATIONS_PER_REPORT = 1e6  # operations, of which there are thousands a second
BYTES_PER_NUMBER = 16.0  # of a number that is held, with the room that is kept for more
NUMBERS_PER_NODE = 30  # numbers that a belief in the tree takes beside its own


@dataclass(eq=False)
class ActionBranch:
    """What an action leads to from a belief: K observations, and the beliefs after them."""

    reward: float
    observations: Ints  # [K]
    probabilities: Reals  # [K]
    next_beliefs: BeliefBatch
    child_nodes: Ints  # [K], where the tree has them
    checked_plan_count: int = 0  # looked at so far
    checked_point_count: int = 0


class BeliefTree:
    """Beliefs by number, each known once, with what is known of their values."""

    def __init__(self, model: SparsePomdp, layers: list[BoundLayer], budget: Budget) -> None:
        """A tree of no belief but those at the start."""
        self.model, self.layers, self._budget = model, layers, budget
        self._unreported_work = self.work = 0.0
        self.lower_bounds, self.upper_bounds = (
            np.full(1024, -np.inf),
            np.full(1024, np.inf),
        )  # [nodes]
        self.lower_bound_plans = np.zeros(1024, np.int64)  # [nodes], that gives the lower bound
        self.turns_left: list[int] = []  # [nodes], turns to go
        self.branches: dict[int, list[ActionBranch]] = {}  # of the beliefs that were expanded
        self._belief_rows: list[tuple[BeliefBatch, int]] = []
        self._node_index: dict[tuple[int, bytes], int] = {}
        self._stored_number_count = 0
        self.is_memory_full = False  # whether it could not hold what it was to
        sights = np.arange(len(model.initial_joint))
        self.root = self._add_branch(model.initial_joint, sights, 0.0, len(layers) - 1)

    def spend_work(self, work: float) -> None:
        """Counts work, told of only when it has come to something."""
        self._unreported_work += work
        self.work += work
        if self._unreported_work >= OPERATIONS_PER_REPORT:
            owed, self._unreported_work = self._unreported_work, 0.0
            self._budget.spend_work(owed)

    def reserve_memory(self, number_count: int) -> None:
        """Refuses so many numbers more, before they are held."""
        self.is_memory_full = (
            BYTES_PER_NUMBER * (self._stored_number_count + number_count)
            > self._budget.memory_limit
        )
        self._budget.check_memory(BYTES_PER_NUMBER * (self._stored_number_count + number_count))
        self._stored_number_count += number_count

    def get_layer(self, turns_left: int) -> BoundLayer:
        """The bounds with so many turns to go."""
        return self.layers[turns_left if len(self.layers) > 1 else 0]

    def get_sparse_belief(self, node: int) -> tuple[Ints, Reals]:
        """The states that a belief holds possible `[U]`, and how likely they are."""
        among, row = self._belief_rows[node]
        some = np.flatnonzero(among.probabilities[row])
        return among.support_states[some], among.probabilities[row, some]

    def get_dense_belief(self, node: int) -> Reals:
        """A belief over all states `[S]`."""
        dense = np.zeros(self.model.state_count)
        states, likely = self.get_sparse_belief(node)
        dense[states] = likely
        return dense

    def expand_node(self, node: int) -> list[ActionBranch]:
        """What each action leads to from a belief."""
        if node not in self.branches:
            states, likely = self.get_sparse_belief(node)
            left, actions = self.turns_left[node] - 1, range(len(self.model.rewards))
            self.branches[node] = [self._expand_action(states, likely, a, left) for a in actions]
        return self.branches[node]

    def _expand_action(
        self, states: Ints, probabilities: Reals, action: int, turns_left: int
    ) -> ActionBranch:
        """What an action leads to, with so many turns to go then."""
        model, size = self.model, self.model.state_count
        places, which = model.joint_probabilities.entries_of_rows(action * size + states)
        self.spend_work(5 * ARRAY_CALL_WORK + 20.0 * len(places) + model.observation_count * size)
        weight = model.joint_probabilities.values[places] * probabilities[which]
        cells = np.bincount(
            model.joint_probabilities.columns[places], weight, model.observation_count * size
        )
        joint = cells.astype(float).reshape(model.observation_count, size)
        seen = np.flatnonzero(joint.any(axis=1))
        reward = float(probabilities @ model.rewards[action, states])
        return self._add_branch(joint[seen], seen, reward, turns_left)

    def _add_branch(
        self, joint: Reals, observations: Ints, reward: float, turns_left: int
    ) -> ActionBranch:
        """The beliefs of joint probabilities `[K, S]` of what is seen and a state."""
        states = np.flatnonzero(joint.any(axis=0))
        likely = joint.sum(axis=1)
        beliefs = joint[:, states] / likely[:, None]
        self.reserve_memory(beliefs.size + NUMBERS_PER_NODE * (1 + len(beliefs)))
        self.spend_work(len(beliefs) * ARRAY_CALL_WORK / 2)
        after = BeliefBatch(states, beliefs)
        nodes = np.array(
            [self._find_or_add_node(after, row, turns_left) for row in range(len(observations))]
        )
        branch = ActionBranch(reward, observations, likely, after, nodes)
        np.minimum.at(
            self.upper_bounds,
            nodes,
            self.get_layer(turns_left).compute_informed_bounds(after).max(axis=1),
        )
        return branch

    def _find_or_add_node(self, next_beliefs: BeliefBatch, row: int, turns_left: int) -> int:
        """The number of a belief with so many turns to go."""
        likely = next_beliefs.probabilities[row]
        some = likely > 0
        alike = np.round(likely[some], BELIEF_DECIMALS).tobytes()
        told = blake2b(next_beliefs.support_states[some].tobytes() + alike, digest_size=16)
        key = turns_left * (len(self.layers) > 1), told.digest()
        node = self._node_index.setdefault(key, len(self._belief_rows))
        if node == len(self._belief_rows):
            self._belief_rows.append((next_beliefs, row))
            self.turns_left.append(turns_left)
            if node == len(self.lower_bounds):
                self.lower_bounds = np.append(self.lower_bounds, np.full(node, -np.inf))
                self.upper_bounds = np.append(self.upper_bounds, np.full(node, np.inf))
                self.lower_bound_plans = np.append(self.lower_bound_plans, np.zeros(node, np.int64))
        return node

    def tighten_lower_bounds(self, branch: ActionBranch, turns_left: int) -> None:
        """Lower bounds after a branch, by the plans that are new."""
        layer, first = self.get_layer(turns_left), branch.checked_plan_count
        if first == layer.plan_vectors.column_count:
            return
        branch.checked_plan_count = layer.plan_vectors.column_count
        here = len(branch.next_beliefs.support_states) * (0.5 + len(branch.observations) / 20)
        self.spend_work(2 * ARRAY_CALL_WORK + here * (branch.checked_plan_count - first))
        worth = layer.evaluate_plans(branch.next_beliefs, first)
        best = worth.argmax(axis=1)
        value = worth[np.arange(len(best)), best]
        better = value > self.lower_bounds[branch.child_nodes]
        self.lower_bounds[branch.child_nodes[better]] = value[better]
        self.lower_bound_plans[branch.child_nodes[better]] = first + best[better]

    def tighten_upper_bounds(self, branch: ActionBranch, turns_left: int) -> bool:
        """Upper bounds after a branch, by the points that are new; whether there were any."""
        layer, first = self.get_layer(turns_left), branch.checked_point_count
        if first == layer.sawtooth_points.column_count:
            return False
        branch.checked_point_count = layer.sawtooth_points.column_count
        self.spend_work(
            5 * ARRAY_CALL_WORK
            + 20.0 * len(branch.observations) * (branch.checked_point_count - first)
        )
        high, work = layer.compute_sawtooth_bounds(
            branch.next_beliefs, self.upper_bounds[branch.child_nodes], first
        )
        self.spend_work(work)
        np.minimum.at(self.upper_bounds, branch.child_nodes, high)
        return True

    def prune_plans(self) -> None:
        """Forgets plans that are the best for no belief looked at.

        Who would go on with one goes on with what is now best where it was made.
        """
        nodes = np.fromiter(self.branches, int, len(self.branches))
        of = (
            np.array(self.turns_left)
            if len(self.layers) > 1
            else np.zeros(len(self.turns_left), int)
        )
        kept, now, later = [], [], []
        for left, layer in enumerate(self.layers):
            first = np.arange(len(layer.upper_vectors))
            used = np.union1d(first, self.lower_bound_plans[nodes[of[nodes] == left]])
            place = np.full(layer.plan_vectors.column_count, -1)
            place[used] = np.arange(len(used))
            newest, made = place.copy(), layer.source_beliefs >= 0
            newest[made] = place[self.lower_bound_plans[layer.source_beliefs[made]]]
            kept.append(used)
            later.append(newest)
            now.append(np.where(place < 0, newest, place))
        for left, layer in enumerate(self.layers):
            here = np.flatnonzero(of == left)
            self.lower_bound_plans[here] = now[left][self.lower_bound_plans[here]]
            self.reserve_memory(
                (len(kept[left]) - layer.plan_vectors.column_count) * self.model.state_count
            )
            layer.keep_plans(kept[left], later[left - 1 if left else 0])
        for node, branches in self.branches.items():
            left = self.turns_left[node] - 1 if len(self.layers) > 1 else 0
            for branch in branches:
                branch.checked_plan_count = int(
                    np.searchsorted(kept[left], branch.checked_plan_count)
                )

    def compute_lower_bound(self, branch: ActionBranch) -> float:
        """What an action is worth from below."""
        later = self.model.discount * float(
            branch.probabilities @ self.lower_bounds[branch.child_nodes]
        )
        return branch.reward + later

    def compute_upper_bound(self, branch: ActionBranch) -> float:
        """What an action is worth from above."""
        later = float(branch.probabilities @ self.upper_bounds[branch.child_nodes])
        return branch.reward + self.model.discount * later
