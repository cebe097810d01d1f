"""Equilibria of Markov games of two whose interests are opposed (section 25.3).

By policy iteration (Pollatschek and Avi-Itzhak, 1969): both solve the matrix game of every state,
play so for ever, and what that is worth gives new matrix games. The game need not be zero-sum: the
second's reward may be any falling linear function of the first's.
"""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget, scale_progress
from dmplay.chance import Reals
from dmplay.core import Problem
from dmplay.describe import format_count
from dmplay.errors import BadParameter
from dmplay.solvers import best_response, sparse, value_iteration, zero_sum
from dmplay.tabular import Tables, tabulate

CONVERGENCE_TOLERANCE = 1e-9  # a change of value that ends it
MAX_ROUNDS = 200
MAX_STATES = 500  # states
PAYOFF_DECIMALS = (
    9  # of the last payoffs: the last bits differ between processors, and policies must not
)


class MarkovGameEquilibrium(NamedTuple):
    """Policies that are the best answers to one another, as nearly as the gaps say."""

    policies: tuple[Reals, Reals]  # [S, A1], [S, A2]
    action_values: tuple[Reals, Reals]  # [S] of each agent while both play so
    q: tuple[Reals, Reals]  # [S, A1], [S, A2]: of each action against the other's policy
    regrets: tuple[float, float]  # what each could gain by another policy, in the worst state
    value_changes: tuple[float, ...]  # of the values, round by round


def find_equilibrium(problem: Problem) -> MarkovGameEquilibrium:
    """An equilibrium of a game of two with opposed interests; `discount` below 1."""
    budget = Budget("an equilibrium", "try fewer states, or search", 2e10)
    tables = _tabulate_opposed_game(problem)
    values: Reals = np.zeros(len(tables.transition))
    changes = [np.inf]
    while changes[-1] > CONVERGENCE_TOLERANCE and len(changes) <= MAX_ROUNDS:
        share = _estimate_progress(changes)
        budget.spend_work(
            4 * tables.transition.size
            + len(values) * (10 * ARRAY_CALL_WORK + len(values) ** 2 / 10),
            share,
        )
        with scale_progress(share, share):
            play = _solve_stage_games(_build_stage_games(problem, tables, values))
        after = _evaluate_policies(tables, problem.discount, play)
        changes.append(float(abs(after - values).max()))
        values = after
    with scale_progress(1.0, 1.0):
        play = _solve_stage_games(
            np.round(_build_stage_games(problem, tables, values), PAYOFF_DECIMALS)
        )
        (one, q1, gap1), (two, q2, gap2) = (_evaluate_seat(problem, play, seat) for seat in (0, 1))
    return MarkovGameEquilibrium(play, (one, two), (q1, q2), (gap1, gap2), tuple(changes[1:]))


def _estimate_progress(changes: list[float]) -> float:
    """How far the least change has come from the first to the one that ends it."""
    if len(changes) == 1:
        return 0.0
    left = max(min(changes), CONVERGENCE_TOLERANCE) / CONVERGENCE_TOLERANCE
    return float(1.0 - np.log(left) / max(np.log(changes[1] / CONVERGENCE_TOLERANCE), 1.0))


def _build_stage_games(problem: Problem, tables: Tables, values: Reals) -> Reals:
    """The matrix game `[S, A1, A2]` of every state, to the first."""
    shape = (len(values), *problem.action_counts)
    return value_iteration.compute_action_values(tables, problem.discount, values).reshape(shape)


def _solve_stage_games(stage_games: Reals) -> tuple[Reals, Reals]:
    """What both do in every state."""
    solved = zero_sum.solve_matrix_games(stage_games)
    return solved.row_strategies, solved.column_strategies


def _evaluate_policies(tables: Tables, discount: float, policies: tuple[Reals, Reals]) -> Reals:
    """The first's values `[S]` while both play so for ever."""
    joint = (policies[0][:, :, None] * policies[1][:, None]).reshape(len(policies[0]), -1)
    return value_iteration.evaluate_policy(tables, discount, joint)


def _evaluate_seat(
    problem: Problem, policies: tuple[Reals, Reals], seat: int
) -> tuple[Reals, Reals, float]:
    """What a seat earns `[S]`, what each action is worth `[S, A]`, and what it could gain."""
    model = best_response.build_induced_mdp(problem, seat, policies)
    values = sparse.evaluate_policy(model, problem.discount, policies[seat])
    gain = sparse.compute_optimal_q(model, problem.discount).max(axis=1) - values
    return (
        values,
        sparse.compute_action_values(model, problem.discount, values),
        float(max(gain.max(), 0.0)),
    )


def _tabulate_opposed_game(problem: Problem) -> Tables:
    """The arrays of a game of two in which one gains what the other loses, to scale."""
    if len(problem.agents) != 2 or problem.partially_observable:
        raise BadParameter(
            f"got {format_count(len(problem.agents), 'agent')}, expected two who see the state"
        )
    if problem.discount >= 1.0:
        raise BadParameter("a game without end needs a discount below 1")
    if not isinstance(problem.state_count, int) or problem.state_count > MAX_STATES:
        raise BadParameter(f"got {problem.state_count} states, expected at most {MAX_STATES}")
    tables = tabulate(problem)
    first, second = tables.rewards.reshape(-1, 2).T
    spread = first - first.mean()
    slope = float((spread * second).sum() / ((spread * spread).sum() or 1.0))
    if slope >= 0 or abs(second - second.mean() - slope * spread).max() > CONVERGENCE_TOLERANCE:
        raise BadParameter("got rewards that are not opposed: one must fall as the other rises")
    return tables
