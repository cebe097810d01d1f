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

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Ints, Reals
from dmplay.core import Problem
from dmplay.dice import make_generator
from dmplay.errors import BudgetExceeded
from dmplay.solvers.belief_bounds import BoundLayer
from dmplay.solvers.belief_tree import ActionBranch, BeliefTree
from dmplay.solvers.hidden_rows import SparsePomdp, build_sparse_pomdp

DEFAULT_WORK_LIMIT = 1e10  # operations
MIN_GAP = 1e-6  # values so close are close enough, whatever share of them that is
TRIAL_GAP_SHARE = 0.9  # of what is open at the start: a trial ends where less is
MIN_CHANGE_SHARE = 1e-3  # of what is open: what moves a bound by less is no new plan or point
MAX_TRIAL_TURNS = 500  # turns of a trial
MIN_GAME_WEIGHT = 0.02  # what the end of a game counts for
RANDOM_ACTION_PROBABILITY, OPTIMISTIC_ACTION_PROBABILITY = (
    0.1,
    0.1,
)  # chances of any action, and of that which promises most, in a game
MIN_GROWTH_FACTOR, MAX_GROWTH_FACTOR = (
    1.2,
    3.0,
)  # times as many beliefs, after which what is known is brought to all
GROWTH_ADJUSTMENT = 1.2  # by which that is done sooner, or later
MAX_PLAN_SWEEPS = 20  # over plans, at most
MAX_WITNESS_BELIEFS = 30  # beliefs at which each action is given a plan

VectorsByAction = tuple[Reals, ...]  # of each first action, vectors [N, S]


class PointBasedBounds(NamedTuple):
    """What a problem is worth at the start, and plans that earn what is the least."""

    lower_bound: float
    upper_bound: float
    action_lower_bounds: Reals  # [A], of each first action
    action_upper_bounds: Reals  # [A]
    plans_by_turns_left: tuple[VectorsByAction, ...]  # without end one; else by the turns to go
    expanded_belief_count: int  # from which was looked ahead
    is_gap_closed: bool  # whether the bounds are as close as they were to be
    is_memory_full: bool = False  # whether memory ended the search, so that more work is of no use


def solve_point_based(
    problem: Problem,
    horizon: int | None,
    relative_gap: float,
    work_limit: float = DEFAULT_WORK_LIMIT,
) -> PointBasedBounds:
    """The bounds of a problem without end, or of so many turns.

    It ends where they are apart by no more than this share of the value, or where the work is done.
    Raises TooMuch where there are no bounds before that.
    """
    cure = "try more work, fewer states or turns, or search"
    budget = Budget("a plan for what is believed", cure, work_limit)
    search = PointBasedSolver(build_sparse_pomdp(problem, budget), horizon, budget)
    while search.gap > search.compute_target_gap(relative_gap) and search.run_trial_or_game(
        relative_gap
    ):
        pass
    return search.collect_bounds(relative_gap)


class PointBasedSolver:
    """A search between two bounds that goes on, trial by trial."""

    def __init__(self, model: SparsePomdp, horizon: int | None, budget: Budget) -> None:
        """Finds the bounds to begin with."""
        self.model, self.budget = model, budget
        self.turns = horizon or 0
        self.tree = BeliefTree(model, _make_initial_layers(model, horizon, budget), budget)
        self.tree.tighten_lower_bounds(self.tree.root, self.turns)
        for one in chain.from_iterable(
            map(self.tree.expand_node, self.tree.root.child_nodes.tolist())
        ):
            self.tree.tighten_lower_bounds(one, self.turns - 1)
        self._game_work = self._trial_work = 0.0
        self._updated_belief_count, self._growth_factor, self._gap_and_work_before = (
            10,
            MIN_GROWTH_FACTOR,
            (self.gap, 0.0),
        )
        self._generator = make_generator(0)

    @property
    def lower_bound(self) -> float:
        """The value at the start, from below."""
        return float(
            self.tree.root.probabilities @ self.tree.lower_bounds[self.tree.root.child_nodes]
        )

    @property
    def upper_bound(self) -> float:
        """The value at the start, from above."""
        return float(
            self.tree.root.probabilities @ self.tree.upper_bounds[self.tree.root.child_nodes]
        )

    @property
    def gap(self) -> float:
        """What lies between them."""
        return self.upper_bound - self.lower_bound

    def compute_target_gap(self, relative_gap: float) -> float:
        """What may lie between them, as a share of the value."""
        return max(MIN_GAP, relative_gap * max(abs(self.lower_bound), abs(self.upper_bound)))

    def run_trial_or_game(self, relative_gap: float) -> bool:
        """One more trial or game, to each as much work; whether there was work left for it."""
        tree, before = self.tree, self.tree.work
        try:
            self.budget.check_work(self._reporting_work)
            if self._game_work <= self._trial_work:
                self._run_game()
                self._game_work += tree.work - before
            else:
                self._run_trial(
                    max(self.compute_target_gap(relative_gap), TRIAL_GAP_SHARE * self.gap)
                )
                self._trial_work += tree.work - before
            if len(tree.branches) > self._growth_factor * self._updated_belief_count:
                self._update_all_beliefs()
        except BudgetExceeded:
            return False
        return True

    def _update_all_beliefs(self) -> None:
        """Brings what is known of some beliefs to all others, from the last to the first.

        Where that brings the bounds together in less work than trials and games do, it is done
        sooner the next time, else later.
        """
        tree = self.tree
        apart, work = self._gap_and_work_before
        gained = (apart - self.gap) / (tree.work - work)
        apart, work = self.gap, tree.work
        for node in [*tree.branches][::-1]:
            self._backup_upper_bound(node)
        tree.prune_plans()
        if not self.turns:
            self._reevaluate_plans()
        for node in [*tree.branches][::-1]:
            self._backup_lower_bound(node)
        tree.prune_plans()
        sooner = apart - self.gap > gained * (tree.work - work)
        self._growth_factor = min(
            max(
                self._growth_factor * (1 / GROWTH_ADJUSTMENT if sooner else GROWTH_ADJUSTMENT),
                MIN_GROWTH_FACTOR,
            ),
            MAX_GROWTH_FACTOR,
        )
        self._updated_belief_count, self._gap_and_work_before = (
            len(tree.branches),
            (self.gap, tree.work),
        )

    def _reevaluate_plans(self) -> None:
        """Values plans anew that go on with better ones than when they were made."""
        tree, layer = self.tree, self.tree.layers[0]
        actions, then = layer.plan_actions, layer.next_plans.T
        vectors = np.ascontiguousarray(layer.plan_vectors.array.T)
        numbers = (
            len(vectors) * len(self.model.joint_probabilities.values) / len(self.model.rewards)
        )
        tree.reserve_memory(vectors.size)  # for a while
        for _ in range(MAX_PLAN_SWEEPS):
            tree.spend_work(8 * ARRAY_CALL_WORK + 6.0 * numbers)
            before, vectors = vectors, self.model.backup_plans(vectors, actions, then)
            if (vectors - before).max() <= MIN_CHANGE_SHARE * self.gap:
                break
        tree.reserve_memory(-vectors.size)
        taken: dict[int, int] = {}
        for node in tree.branches:
            place = int(tree.lower_bound_plans[node])
            states, likely = tree.get_sparse_belief(node)
            value = float(likely @ vectors[place, states])
            if value > tree.lower_bounds[node] + MIN_CHANGE_SHARE * self.gap:
                if place not in taken:
                    tree.reserve_memory(self.model.state_count)
                    action = int(actions[place])
                    taken[place] = layer.add_plan(
                        vectors[place], action, then[place], node
                    )
                tree.lower_bounds[node], tree.lower_bound_plans[node] = value, taken[place]

    def _run_trial(self, target_gap: float) -> None:
        """One way down from the start, and back up."""
        tree, branch, left = self.tree, self.tree.root, self.turns
        path: list[int] = []
        while len(path) < MAX_TRIAL_TURNS and (left or not self.turns):
            wide = (
                tree.upper_bounds[branch.child_nodes]
                - tree.lower_bounds[branch.child_nodes]
                - target_gap
            )
            k = int((branch.probabilities * wide).argmax())
            if path and wide[k] <= 0:
                break
            node = int(branch.child_nodes[k])
            branches = tree.expand_node(node)
            path.append(node)
            left, target_gap = left - 1, target_gap / (self.model.discount or MIN_GAP)
            branch = branches[self._select_highest_upper_bound(branches, left)]
            tree.tighten_lower_bounds(branch, left)
        for node in path[::-1]:
            self._backup_lower_bound(node)
            self._backup_upper_bound(node)

    def _run_game(self) -> None:
        """A game by the plans that are known, from whose end on better ones are made."""
        tree, branch, left, weight = self.tree, self.tree.root, self.turns, 1.0
        path: list[int] = []
        while weight > MIN_GAME_WEIGHT and len(path) < MAX_TRIAL_TURNS and (left or not self.turns):
            observed, mood, any_one = self._generator.random(3)
            below = branch.probabilities.cumsum()
            node = int(
                branch.child_nodes[np.searchsorted(below[:-1], observed * below[-1], "right")]
            )
            if (
                path
                and tree.upper_bounds[node] - tree.lower_bounds[node] <= MIN_CHANGE_SHARE * self.gap
            ):
                break
            branches = tree.expand_node(node)
            path.append(node)
            left, weight = left - 1, weight * self.model.discount
            if mood < RANDOM_ACTION_PROBABILITY:
                branch = branches[int(any_one * len(branches))]
            elif mood < RANDOM_ACTION_PROBABILITY + OPTIMISTIC_ACTION_PROBABILITY:
                branch = max(branches, key=tree.compute_upper_bound)
            else:
                branch = branches[self._select_highest_lower_bound(branches, left)]
        for node in path[::-1]:
            self._backup_lower_bound(node)

    def _select_highest_upper_bound(self, branches: list[ActionBranch], turns_left: int) -> int:
        """The action of the greatest upper bound, brought up to date."""
        while True:
            most = [self.tree.compute_upper_bound(one) for one in branches]
            best = most.index(max(most))
            if not self.tree.tighten_upper_bounds(branches[best], turns_left):
                return best

    def _select_highest_lower_bound(self, branches: list[ActionBranch], turns_left: int) -> int:
        """The action of the greatest lower bound, of those that may be better than it."""
        best, worth = 0, -np.inf
        most = [self.tree.compute_upper_bound(one) for one in branches]
        for action in sorted(range(len(most)), key=most.__getitem__)[::-1]:
            if most[action] <= worth:
                break
            self.tree.tighten_lower_bounds(branches[action], turns_left)
            least = self.tree.compute_lower_bound(branches[action])
            if least > worth:
                best, worth = action, least
        return best

    def _backup_lower_bound(self, node: int) -> None:
        """The lower bound of a belief, by those of the beliefs that follow."""
        tree, branches = self.tree, self.tree.branches[node]
        tree.spend_work(2 * ARRAY_CALL_WORK)
        best = self._select_highest_lower_bound(branches, tree.turns_left[node] - 1)
        if (
            tree.compute_lower_bound(branches[best])
            > tree.lower_bounds[node] + MIN_CHANGE_SHARE * self.gap
        ):
            self._add_better_plan(node, best)

    def _backup_upper_bound(self, node: int) -> None:
        """The upper bound of a belief, by those of the beliefs that follow."""
        tree, branches, left = self.tree, self.tree.branches[node], self.tree.turns_left[node]
        tree.spend_work(2 * ARRAY_CALL_WORK)
        highest = tree.compute_upper_bound(
            branches[self._select_highest_upper_bound(branches, left - 1)]
        )
        if highest < tree.upper_bounds[node] - MIN_CHANGE_SHARE * self.gap:
            tree.reserve_memory(self.model.state_count)
            tree.get_layer(left).add_point(node, tree.get_dense_belief(node), highest)
        tree.upper_bounds[node] = min(tree.upper_bounds[node], highest)

    def _add_better_plan(self, node: int, action: int) -> None:
        """Takes the plan that begins with an action here, where it is better than any before."""
        tree, left = self.tree, self.tree.turns_left[node]
        vector, then = self._build_plan(tree.branches[node][action], action, left)
        states, likely = tree.get_sparse_belief(node)
        value = float(likely @ vector[states])
        if value > tree.lower_bounds[node]:
            tree.reserve_memory(self.model.state_count)
            tree.lower_bounds[node] = value
            tree.lower_bound_plans[node] = tree.get_layer(left).add_plan(vector, action, then, node)

    def _build_plan(self, branch: ActionBranch, action: int, turns_left: int) -> tuple[Reals, Ints]:
        """The vector `[S]` of an action and the best plans after each observation.

        After what cannot be observed from here it is the plan for all that may follow together.
        """
        layer, here = self.tree.get_layer(turns_left - 1), self.model.get_action_slice(action)
        numbers = here.stop - here.start
        states, plans = branch.next_beliefs.support_states, layer.plan_vectors.array
        self.tree.spend_work(
            4 * ARRAY_CALL_WORK
            + 12.0 * numbers
            + 1.0 * layer.plan_vectors.column_count * len(states)
        )
        mixed = branch.probabilities @ branch.next_beliefs.probabilities
        chosen = np.full(self.model.observation_count, int((mixed @ plans[states]).argmax()))
        chosen[branch.observations] = self.tree.lower_bound_plans[branch.child_nodes]
        after, seen = self.model.next_states[here], self.model.observations[here]
        return self.model.backup_plan(action, plans[after, chosen[seen]]), chosen

    @property
    def _reporting_work(self) -> float:
        """The work that telling what is known takes."""
        many, numbers = len(self.model.rewards), len(self.model.joint_probabilities.values)
        return min(MAX_WITNESS_BELIEFS, len(self.tree.branches)) * (
            8 * ARRAY_CALL_WORK * many + 20.0 * numbers
        )

    def collect_bounds(self, relative_gap: float) -> PointBasedBounds:
        """What is known so far."""
        tree = self.tree
        lower, upper = np.zeros((2, len(self.model.rewards)))
        for node, likely in zip(
            tree.root.child_nodes.tolist(), tree.root.probabilities, strict=True
        ):
            branches = tree.expand_node(node)
            with suppress(BudgetExceeded):
                for one in branches:
                    tree.tighten_lower_bounds(one, tree.turns_left[node] - 1)
            lower += [likely * tree.compute_lower_bound(one) for one in branches]
            upper += [likely * tree.compute_upper_bound(one) for one in branches]
        plans = tuple(self._collect_best_plans(left) for left in range(len(tree.layers)))
        close = self.gap <= self.compute_target_gap(relative_gap)
        many = len(tree.branches)
        return PointBasedBounds(
            self.lower_bound,
            self.upper_bound,
            lower,
            upper,
            plans,
            many,
            close,
            tree.is_memory_full,
        )

    def _collect_best_plans(self, turns_left: int) -> VectorsByAction:
        """The plans of a layer that are the best for some belief, and some of each action."""
        tree, layer = self.tree, self.tree.get_layer(turns_left)
        many = len(self.model.rewards)
        here = (
            np.array(tree.turns_left) == turns_left if self.turns else slice(len(tree.turns_left))
        )
        used = np.union1d(np.arange(many), tree.lower_bound_plans[: len(tree.turns_left)][here])
        found = layer.plan_vectors.array.T[used]
        actions = layer.plan_actions[used]
        plans = [found[actions == a] for a in range(many)]
        witnesses = [
            node
            for node in [*tree.branches][:MAX_WITNESS_BELIEFS]
            if tree.turns_left[node] == turns_left or not self.turns
        ]
        with suppress(BudgetExceeded):
            for node, a in product(witnesses, range(many)):
                tree.tighten_lower_bounds(tree.branches[node][a], turns_left - 1)
                vector, _ = self._build_plan(tree.branches[node][a], a, turns_left)
                states, likely = tree.get_sparse_belief(node)
                if (
                    likely @ vector[states]
                    > (plans[a][:, states] @ likely).max() + MIN_GAP
                ):
                    plans[a] = np.vstack([plans[a], vector])
        return tuple(plans)


def _make_initial_layers(
    model: SparsePomdp, horizon: int | None, budget: Budget
) -> list[BoundLayer]:
    """The first bounds: without end a layer, or one for each number of turns to go."""
    if horizon is None:
        return [
            BoundLayer(
                model.compute_blind_lower_bound(budget),
                model.compute_informed_upper_bound(budget),
                model.observation_count,
            )
        ]
    many, numbers = len(model.rewards), len(model.joint_probabilities.values)
    nothing = np.zeros((many, model.state_count))
    layers = [BoundLayer(nothing, nothing, model.observation_count)]
    while len(layers) <= horizon:
        budget.check_memory(16.0 * len(layers) * 16 * model.state_count)
        budget.spend_work(2 * ARRAY_CALL_WORK + 8.0 * many * numbers)
        low, high = layers[-1].plan_vectors.array[:, :many].T, layers[-1].upper_vectors
        layers.append(
            BoundLayer(
                model.backup_blind_policies(low),
                model.backup_informed_bound(high),
                model.observation_count,
            )
        )
    return layers
