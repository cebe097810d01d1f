"""Shapley's iteration (1953) for Markov games of two players with opposed rewards.

The value of a game of k turns in a state is the value of a matrix game, whose payoffs are the
rewards of the turn plus the value of the game of k - 1 turns that follows. With an infinite
horizon, the bounds of MacQueen (1966) hold as for one agent. There, both players repeat their
last strategies for some turns, as in policy iteration (Pollatschek and Avi-Itzhak, 1969), unless
that made the bounds worse.
"""

from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Bools, Ints, Reals
from dmplay.core.best_actions import compute_reward_scale
from dmplay.core.problem import Problem
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.errors import BadPolicy
from dmplay.solvers.games import zero_sum
from dmplay.solvers.games.zero_sum import MatrixGameSolutions
from dmplay.solvers.mdp import transition_graph
from dmplay.solvers.mdp.mdp_values import FINITE_VALUE_REMEDY
from dmplay.solvers.mdp.transition_graph import TransitionGraph

TARGET_GAP = 1e-9  # between the bounds, for values of about 1
ROUNDING_ERROR = 1e-15  # relative to the values; no gap is smaller
REWARD_TOLERANCE = 1e-9  # distance from a line at which rewards count as on it
WORK_LIMIT = 1e11
TURNS_PER_EVALUATION = 20  # turns for which both players repeat their strategies
PAYOFF_DECIMALS = 9  # because the last bits differ between processors
ENDLESS_GAME_MESSAGE = f"got an infinite horizon and discount 1, expected {FINITE_VALUE_REMEDY}"
OPPOSED_REWARDS_MESSAGE = (
    "got rewards that are not opposed, expected one to fall in proportion as the other rises"
)


class ShapleyResult(NamedTuple):
    """The values of a game to the first of two players."""

    graph: TransitionGraph
    # [S, A1, A2], rows of the graph; illegal actions map to the first legal one
    joint_action_cells: Ints
    legal_masks: tuple[Bools, Bools]  # [S, A] of each player
    loss_ratio: float  # loss of the second player when the first gains 1
    # [S] for 0, 1, 2 ... turns; only the last if the horizon is infinite
    values_by_turns_left: list[Reals]
    gap: float = 0.0  # between the bounds of the last values

    def get_values(self, turns_left: int | None) -> Reals:
        """Return the values `[S]` with `turns_left` turns to play, None for an infinite horizon."""
        last = len(self.values_by_turns_left) - 1
        return self.values_by_turns_left[last if turns_left is None else min(turns_left, last)]

    def build_stage_games(
        self, state_indices: Ints, discount: float, turns_left: int | None
    ) -> Reals:
        """Return the stage games `[B, A1, A2]` of states, `turns_left` turns following."""
        cells = self.joint_action_cells[state_indices]
        rows, inverse = np.unique(cells, return_inverse=True)
        next_values = self.get_values(turns_left)[:, None]
        q = self.graph.compute_action_values(rows, discount, next_values)[:, 0]
        return np.asarray(q[inverse].reshape(cells.shape))

    def solve_rounded_games(
        self, state_indices: Ints, discount: float, turns_left: int | None
    ) -> tuple[Reals, MatrixGameSolutions]:
        """Return the stage games of states, rounded, and their solutions.

        The rounding makes the strategies the same on every processor.
        """
        scale = compute_reward_scale(self.graph.rewards[:, 0])
        stage_games = self.build_stage_games(state_indices, discount, turns_left)
        stage_games = scale * np.round(stage_games / scale, PAYOFF_DECIMALS)
        return stage_games, self.solve_stage_games(state_indices, stage_games)

    def solve_stage_games(self, state_indices: Ints, stage_games: Reals) -> MatrixGameSolutions:
        """Return the values and optimal strategies of stage games, without illegal actions."""
        values, *strategies = zero_sum.solve_matrix_games(stage_games)
        masks = (legal_mask[state_indices] for legal_mask in self.legal_masks)
        return MatrixGameSolutions(values, *map(_move_weight_to_legal_actions, strategies, masks))


def _move_weight_to_legal_actions(strategies: Reals, legal_actions_mask: Bools) -> Reals:
    """Return strategies `[B, A]` with illegal weight moved to the first legal action."""
    result = np.where(legal_actions_mask, strategies, 0.0)
    illegal_weights = np.where(legal_actions_mask, 0.0, strategies).sum(axis=1)
    result[np.arange(len(result)), legal_actions_mask.argmax(axis=1)] += illegal_weights
    return result


def run_shapley_iteration(
    problem: Problem, graph: TransitionGraph, turns: int | None
) -> ShapleyResult:
    """Return the values of a game of `turns` turns, None for an infinite horizon.

    Raises BadPolicy if the rewards are not opposed, or if the horizon is infinite and the discount
    1.
    """
    if turns is None and problem.discount == 1.0:
        raise BadPolicy(ENDLESS_GAME_MESSAGE)
    budget = Budget("Shapley's iteration", "try fewer states, or the agent search", WORK_LIMIT)
    budget.check_memory(40.0 * len(graph.states) * np.prod(problem.action_counts, dtype=float))
    loss_ratio = compute_loss_ratio(graph.rewards)
    cells, masks = _index_joint_actions(problem, graph)
    if loss_ratio is None:
        raise BadPolicy(OPPOSED_REWARDS_MESSAGE)
    result = ShapleyResult(graph, cells, masks, loss_ratio, [np.zeros(len(graph.states))])
    evaluation_work = 30.0 * TURNS_PER_EVALUATION * len(graph.probabilities)
    turn_work = 100 * ARRAY_CALL_WORK + evaluation_work + 300.0 * cells.size
    if turns is None:
        return _solve_infinite_horizon(result, problem.discount, budget, turn_work)
    for turn in range(turns):
        budget.spend_work(turn_work, turn / turns)
        budget.check_memory(8.0 * len(graph.states) * (turn + 2))
        last_values = result.values_by_turns_left[-1]
        values, _ = _backup_one_turn(result, last_values, problem.discount)
        result.values_by_turns_left.append(values)
    return result


def _solve_infinite_horizon(
    result: ShapleyResult, discount: float, budget: Budget, turn_work: float
) -> ShapleyResult:
    """Return infinite-horizon values halfway between their bounds, as close as the work allows."""
    bound_scale = discount / (1.0 - discount)
    best_values = trial_values = result.values_by_turns_left[0]
    gap, is_plain = np.inf, False
    scale = compute_reward_scale(result.graph.rewards[:, 0])
    midpoint = 0.0  # of the bounds, relative to the best values
    while budget.work_spent <= budget.work_limit - turn_work:
        budget.spend_work(turn_work)
        next_values, solutions = _backup_one_turn(result, trial_values, discount)
        change = next_values - trial_values  # 0 in terminal states
        min_change, max_change = float(change.min()), float(change.max())
        # Repeating the strategies made the bounds worse.
        if bound_scale * (max_change - min_change) >= gap:
            if is_plain:
                break
            trial_values, is_plain = best_values, True
            continue
        gap = bound_scale * (max_change - min_change)
        midpoint = bound_scale * (min_change + max_change) / 2
        best_values, is_plain = next_values, False
        size = max(scale, float(np.abs(next_values).max()))
        if gap <= max(TARGET_GAP, ROUNDING_ERROR * bound_scale) * size:
            break
        trial_values = _evaluate_strategies(result, next_values, discount, solutions)
    best_values = best_values + np.where(np.diff(result.graph.action_starts) > 0, midpoint, 0.0)
    return result._replace(values_by_turns_left=[best_values], gap=gap)


def _backup_one_turn(
    result: ShapleyResult, values: Reals, discount: float
) -> tuple[Reals, MatrixGameSolutions]:
    """Return the values of games that are one turn longer, and the solutions of that turn."""
    live = result.graph.nonterminal_states
    one_turn = result._replace(values_by_turns_left=[values])
    stage_games = one_turn.build_stage_games(live, discount, None)
    solutions = result.solve_stage_games(live, stage_games)
    next_values = np.zeros_like(values)
    next_values[live] = solutions.values
    return next_values, solutions


def _evaluate_strategies(
    result: ShapleyResult, values: Reals, discount: float, strategies: MatrixGameSolutions
) -> Reals:
    """Return the values after more turns in which both players repeat their strategies."""
    graph = result.graph
    positions = np.zeros(len(values), np.int64)
    positions[graph.nonterminal_states] = np.arange(len(graph.nonterminal_states))
    source_states, (first_actions, second_actions) = graph.source_states, graph.joint_actions.T
    rows, games = np.arange(len(source_states)), positions[source_states]
    weights = strategies.row_strategies[games, first_actions]
    weights *= strategies.column_strategies[games, second_actions]
    for _ in range(TURNS_PER_EVALUATION):
        q = graph.compute_action_values(rows, discount, values[:, None])[:, 0]
        values = np.bincount(source_states, weights * q, len(values)).astype(float)
    return values


def _index_joint_actions(
    problem: Problem, graph: TransitionGraph
) -> tuple[Ints, tuple[Bools, Bools]]:
    """Return the graph row of each joint action `[S, A1, A2]`, and each player's legal mask."""
    shape = (len(graph.states), *problem.action_counts)
    is_legal = np.zeros(shape, bool)
    cells = np.zeros(shape, np.int64)
    indices = (graph.source_states, *graph.joint_actions.T)
    is_legal[indices] = True
    cells[indices] = np.arange(len(graph.rewards))
    masks = np.asarray(is_legal.any(axis=2)), np.asarray(is_legal.any(axis=1))
    substitutes = [
        np.where(mask, np.arange(mask.shape[1]), mask.argmax(axis=1)[:, None]) for mask in masks
    ]
    states = np.arange(len(graph.states))[:, None, None]
    return cells[states, substitutes[0][:, :, None], substitutes[1][:, None, :]], masks


def compute_loss_ratio(rewards: Reals) -> float | None:
    """Return the loss of the second player per gain of the first, from rewards `[N, 2]`.

    None if the rewards are not opposed and proportional.
    """
    first, second = rewards.T / compute_reward_scale(rewards)
    ratio = -float((first * second).sum()) / (float((first * first).sum()) or 1.0)
    size = max(1.0, float(np.abs([first, second]).max(initial=0.0)))
    deviation = float(np.abs(second + ratio * first).max(initial=0.0))
    is_proportional = deviation <= REWARD_TOLERANCE * size
    return ratio if is_proportional and (ratio > 0.0 or not first.any()) else None


def solve_zero_sum(problem: Problem, turns: int | None) -> ShapleyResult:
    """Return the values of a game of two opposed agents over its reachable states (Shapley)."""
    return run_shapley_iteration(problem, transition_graph.build_reachable_graph(problem), turns)
