"""Point-based solution of a POMDP, with lower and upper bounds at reachable beliefs.

Trials lower the upper bound: from the start they choose the action with the greatest upper bound
and the observation with the greatest weighted gap, as deep as the gap matters. Games raise the
lower bound: they follow the best plans so far, with another action now and then, and sampled
observations, so that plans are made for the beliefs to which good play leads. On the way back the
bounds are backed up. When the number of beliefs has grown by a factor, plans are reevaluated that
continue for ever with the best ones, and the bounds of all beliefs are backed up. The search can be
stopped at any time. Source: Smith and Simmons, Point-based POMDP algorithms: improved analysis and
implementation (HSVI2, 2005); Kurniawati, Hsu and Lee, SARSOP (2008), for the tree that is kept;
Spaan and Vlassis, Perseus (2005), for the beliefs of games; Ji, Parr, Li, Liao and Carin,
Point-based policy iteration (2007), for the values of plans that continue.
"""

from contextlib import suppress
from itertools import product
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.best_actions import compute_reward_scale
from dmplay.core.problem import Problem
from dmplay.core.uniforms import make_numpy_generator
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.errors import BudgetExceeded
from dmplay.solvers.pomdp.belief_bounds import BoundLayer
from dmplay.solvers.pomdp.belief_tree import ActionBranch, BeliefTree
from dmplay.solvers.pomdp.sparse_pomdp import SparsePomdp, build_sparse_pomdp

DEFAULT_WORK_LIMIT = 1e10  # operations
MIN_GAP = 1e-6  # of rewards of about 1; a gap that is small enough, whatever the relative gap
TRIAL_GAP_SHARE = 0.9  # share of the gap at the start, below which a trial ends
MIN_CHANGE_SHARE = 1e-3  # share of the gap at the start; a smaller change adds no plan or point
MAX_TRIAL_TURNS = 500  # of a trial or game
MIN_GAME_WEIGHT = 0.02  # discounted weight below which a game ends
# in a game: of a random action, and of the action with the greatest upper bound
RANDOM_ACTION_PROBABILITY, OPTIMISTIC_ACTION_PROBABILITY = 0.1, 0.1
# of the number of beliefs between two updates of all beliefs
MIN_GROWTH_FACTOR, MAX_GROWTH_FACTOR = 1.2, 3.0
GROWTH_ADJUSTMENT = 1.2  # of the growth factor, down or up
MAX_PLAN_SWEEPS = 20  # over all plans
MAX_WITNESS_BELIEFS = 30  # beliefs at which a plan is made for each action

VectorsByAction = tuple[Reals, ...]  # of each first action, vectors [N, S]


class PointBasedBounds(NamedTuple):
    """Bounds on the value at the start, and plans that achieve the lower bound."""

    lower_bound: float
    upper_bound: float
    action_lower_bounds: Reals  # [A], of each first action
    action_upper_bounds: Reals  # [A]
    # indexed by turns left; one element without a horizon
    plans_by_turns_left: tuple[VectorsByAction, ...]
    expanded_belief_count: int  # expanded by the search
    is_gap_closed: bool  # whether the target gap was reached
    # whether the memory limit ended the search, so that more work does not help
    is_memory_full: bool = False
    has_all_vectors: bool = False  # whether the plans are all alpha vectors, so values are exact
    min_gap: float = MIN_GAP  # a gap that is not worth printing


def solve_point_based(
    problem: Problem,
    horizon: int | None,
    relative_gap: float,
    work_limit: float = DEFAULT_WORK_LIMIT,
) -> PointBasedBounds:
    """Return bounds on the value of a problem with this horizon; None for an infinite one.

    The search ends when the gap is at most `relative_gap` times the value, or at the work limit.
    Raises BudgetExceeded if there are no bounds before that.
    """
    remedy = "try more work, fewer states or turns, or the agent search"
    budget = Budget("point-based planning", remedy, work_limit)
    search = PointBasedSolver(build_sparse_pomdp(problem, budget), horizon, budget)
    while search.gap > search.compute_target_gap(relative_gap) and search.run_trial_or_game(
        relative_gap
    ):
        pass
    return search.collect_bounds(relative_gap)


class PointBasedSolver:
    """An anytime search that narrows the gap between two bounds, trial by trial."""

    def __init__(self, model: SparsePomdp, horizon: int | None, budget: Budget) -> None:
        """Compute the initial bounds."""
        self.model, self.budget = model, budget
        self.turns = horizon or 0
        self.min_gap = MIN_GAP * compute_reward_scale(model.rewards)
        self.tree = BeliefTree(model, _make_initial_layers(model, horizon, budget), budget)
        self.tree.tighten_lower_bounds(self.tree.root, self.turns)
        for node in self.tree.root.child_nodes.tolist():
            for branch in self.tree.expand_node(node):
                self.tree.tighten_lower_bounds(branch, self.turns - 1)
        self._game_work = self._trial_work = 0.0
        self._updated_belief_count = 10
        self._growth_factor = MIN_GROWTH_FACTOR
        self._gap_and_work_before = (self.gap, 0.0)
        self._generator = make_numpy_generator(0)

    @property
    def lower_bound(self) -> float:
        """The lower bound on the value at the start."""
        root = self.tree.root
        return float(root.probabilities @ self.tree.lower_bounds[root.child_nodes])

    @property
    def upper_bound(self) -> float:
        """The upper bound on the value at the start."""
        root = self.tree.root
        return float(root.probabilities @ self.tree.upper_bounds[root.child_nodes])

    @property
    def gap(self) -> float:
        """The upper minus the lower bound at the start."""
        return self.upper_bound - self.lower_bound

    def compute_target_gap(self, relative_gap: float) -> float:
        """Return the absolute gap at which the search ends."""
        return max(self.min_gap, relative_gap * max(abs(self.lower_bound), abs(self.upper_bound)))

    def run_trial_or_game(self, relative_gap: float) -> bool:
        """Run one more trial or game; return whether there was work left for it.

        Trials and games get equal amounts of work.
        """
        tree, work_before = self.tree, self.tree.work
        try:
            self.budget.check_work(self._reporting_work)
            if self._game_work <= self._trial_work:
                self._run_game()
                self._game_work += tree.work - work_before
            else:
                target_gap = self.compute_target_gap(relative_gap)
                self._run_trial(max(target_gap, TRIAL_GAP_SHARE * self.gap))
                self._trial_work += tree.work - work_before
            if len(tree.branches) > self._growth_factor * self._updated_belief_count:
                self._update_all_beliefs()
        except BudgetExceeded:
            return False
        return True

    def _update_all_beliefs(self) -> None:
        """Update the bounds of all expanded beliefs, from the last to the first.

        If that narrows the gap faster than trials and games do, the next update comes earlier, else
        later.
        """
        tree = self.tree
        old_gap, old_work = self._gap_and_work_before
        gain_rate = (old_gap - self.gap) / (tree.work - old_work)
        old_gap, old_work = self.gap, tree.work
        for node in [*tree.branches][::-1]:
            self._backup_upper_bound(node)
        tree.prune_plans()
        if not self.turns:
            self._reevaluate_plans()
        for node in [*tree.branches][::-1]:
            self._backup_lower_bound(node)
        tree.prune_plans()
        is_faster = old_gap - self.gap > gain_rate * (tree.work - old_work)
        growth_factor = self._growth_factor
        growth_factor *= 1 / GROWTH_ADJUSTMENT if is_faster else GROWTH_ADJUSTMENT
        self._growth_factor = min(max(growth_factor, MIN_GROWTH_FACTOR), MAX_GROWTH_FACTOR)
        self._updated_belief_count = len(tree.branches)
        self._gap_and_work_before = (self.gap, tree.work)

    def _reevaluate_plans(self) -> None:
        """Reevaluate the plans, which may continue with better plans than when they were made.

        Plans that raise a belief's lower bound are added to the layer.
        """
        tree, layer = self.tree, self.tree.layers[0]
        actions, next_plans = layer.plan_actions, layer.next_plans.T
        vectors = np.ascontiguousarray(layer.plan_vectors.array.T)
        number_count = len(vectors) * self.model.entry_count / len(self.model.rewards)
        tree.reserve_memory(vectors.size)  # The vectors are stored only until the end of the loop.
        for _ in range(MAX_PLAN_SWEEPS):
            tree.spend_work(8 * ARRAY_CALL_WORK + 6.0 * number_count)
            previous, vectors = vectors, self.model.backup_plans(vectors, actions, next_plans)
            if (vectors - previous).max() <= MIN_CHANGE_SHARE * self.gap:
                break
        tree.reserve_memory(-vectors.size)
        added_plans: dict[int, int] = {}
        for node in tree.branches:
            plan_index = int(tree.lower_bound_plans[node])
            states, probabilities = tree.get_sparse_belief(node)
            value = float(probabilities @ vectors[plan_index, states])
            if value > tree.lower_bounds[node] + MIN_CHANGE_SHARE * self.gap:
                if plan_index not in added_plans:
                    tree.reserve_memory(self.model.state_count)
                    plan = vectors[plan_index], int(actions[plan_index]), next_plans[plan_index]
                    added_plans[plan_index] = layer.add_plan(*plan, node)
                tree.lower_bounds[node] = value
                tree.lower_bound_plans[node] = added_plans[plan_index]

    def _run_trial(self, target_gap: float) -> None:
        """Run a trial: one path from the start to a small gap, then backups along it."""
        tree, branch, turns_left = self.tree, self.tree.root, self.turns
        path: list[int] = []
        while len(path) < MAX_TRIAL_TURNS and (turns_left or not self.turns):
            nodes = branch.child_nodes
            excess_gaps = tree.upper_bounds[nodes] - tree.lower_bounds[nodes] - target_gap
            k = int((branch.probabilities * excess_gaps).argmax())
            if path and excess_gaps[k] <= 0:
                break
            node = int(nodes[k])
            branches = tree.expand_node(node)
            path.append(node)
            turns_left, target_gap = turns_left - 1, target_gap / (self.model.discount or MIN_GAP)
            branch = branches[self._select_highest_upper_bound(branches, turns_left)]
            tree.tighten_lower_bounds(branch, turns_left)
        for node in path[::-1]:
            self._backup_lower_bound(node)
            self._backup_upper_bound(node)

    def _run_game(self) -> None:
        """Run a game with the best plans so far, then raise the lower bounds along its beliefs."""
        tree, branch, turns_left, weight = self.tree, self.tree.root, self.turns, 1.0
        path: list[int] = []
        while len(path) < MAX_TRIAL_TURNS and (turns_left or not self.turns):
            if weight <= MIN_GAME_WEIGHT:
                break
            observation_uniform, mode_uniform, action_uniform = self._generator.random(3)
            cumulative = branch.probabilities.cumsum()
            k = np.searchsorted(cumulative[:-1], observation_uniform * cumulative[-1], "right")
            node = int(branch.child_nodes[k])
            gap = tree.upper_bounds[node] - tree.lower_bounds[node]
            if path and gap <= MIN_CHANGE_SHARE * self.gap:
                break
            branches = tree.expand_node(node)
            path.append(node)
            turns_left, weight = turns_left - 1, weight * self.model.discount
            if mode_uniform < RANDOM_ACTION_PROBABILITY:
                branch = branches[int(action_uniform * len(branches))]
            elif mode_uniform < RANDOM_ACTION_PROBABILITY + OPTIMISTIC_ACTION_PROBABILITY:
                branch = max(branches, key=tree.compute_upper_bound)
            else:
                branch = branches[self._select_highest_lower_bound(branches, turns_left)]
        for node in path[::-1]:
            self._backup_lower_bound(node)

    def _select_highest_upper_bound(self, branches: list[ActionBranch], turns_left: int) -> int:
        """Return the action with the greatest upper bound, updating bounds as needed."""
        while True:
            upper_bounds = [self.tree.compute_upper_bound(branch) for branch in branches]
            best = upper_bounds.index(max(upper_bounds))
            if not self.tree.tighten_upper_bounds(branches[best], turns_left):
                return best

    def _select_highest_lower_bound(self, branches: list[ActionBranch], turns_left: int) -> int:
        """Return the action with the greatest lower bound.

        Only actions whose upper bound exceeds the best lower bound so far are updated.
        """
        best, best_bound = 0, -np.inf
        upper_bounds = [self.tree.compute_upper_bound(branch) for branch in branches]
        for action in sorted(range(len(upper_bounds)), key=upper_bounds.__getitem__)[::-1]:
            if upper_bounds[action] <= best_bound:
                break
            self.tree.tighten_lower_bounds(branches[action], turns_left)
            lower_bound = self.tree.compute_lower_bound(branches[action])
            if lower_bound > best_bound:
                best, best_bound = action, lower_bound
        return best

    def _backup_lower_bound(self, node: int) -> None:
        """Raise a belief's lower bound by a backup of the beliefs that follow it."""
        tree, branches = self.tree, self.tree.branches[node]
        tree.spend_work(2 * ARRAY_CALL_WORK)
        best = self._select_highest_lower_bound(branches, tree.turns_left[node] - 1)
        bound = tree.compute_lower_bound(branches[best])
        if bound > tree.lower_bounds[node] + MIN_CHANGE_SHARE * self.gap:
            self._add_better_plan(node, best)

    def _backup_upper_bound(self, node: int) -> None:
        """Lower a belief's upper bound by a backup of the beliefs that follow it."""
        tree, branches, turns_left = self.tree, self.tree.branches[node], self.tree.turns_left[node]
        tree.spend_work(2 * ARRAY_CALL_WORK)
        best = self._select_highest_upper_bound(branches, turns_left - 1)
        bound = tree.compute_upper_bound(branches[best])
        if bound < tree.upper_bounds[node] - MIN_CHANGE_SHARE * self.gap:
            tree.reserve_memory(self.model.state_count)
            tree.get_layer(turns_left).add_sawtooth_point(node, tree.get_dense_belief(node), bound)
        tree.upper_bounds[node] = min(tree.upper_bounds[node], bound)

    def _add_better_plan(self, node: int, action: int) -> None:
        """Add the plan that begins with an action at a belief, if it is better than any before."""
        tree, turns_left = self.tree, self.tree.turns_left[node]
        vector, next_plans = self._build_plan(tree.branches[node][action], action, turns_left)
        states, probabilities = tree.get_sparse_belief(node)
        value = float(probabilities @ vector[states])
        if value > tree.lower_bounds[node]:
            tree.reserve_memory(self.model.state_count)
            tree.lower_bounds[node] = value
            layer = tree.get_layer(turns_left)
            tree.lower_bound_plans[node] = layer.add_plan(vector, action, next_plans, node)

    def _build_plan(self, branch: ActionBranch, action: int, turns_left: int) -> tuple[Reals, Ints]:
        """Return the vector `[S]` and next plans of an action followed by the best known plans.

        An observation that is impossible here gets the plan that is best for the mean of all next
        beliefs.
        """
        layer, entries = self.tree.get_layer(turns_left - 1), self.model.get_action_slice(action)
        entry_count = entries.stop - entries.start
        states, vectors = branch.next_beliefs.support_states, layer.plan_vectors.array
        product_work = 1.0 * vectors.shape[1] * len(states)
        self.tree.spend_work(4 * ARRAY_CALL_WORK + 12.0 * entry_count + product_work)
        mean_belief = branch.probabilities @ branch.next_beliefs.probabilities
        usual_plan = int((mean_belief @ vectors[states]).argmax())
        next_plans = np.full(self.model.observation_count, usual_plan)
        next_plans[branch.observations] = self.tree.lower_bound_plans[branch.child_nodes]
        plans_of_entries = next_plans[self.model.observations[entries]]
        next_values = vectors[self.model.next_states[entries], plans_of_entries]
        return self.model.backup_plan(action, next_values), next_plans

    @property
    def _reporting_work(self) -> float:
        """The work reserved for collecting the result."""
        action_work = 8 * ARRAY_CALL_WORK * len(self.model.rewards)
        belief_count = min(MAX_WITNESS_BELIEFS, len(self.tree.branches))
        return belief_count * (action_work + 20.0 * self.model.entry_count)

    def collect_bounds(self, relative_gap: float) -> PointBasedBounds:
        """Return the bounds and plans computed so far."""
        tree = self.tree
        lower, upper = np.zeros((2, len(self.model.rewards)))
        for node, probability in zip(
            tree.root.child_nodes.tolist(), tree.root.probabilities, strict=True
        ):
            branches = tree.expand_node(node)
            with suppress(BudgetExceeded):
                for branch in branches:
                    tree.tighten_lower_bounds(branch, tree.turns_left[node] - 1)
            lower += [probability * tree.compute_lower_bound(branch) for branch in branches]
            upper += [probability * tree.compute_upper_bound(branch) for branch in branches]
        plans = tuple(map(self._collect_best_plans, range(len(tree.layers))))
        is_closed = self.gap <= self.compute_target_gap(relative_gap)
        return PointBasedBounds(
            self.lower_bound, self.upper_bound, lower, upper, plans, len(tree.branches), is_closed,
            tree.is_memory_full, min_gap=self.min_gap,
        )  # fmt: skip

    def _collect_best_plans(self, turns_left: int) -> VectorsByAction:
        """Return the plans of a layer that are best for some belief, and others for each action."""
        tree, layer = self.tree, self.tree.get_layer(turns_left)
        action_count = len(self.model.rewards)
        best_plans = tree.lower_bound_plans[: len(tree.turns_left)]
        if self.turns:
            best_plans = best_plans[np.array(tree.turns_left) == turns_left]
        used_plans = np.union1d(np.arange(action_count), best_plans)
        vectors = layer.plan_vectors.array.T[used_plans]
        actions = layer.plan_actions[used_plans]
        plans = [vectors[actions == a] for a in range(action_count)]
        witnesses = [
            node
            for node in [*tree.branches][:MAX_WITNESS_BELIEFS]
            if tree.turns_left[node] == turns_left or not self.turns
        ]
        with suppress(BudgetExceeded):
            for node, a in product(witnesses, range(action_count)):
                tree.tighten_lower_bounds(tree.branches[node][a], turns_left - 1)
                vector, _ = self._build_plan(tree.branches[node][a], a, turns_left)
                states, probabilities = tree.get_sparse_belief(node)
                best_value = (plans[a][:, states] @ probabilities).max()
                if probabilities @ vector[states] > best_value + self.min_gap:
                    plans[a] = np.vstack([plans[a], vector])
        return tuple(plans)


def _make_initial_layers(
    model: SparsePomdp, horizon: int | None, budget: Budget
) -> list[BoundLayer]:
    """Return the initial bounds: one layer without a horizon, else one per number of turns left."""
    if horizon is None:
        lower_vectors = model.compute_blind_lower_bound(budget)
        upper_vectors = model.compute_informed_upper_bound(budget)
        return [BoundLayer(lower_vectors, upper_vectors, model.observation_count)]
    action_count = len(model.rewards)
    zeros = np.zeros((action_count, model.state_count))
    layers = [BoundLayer(zeros, zeros, model.observation_count)]
    while len(layers) <= horizon:
        budget.check_memory(16.0 * len(layers) * 16 * model.state_count)
        budget.spend_work(2 * ARRAY_CALL_WORK + 8.0 * action_count * model.entry_count)
        lower_vectors = model.backup_blind_policies(layers[-1].plan_vectors.array.T[:action_count])
        upper_vectors = model.backup_informed_bound(layers[-1].upper_vectors)
        layers.append(BoundLayer(lower_vectors, upper_vectors, model.observation_count))
    return layers
