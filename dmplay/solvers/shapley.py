"""Markov games of two who oppose each other, by Shapley's iteration (1953).

What a game of k turns is worth in a state is the value of a matrix game, whose payoffs are those of
the turn and what a game of k - 1 turns is then worth. Of games without end the bounds of MacQueen
(1966) hold as for one agent; there both keep for some turns to what they play in the last one, as
in policy iteration (Pollatschek and Avi-Itzhak, 1969), unless that led away.
"""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Bools, Ints, Reals
from dmplay.core import Problem
from dmplay.errors import BadPolicy
from dmplay.solvers import zero_sum
from dmplay.solvers.graph import TransitionGraph
from dmplay.solvers.value_iteration import FINITE_VALUE_REMEDY
from dmplay.solvers.zero_sum import MatrixGameSolutions

TARGET_GAP = 1e-9  # between the bounds, where values are about 1
ROUNDING_ERROR = 1e-15  # of values, by which no gap is less
REWARD_TOLERANCE = 1e-9  # rewards this close to a line are on it
WORK_LIMIT = 1e11
TURNS_PER_EVALUATION = 20  # turns for which both keep to what they play
PAYOFF_DECIMALS = 9  # of payoffs that are played by: the last bits differ between processors
ENDLESS_GAME_MESSAGE = f"got a game of two at once without end, expected {FINITE_VALUE_REMEDY}"
OPPOSED_REWARDS_MESSAGE = (
    "got rewards that are not opposed, expected one to lose what the other gains, to scale"
)


class ShapleyResult(NamedTuple):
    """What a game is worth to the first of two."""

    graph: TransitionGraph
    joint_action_cells: (
        Ints  # [S, A1, A2], the joint action in the graph; a first legal one for others
    )
    legal_masks: tuple[Bools, Bools]  # [S, A] of each, what is legal
    loss_ratio: float  # what the second loses where the first gains 1
    values_by_turns_left: list[Reals]  # [S] each, of 0, 1, 2 ... turns; without end, the last alone
    gap: float = 0.0  # between the bounds of these last

    def get_values(self, turns_left: int | None) -> Reals:
        """The values with so many turns to go, None for no end."""
        return self.values_by_turns_left[
            -1 if turns_left is None else min(turns_left, len(self.values_by_turns_left) - 1)
        ]

    def build_stage_games(
        self, state_indices: Ints, discount: float, turns_left: int | None
    ) -> Reals:
        """The matrix games `[B, A1, A2]` of some states, with so many turns after this one."""
        cells = self.joint_action_cells[state_indices]
        rows, which = np.unique(cells, return_inverse=True)
        worth = self.graph.compute_action_values(
            rows, discount, self.get_values(turns_left)[:, None]
        )[:, 0]
        return np.asarray(worth[which].reshape(cells.shape))

    def solve_rounded_games(
        self, state_indices: Ints, discount: float, turns_left: int | None
    ) -> tuple[Reals, MatrixGameSolutions]:
        """These games, and what both play in them whatever the processor."""
        games = np.round(
            self.build_stage_games(state_indices, discount, turns_left), PAYOFF_DECIMALS
        )
        return games, self.solve_stage_games(state_indices, games)

    def solve_stage_games(self, state_indices: Ints, stage_games: Reals) -> MatrixGameSolutions:
        """What these games of some states are worth, and what both play; nothing illegal."""
        values, *mixes = zero_sum.solve_matrix_games(stage_games)
        legal = [able[state_indices] for able in self.legal_masks]
        return MatrixGameSolutions(
            values, *(_move_to_legal_actions(*one) for one in zip(mixes, legal, strict=True))
        )


def _move_to_legal_actions(strategies: Reals, legal_actions_mask: Bools) -> Reals:
    """A mix `[B, A]` in which the first that is legal stands for what is not."""
    kept = np.where(legal_actions_mask, strategies, 0.0)
    kept[np.arange(len(kept)), legal_actions_mask.argmax(axis=1)] += np.where(
        legal_actions_mask, 0.0, strategies
    ).sum(axis=1)
    return kept


def run_shapley_iteration(
    problem: Problem, graph: TransitionGraph, turns: int | None
) -> ShapleyResult:
    """The value of a game of so many turns, or of one without end."""
    if turns is None and problem.discount == 1.0:
        raise BadPolicy(ENDLESS_GAME_MESSAGE)
    budget = Budget("Shapley's iteration", "try fewer states, or search", WORK_LIMIT)
    budget.check_memory(40.0 * len(graph.states) * np.prod(problem.action_counts, dtype=float))
    lost, (cells, able) = compute_loss_ratio(graph.rewards), _index_joint_actions(problem, graph)
    if lost is None:
        raise BadPolicy(OPPOSED_REWARDS_MESSAGE)
    found = ShapleyResult(graph, cells, able, lost, [np.zeros(len(graph.states))])
    cost = (
        100 * ARRAY_CALL_WORK
        + 30.0 * TURNS_PER_EVALUATION * len(graph.probabilities)
        + 300.0 * cells.size
    )
    if turns is None:
        return _solve_infinite_horizon(found, problem.discount, budget, cost)
    for done in range(turns):
        budget.spend_work(cost, done / turns)
        budget.check_memory(8.0 * len(graph.states) * (done + 2))
        found.values_by_turns_left.append(
            _backup_one_turn(found, found.values_by_turns_left[-1], problem.discount)[0]
        )
    return found


def _solve_infinite_horizon(
    result: ShapleyResult, discount: float, budget: Budget, turn_work: float
) -> ShapleyResult:
    """The value of a game without end, as near as the work allows: halfway between its bounds."""
    live, far = result.graph.nonterminal_states, discount / (1.0 - discount)
    best, gap, trial, plain = (
        result.values_by_turns_left[0],
        np.inf,
        result.values_by_turns_left[0],
        False,
    )
    middle = 0.0  # between the bounds, from what is best
    while budget.work_spent <= budget.work_limit - turn_work:
        budget.spend_work(turn_work)
        after, both = _backup_one_turn(result, trial, discount)
        least, most = _bound_changes(
            (after - trial)[live], has_terminal_states=len(live) < len(after)
        )
        if far * (most - least) >= gap:  # what both kept to led away
            if plain:
                break
            trial, plain = best, True
            continue
        gap, middle = far * (most - least), far * (least + most) / 2
        best, plain = after, False
        if gap <= max(TARGET_GAP, ROUNDING_ERROR * far) * max(1.0, float(np.abs(after).max())):
            break
        trial = _evaluate_strategies(result, after, discount, both)
    best = best + np.where(np.diff(result.graph.action_starts) > 0, middle, 0.0)
    return result._replace(values_by_turns_left=[best], gap=gap)


def _bound_changes(change: Reals, *, has_terminal_states: bool) -> tuple[float, float]:
    """The least and the greatest change; 0 where something is over."""
    least, most = float(change.min(initial=np.inf)), float(change.max(initial=-np.inf))
    return (min(least, 0.0), max(most, 0.0)) if has_terminal_states else (least, most)


def _backup_one_turn(
    result: ShapleyResult, values: Reals, discount: float
) -> tuple[Reals, MatrixGameSolutions]:
    """The values of games that are a turn longer, and what both play in it."""
    live = result.graph.nonterminal_states
    games = result._replace(values_by_turns_left=[values]).build_stage_games(live, discount, None)
    both = result.solve_stage_games(live, games)
    after = np.zeros_like(values)
    after[live] = both.values
    return after, both


def _evaluate_strategies(
    result: ShapleyResult, values: Reals, discount: float, strategies: MatrixGameSolutions
) -> Reals:
    """The values after some more turns in which both play the same."""
    graph = result.graph
    place = np.zeros(len(values), np.int64)
    place[graph.nonterminal_states] = np.arange(len(graph.nonterminal_states))
    owner, (one, two) = graph.source_states, graph.joint_actions.T
    weight = (
        strategies.row_strategies[place[owner], one]
        * strategies.column_strategies[place[owner], two]
    )
    for _ in range(TURNS_PER_EVALUATION):
        worth = graph.compute_action_values(np.arange(len(owner)), discount, values[:, None])[:, 0]
        values = np.bincount(owner, weight * worth, len(values)).astype(float)
    return values


def _index_joint_actions(
    problem: Problem, graph: TransitionGraph
) -> tuple[Ints, tuple[Bools, Bools]]:
    """The joint action of each cell of each state `[S, A1, A2]`, and what is legal of each."""
    shape = (len(graph.states), *problem.action_counts)
    there = np.zeros(shape, bool)
    cells = np.zeros(shape, np.int64)
    place = (graph.source_states, *graph.joint_actions.T)
    there[place] = True
    cells[place] = np.arange(len(graph.rewards))
    able = np.asarray(there.any(axis=2)), np.asarray(there.any(axis=1))
    firsts = [np.where(one, np.arange(one.shape[1]), one.argmax(axis=1)[:, None]) for one in able]
    state = np.arange(len(graph.states))[:, None, None]
    return cells[state, firsts[0][:, :, None], firsts[1][:, None, :]], able


def compute_loss_ratio(rewards: Reals) -> float | None:
    """What the second loses where the first gains 1 `[N, 2]`; None where it does not always."""
    first, second = rewards.T
    lost = -float((first * second).sum()) / (float((first * first).sum()) or 1.0)
    size = max(1.0, float(np.abs(rewards).max(initial=0.0)))
    close = float(np.abs(second + lost * first).max(initial=0.0)) <= REWARD_TOLERANCE * size
    return lost if close and (lost > 0.0 or not first.any()) else None
