"""Games of perfect information, in which one agent at a time decides, by backward induction.

What a game of k turns is worth to each agent follows from what one of k - 1 turns is (Zermelo,
1913; Kuhn, 1953), and one of none is worth nothing. Once a further turn changes nothing, games of
any length are solved. Of actions that are worth the same the first is taken; in a game without
end, of those that are the same to everybody, the one that ends it soonest.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Bools, Ints, Reals
from dmplay.core import Problem
from dmplay.errors import BadPolicy, BudgetExceeded
from dmplay.solvers.graph import OUTCOMES_PER_BLOCK, TransitionGraph
from dmplay.solvers.value_iteration import FINITE_VALUE_REMEDY, compute_tolerance

CONVERGENCE_TOLERANCE = 1e-12  # a change that ends the induction, where values are about 1
WORK_LIMIT, MAX_TURNS = 1e11, 10_000  # turns
PATIENCE_TURNS = (
    50  # turns after which changes must be less, or what all states may pay by changing so
)
ENDLESS_GAME_MESSAGE = f"games need not end; give {FINITE_VALUE_REMEDY}"


class BackwardInductionResult(NamedTuple):
    """What games of 0, 1, 2 ... turns are worth, up to the longest that was looked at."""

    graph: TransitionGraph
    deciding_seats: Ints  # [S], who decides
    values_by_turns_left: list[Reals]  # [S, n] each
    gap: float  # by how much a longer game may be worth another

    def get_values(self, turns_left: int | None) -> Reals:
        """The values `[S, n]` with so many turns to go, None for no end."""
        last = len(self.values_by_turns_left) - 1
        return self.values_by_turns_left[last if turns_left is None else min(turns_left, last)]


def run_backward_induction(
    problem: Problem, graph: TransitionGraph, turns: int | None
) -> BackwardInductionResult:
    """The values of games of up to so many turns, or of games without end."""
    endless = turns is None and problem.discount == 1.0
    budget = Budget(
        "backward induction", ENDLESS_GAME_MESSAGE if endless else "try fewer states", WORK_LIMIT
    )
    values = [np.zeros((len(graph.states), len(problem.agents)))]
    found = BackwardInductionResult(graph, _find_deciding_seats(problem, graph), values, 0.0)
    far = problem.discount / (1.0 - problem.discount) if problem.discount < 1.0 else 1.0
    gaps, states = [np.inf], len(graph.states)
    dear = 2 * far * states * float(np.abs(graph.rewards).max(initial=0.0))
    while len(values) - 1 != turns:
        patience = max(PATIENCE_TURNS, states + int(min(dear / gaps[-1], MAX_TURNS)))
        lasting = (
            endless
            and len(gaps) > patience
            and gaps[-1] > gaps[-patience] * (1 - CONVERGENCE_TOLERANCE)
        )
        if lasting or len(values) > MAX_TURNS:
            needed = f"values still change after {len(values) - 1} turns"
            raise BudgetExceeded(budget.task, needed, budget.remedy)
        budget.spend_work(
            10 * ARRAY_CALL_WORK + 30.0 * graph.rewards.shape[1] * len(graph.probabilities)
        )
        budget.check_memory(values[0].nbytes * (len(values) + 1.0))
        after = _backup_one_turn(found, problem.discount)
        gaps.append(2 * far * float(np.abs(after - values[-1]).max()))
        values.append(after)
        if gaps[-1] <= compute_tolerance(after, CONVERGENCE_TOLERANCE):
            return found._replace(gap=gaps[-1])
    return found


def _find_deciding_seats(problem: Problem, graph: TransitionGraph) -> Ints:
    """Who decides in each state `[S]`, or acts alone; raises BadPolicy where two decide."""
    legal = problem.legal_actions_mask(graph.states)
    if legal is None or len(problem.agents) == 1:
        many = np.tile(problem.action_counts, (len(graph.states), 1))
    else:
        many = legal.sum(axis=2)
    deciding = many > 1
    if len(problem.agents) > 1 and (deciding[graph.nonterminal_states].sum(axis=1) > 1).any():
        raise BadPolicy("got agents who act at once, expected one at a time, the others waiting")
    return np.asarray(np.argmax(2 * deciding + ~problem.inactive_agents(graph.states), axis=1))


def _backup_one_turn(result: BackwardInductionResult, discount: float) -> Reals:
    """What games are worth that are a turn longer than the longest so far."""
    graph, values = result.graph, result.values_by_turns_left[-1]
    after, live = np.zeros_like(values), graph.nonterminal_states
    size = compute_tolerance(values)
    ends = np.searchsorted(
        graph.outcome_starts[graph.action_starts[live]],
        np.arange(0, len(graph.probabilities), OUTCOMES_PER_BLOCK),
    )
    cuts = np.unique([*ends, 0, len(live)])
    for first, end in pairwise(cuts.tolist()):
        some = live[first:end]
        rows = np.arange(graph.action_starts[some[0]], graph.action_starts[some[-1] + 1])
        q = graph.compute_action_values(rows, discount, values)
        after[some] = q[
            _find_first_marked(
                _mark_best_actions(result, q, some, size), graph.action_starts[some] - rows[0]
            )
        ]
    return after


def _mark_best_actions(
    result: BackwardInductionResult, q: Reals, states: Ints, tolerance: float
) -> Bools:
    """Which of the joint actions in some states are worth most to who decides."""
    counts = result.graph.action_starts[states + 1] - result.graph.action_starts[states]
    own = q[np.arange(len(q)), np.repeat(result.deciding_seats[states], counts)]
    most = np.maximum.reduceat(own, np.cumsum(counts) - counts)
    return np.asarray(own >= np.repeat(most, counts) - tolerance)


def _find_first_marked(mask: Bools, starts: Ints) -> Ints:
    """The first that is marked from each start on."""
    marked = np.flatnonzero(mask)
    return np.asarray(marked[np.searchsorted(marked, starts)])


def select_soonest_ending_actions(result: BackwardInductionResult, discount: float) -> Ints:
    """The joint action `[S]` of each state in a game without end; -1 where it is over."""
    graph, live = result.graph, result.graph.nonterminal_states
    q = graph.compute_action_values(
        np.arange(len(graph.rewards)), discount, result.values_by_turns_left[-1]
    )
    starts, counts = graph.action_starts[live], np.diff(graph.action_starts)[live]
    size = compute_tolerance(result.values_by_turns_left[-1])
    able = _mark_best_actions(result, q, live, size)
    able &= (
        np.abs(q - np.repeat(q[_find_first_marked(able, starts)], counts, axis=0)) <= size
    ).all(axis=1)
    length = np.zeros(len(graph.states))
    budget = Budget("backward induction", "try fewer states")
    for _ in range(2 * len(result.values_by_turns_left)):
        budget.spend_work(10 * ARRAY_CALL_WORK + 20.0 * len(graph.probabilities))
        later = np.add.reduceat(
            graph.probabilities * length[graph.next_states], graph.outcome_starts[:-1]
        )
        each = np.where(able, 1.0 + later, np.inf)
        least = np.minimum.reduceat(each, starts)
        if (np.abs(least - length[live]) <= compute_tolerance(least)).all():
            break
        length[live] = least
    choice = np.full(len(graph.states), -1)
    choice[live] = _find_first_marked(each <= np.repeat(least, counts) + size, starts)
    return choice
