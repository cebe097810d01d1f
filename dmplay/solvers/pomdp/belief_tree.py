"""A tree of the reachable beliefs of a POMDP, with bounds on their values.

Each update of a branch looks only at the plans and points added since its last one. Without a
horizon all beliefs share one layer of bounds; else beliefs with the same turns left share one.
"""

from dataclasses import dataclass
from hashlib import blake2b

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.solvers.pomdp.belief_bounds import BeliefBatch, BoundLayer
from dmplay.solvers.pomdp.sparse_pomdp import SparsePomdp

BELIEF_DECIMALS = 12  # decimals: beliefs that are equal after rounding are one node
# operations between two reports to the budget; that makes thousands of reports per second
OPERATIONS_PER_REPORT = 1e6
BYTES_PER_NUMBER = 16.0  # bytes per stored number, including the spare room of growing arrays
NUMBERS_PER_NODE = 30  # numbers that a node takes besides its belief


@dataclass(eq=False)
class ActionBranch:
    """An action at a belief: its reward, the K possible observations, and the next beliefs."""

    reward: float
    observations: Ints  # [K]
    probabilities: Reals  # [K], of the observations
    next_beliefs: BeliefBatch
    child_nodes: Ints  # [K], in the tree
    checked_plan_count: int = 0  # plans checked so far
    checked_point_count: int = 0


class BeliefTree:
    """Numbered beliefs without duplicates, with lower and upper bounds on their values."""

    def __init__(self, model: SparsePomdp, layers: list[BoundLayer], budget: Budget) -> None:
        """Create a tree with the initial beliefs only, one per initial observation."""
        self.model, self.layers, self._budget = model, layers, budget
        self._unreported_work = self.work = 0.0
        # [nodes]
        self.lower_bounds, self.upper_bounds = np.full(1024, -np.inf), np.full(1024, np.inf)
        # [nodes], the plan that gives the lower bound
        self.lower_bound_plans = np.zeros(1024, np.int64)
        self.turns_left: list[int] = []  # [nodes]
        self.branches: dict[int, list[ActionBranch]] = {}  # of expanded nodes, indexed by action
        self._belief_rows: list[tuple[BeliefBatch, int]] = []
        self._node_index: dict[tuple[int, bytes], int] = {}
        self._stored_number_count = 0
        self.is_memory_full = False  # whether the memory limit was reached
        observations = np.arange(len(model.initial_joint))
        self.root = self._build_branch(model.initial_joint, observations, 0.0, len(layers) - 1)

    def spend_work(self, work: float) -> None:
        """Add to the work done, and report it to the budget in large portions."""
        self._unreported_work += work
        self.work += work
        if self._unreported_work >= OPERATIONS_PER_REPORT:
            unreported, self._unreported_work = self._unreported_work, 0.0
            self._budget.spend_work(unreported)

    def reserve_memory(self, number_count: int) -> None:
        """Reserve memory for this number of numbers; negative counts release memory.

        Raises BudgetExceeded, before the memory is used, if the budget does not allow it.
        """
        byte_count = BYTES_PER_NUMBER * (self._stored_number_count + number_count)
        self.is_memory_full = byte_count > self._budget.memory_limit
        self._budget.check_memory(byte_count)
        self._stored_number_count += number_count

    def get_layer(self, turns_left: int) -> BoundLayer:
        """Return the layer of bounds for this number of turns left."""
        return self.layers[turns_left if len(self.layers) > 1 else 0]

    def get_sparse_belief(self, node: int) -> tuple[Ints, Reals]:
        """Return the possible states of a node's belief `[U]` and their probabilities `[U]`."""
        batch, row = self._belief_rows[node]
        support = np.flatnonzero(batch.probabilities[row])
        return batch.support_states[support], batch.probabilities[row, support]

    def get_dense_belief(self, node: int) -> Reals:
        """Return a node's belief over all states `[S]`."""
        dense = np.zeros(self.model.state_count)
        states, probabilities = self.get_sparse_belief(node)
        dense[states] = probabilities
        return dense

    def expand_node(self, node: int) -> list[ActionBranch]:
        """Return the branches of a node, one per action, computing them the first time."""
        if node not in self.branches:
            states, probabilities = self.get_sparse_belief(node)
            turns_left, actions = self.turns_left[node] - 1, range(len(self.model.rewards))
            self.branches[node] = [
                self._expand_action(states, probabilities, a, turns_left) for a in actions
            ]
        return self.branches[node]

    def _expand_action(
        self, states: Ints, probabilities: Reals, action: int, turns_left: int
    ) -> ActionBranch:
        """Return the branch of an action at a belief, with `turns_left` turns left after it."""
        matrix, rewards = self.model.joint_probabilities, self.model.rewards
        shape = self.model.observation_count, self.model.state_count
        entries, state_rows = matrix.entries_of_rows(action * shape[1] + states)
        self.spend_work(5 * ARRAY_CALL_WORK + 20.0 * len(entries) + shape[0] * shape[1])
        weights = matrix.values[entries] * probabilities[state_rows]
        cells = np.bincount(matrix.columns[entries], weights, shape[0] * shape[1])
        joint = cells.astype(float).reshape(shape)
        observations = np.flatnonzero(joint.any(axis=1))
        reward = float(probabilities @ rewards[action, states])
        return self._build_branch(joint[observations], observations, reward, turns_left)

    def _build_branch(
        self, joint: Reals, observations: Ints, reward: float, turns_left: int
    ) -> ActionBranch:
        """Add nodes for the joint probabilities `[K, S]` and return their branch.

        A row has the probabilities of one observation with each next state.
        """
        states = np.flatnonzero(joint.any(axis=0))
        probabilities = joint.sum(axis=1)
        beliefs = joint[:, states] / probabilities[:, None]
        self.reserve_memory(beliefs.size + NUMBERS_PER_NODE * (1 + len(beliefs)))
        self.spend_work(len(beliefs) * ARRAY_CALL_WORK / 2)
        next_beliefs = BeliefBatch(states, beliefs)
        rows = range(len(observations))
        nodes = np.array([self._find_or_add_node(next_beliefs, row, turns_left) for row in rows])
        bounds = self.get_layer(turns_left).compute_informed_bounds(next_beliefs)
        np.minimum.at(self.upper_bounds, nodes, bounds.max(axis=1))
        return ActionBranch(reward, observations, probabilities, next_beliefs, nodes)

    def _find_or_add_node(self, next_beliefs: BeliefBatch, row: int, turns_left: int) -> int:
        """Return the node of a row's belief and turns left, adding it if it is new."""
        probabilities = next_beliefs.probabilities[row]
        is_possible = probabilities > 0
        rounded = np.round(probabilities[is_possible], BELIEF_DECIMALS).tobytes()
        content = next_beliefs.support_states[is_possible].tobytes() + rounded
        key = turns_left * (len(self.layers) > 1), blake2b(content, digest_size=16).digest()
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
        """Raise the lower bounds of a branch's nodes by the plans added since its last update."""
        layer, first_plan = self.get_layer(turns_left), branch.checked_plan_count
        if first_plan == layer.plan_vectors.column_count:
            return
        branch.checked_plan_count = layer.plan_vectors.column_count
        work_per_state = 0.5 + len(branch.observations) / 20
        work_per_plan = len(branch.next_beliefs.support_states) * work_per_state
        plan_count = branch.checked_plan_count - first_plan
        self.spend_work(2 * ARRAY_CALL_WORK + work_per_plan * plan_count)
        plan_values = layer.evaluate_plans(branch.next_beliefs, first_plan)
        best_plans = plan_values.argmax(axis=1)
        best_values = plan_values[np.arange(len(best_plans)), best_plans]
        is_better = best_values > self.lower_bounds[branch.child_nodes]
        self.lower_bounds[branch.child_nodes[is_better]] = best_values[is_better]
        self.lower_bound_plans[branch.child_nodes[is_better]] = first_plan + best_plans[is_better]

    def tighten_upper_bounds(self, branch: ActionBranch, turns_left: int) -> bool:
        """Lower the upper bounds of a branch's nodes by the points added since its last update.

        Returns whether there were any new points.
        """
        layer, first_point = self.get_layer(turns_left), branch.checked_point_count
        if first_point == layer.sawtooth_points.column_count:
            return False
        branch.checked_point_count = layer.sawtooth_points.column_count
        point_count = branch.checked_point_count - first_point
        self.spend_work(5 * ARRAY_CALL_WORK + 20.0 * len(branch.observations) * point_count)
        upper_bounds, work = layer.compute_sawtooth_bounds(
            branch.next_beliefs, self.upper_bounds[branch.child_nodes], first_point
        )
        self.spend_work(work)
        np.minimum.at(self.upper_bounds, branch.child_nodes, upper_bounds)
        return True

    def prune_plans(self) -> None:
        """Delete the plans that are best for no expanded belief and are not initial plans.

        A plan that continued with one built for a belief now continues with the plan that is best
        at that belief.
        """
        nodes = np.fromiter(self.branches, int, len(self.branches))
        layer_of_node = np.array(self.turns_left) * (len(self.layers) > 1)
        plans_to_keep, new_node_plans, new_next_plans = [], [], []
        for layer_index, layer in enumerate(self.layers):
            best_plans = self.lower_bound_plans[nodes[layer_of_node[nodes] == layer_index]]
            kept_indices = np.union1d(np.arange(len(layer.upper_vectors)), best_plans)
            new_index = np.full(layer.plan_vectors.column_count, -1)
            new_index[kept_indices] = np.arange(len(kept_indices))
            replacement, has_source = new_index.copy(), layer.source_beliefs >= 0
            source_plans = self.lower_bound_plans[layer.source_beliefs[has_source]]
            replacement[has_source] = new_index[source_plans]
            plans_to_keep.append(kept_indices)
            new_next_plans.append(replacement)
            new_node_plans.append(np.where(new_index < 0, replacement, new_index))
        for layer_index, layer in enumerate(self.layers):
            layer_nodes = np.flatnonzero(layer_of_node == layer_index)
            old_plans, kept_plans = self.lower_bound_plans[layer_nodes], plans_to_keep[layer_index]
            self.lower_bound_plans[layer_nodes] = new_node_plans[layer_index][old_plans]
            added_count = len(kept_plans) - layer.plan_vectors.column_count
            self.reserve_memory(added_count * self.model.state_count)
            layer.keep_plans(kept_plans, new_next_plans[max(layer_index - 1, 0)])
        for node, branches in self.branches.items():
            kept_plans = plans_to_keep[self.turns_left[node] - 1 if len(self.layers) > 1 else 0]
            for branch in branches:
                checked_plan_count = np.searchsorted(kept_plans, branch.checked_plan_count)
                branch.checked_plan_count = int(checked_plan_count)

    def compute_lower_bound(self, branch: ActionBranch) -> float:
        """Return the lower bound on the value of a branch's action."""
        next_value = float(branch.probabilities @ self.lower_bounds[branch.child_nodes])
        return branch.reward + self.model.discount * next_value

    def compute_upper_bound(self, branch: ActionBranch) -> float:
        """Return the upper bound on the value of a branch's action."""
        next_value = float(branch.probabilities @ self.upper_bounds[branch.child_nodes])
        return branch.reward + self.model.discount * next_value
