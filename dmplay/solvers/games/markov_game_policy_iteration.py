"""Equilibria of Markov games of two agents with opposed interests (section 25.3).

Policy iteration (Pollatschek and Avi-Itzhak, 1969): solve the matrix game of every state, evaluate
these policies for ever, and use the values in new matrix games. The game need not be zero-sum: the
second agent's reward may be any decreasing linear function of the first's.
"""

from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.best_actions import compute_reward_scale
from dmplay.core.problem import Problem
from dmplay.core.tabular import Tables, tabulate
from dmplay.core.text import format_count
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget, scale_progress
from dmplay.errors import BadParameter
from dmplay.solvers.games import induced_mdp, zero_sum
from dmplay.solvers.mdp import mdp_values, sparse_mdp

CONVERGENCE_TOLERANCE = 1e-9  # change of the values that ends the iteration
MAX_ROUNDS = 200
MAX_STATES = 500  # of the problem
# of the last payoffs: the last bits differ between processors, but policies must not
PAYOFF_DECIMALS = 9


class MarkovGameEquilibrium(NamedTuple):
    """Policies that are best responses to each other, up to the given regrets."""

    policies: tuple[Reals, Reals]  # [S, A1], [S, A2]
    action_values: tuple[Reals, Reals]  # [S] of each agent under these policies
    q: tuple[Reals, Reals]  # [S, A1], [S, A2], of each action against the other's policy
    regrets: tuple[float, float]  # gain by the best response, in the worst state
    value_changes: tuple[float, ...]  # greatest change of a value, by round


def find_equilibrium(problem: Problem) -> MarkovGameEquilibrium:
    """Return an equilibrium of a game of two agents with opposed interests.

    Raises BadParameter for other games, or if `discount` is 1.
    """
    budget = Budget("equilibrium", "try fewer states, or the agent search", 2e10)
    tables = _tabulate_opposed_game(problem)
    values: Reals = np.zeros(len(tables.transition))
    changes, scale = [np.inf], compute_reward_scale(tables.rewards[:, :, 0])
    while changes[-1] > CONVERGENCE_TOLERANCE and len(changes) <= MAX_ROUNDS:
        progress = _estimate_progress(changes)
        solve_work = len(values) * (10 * ARRAY_CALL_WORK + len(values) ** 2 / 10)
        budget.spend_work(4 * tables.transition.size + solve_work, progress)
        with scale_progress(progress, progress):
            policies = _solve_stage_games(_build_stage_games(problem, tables, values))
        new_values = _evaluate_policies(tables, problem.discount, policies)
        changes.append(float(abs(new_values - values).max()) / scale)
        values = new_values
    with scale_progress(1.0, 1.0):
        stage_games = _build_stage_games(problem, tables, values) / scale
        policies = _solve_stage_games(scale * np.round(stage_games, PAYOFF_DECIMALS))
        seats = zip(*(_evaluate_seat(problem, policies, seat) for seat in (0, 1)), strict=True)
        (first_values, second_values), (q1, q2), (regret1, regret2) = seats
    value_changes = tuple(change * scale for change in changes[1:])
    return MarkovGameEquilibrium(
        policies, (first_values, second_values), (q1, q2), (regret1, regret2), value_changes
    )


def _estimate_progress(changes: list[float]) -> float:
    """Return the progress of the least change from the first one to the tolerance, 0 to 1."""
    if len(changes) == 1:
        return 0.0
    remaining = max(min(changes), CONVERGENCE_TOLERANCE) / CONVERGENCE_TOLERANCE
    return float(1.0 - np.log(remaining) / max(np.log(changes[1] / CONVERGENCE_TOLERANCE), 1.0))


def _build_stage_games(problem: Problem, tables: Tables, values: Reals) -> Reals:
    """Return the matrix game `[S, A1, A2]` of every state, as payoffs to the first agent."""
    shape = (len(values), *problem.action_counts)
    return mdp_values.compute_action_values(tables, problem.discount, values).reshape(shape)


def _solve_stage_games(stage_games: Reals) -> tuple[Reals, Reals]:
    """Return the equilibrium strategies of both agents in every state."""
    solutions = zero_sum.solve_matrix_games(stage_games)
    return solutions.row_strategies, solutions.column_strategies


def _evaluate_policies(tables: Tables, discount: float, policies: tuple[Reals, Reals]) -> Reals:
    """Return the first agent's values `[S]` under these policies."""
    joint = (policies[0][:, :, None] * policies[1][:, None]).reshape(len(policies[0]), -1)
    return mdp_values.evaluate_policy(tables, discount, joint)


def _evaluate_seat(
    problem: Problem, policies: tuple[Reals, Reals], seat: int
) -> tuple[Reals, Reals, float]:
    """Return a seat's values `[S]`, action values `[S, A]`, and regret in the worst state."""
    model = induced_mdp.build_induced_mdp(problem, seat, policies)
    values = sparse_mdp.evaluate_policy(model, problem.discount, policies[seat])
    gains = sparse_mdp.compute_optimal_q(model, problem.discount).max(axis=1) - values
    q = sparse_mdp.compute_action_values(model, problem.discount, values)
    return values, q, float(max(gains.max(), 0.0))


def _tabulate_opposed_game(problem: Problem) -> Tables:
    """Return the tables of a game of two agents with opposed interests.

    Raises BadParameter if it is not one: the second reward must be a decreasing linear function of
    the first.
    """
    if len(problem.agents) != 2 or problem.partially_observable:
        raise BadParameter(
            f"got {format_count(len(problem.agents), 'agent')}, expected 2 that both see the state"
        )
    if problem.discount >= 1.0:
        raise BadParameter("an infinite horizon needs a discount below 1")
    if not isinstance(problem.state_count, int) or problem.state_count > MAX_STATES:
        raise BadParameter(f"got {problem.state_count} states, expected at most {MAX_STATES}")
    tables = tabulate(problem)
    first, second = tables.rewards.reshape(-1, 2).T
    spread = first - first.mean()
    slope = float((spread * second).sum() / ((spread * spread).sum() or 1.0))
    deviation = abs(second - second.mean() - slope * spread).max()
    if slope >= 0 or deviation > CONVERGENCE_TOLERANCE * compute_reward_scale(second):
        raise BadParameter(
            "got rewards that are not opposed, expected one to fall as the other rises"
        )
    return tables
