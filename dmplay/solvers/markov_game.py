"""Equilibria of Markov games of two whose interests are opposed (section 25.3).

By policy iteration (Pollatschek and Avi-Itzhak, 1969): both solve the matrix game of every state,
play so for ever, and what that is worth gives new matrix games. The game need not be zero-sum: the
second's reward may be any falling linear function of the first's.
"""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget, between
from dmplay.chance import Reals
from dmplay.core import Problem
from dmplay.describe import counted
from dmplay.errors import BadParameter
from dmplay.solvers import best_response, sparse, value_iteration, zero_sum
from dmplay.tabular import Tables, tabulate

SETTLED = 1e-9  # a change of value that ends it
MOST_ROUNDS = 200
LARGEST = 500  # states
DIGITS = 9  # of the last payoffs: the last bits differ between processors, and policies must not


class Equilibrium(NamedTuple):
    """Policies that are the best answers to one another, as nearly as the gaps say."""

    play: tuple[Reals, Reals]  # [S, A1], [S, A2]
    values: tuple[Reals, Reals]  # [S] of each agent while both play so
    q: tuple[Reals, Reals]  # [S, A1], [S, A2]: of each action against the other's policy
    gaps: tuple[float, float]  # what each could gain by another policy, in the worst state
    changes: tuple[float, ...]  # of the values, round by round


def equilibrium(problem: Problem) -> Equilibrium:
    """An equilibrium of a game of two with opposed interests; `discount` below 1."""
    budget = Budget("an equilibrium", "try fewer states, or search", 2e10)
    tables = _opposed(problem)
    values: Reals = np.zeros(len(tables.transition))
    changes = [np.inf]
    while changes[-1] > SETTLED and len(changes) <= MOST_ROUNDS:
        share = _share(changes)
        budget.spend(
            4 * tables.transition.size + len(values) * (10 * ROUND + len(values) ** 2 / 10), share
        )
        with between(share, share):
            play = _play(_games(problem, tables, values))
        after = _evaluate(tables, problem.discount, play)
        changes.append(float(abs(after - values).max()))
        values = after
    with between(1.0, 1.0):
        play = _play(np.round(_games(problem, tables, values), DIGITS))
        (one, q1, gap1), (two, q2, gap2) = (_weighed(problem, play, seat) for seat in (0, 1))
    return Equilibrium(play, (one, two), (q1, q2), (gap1, gap2), tuple(changes[1:]))


def _share(changes: list[float]) -> float:
    """How far the least change has come from the first to the one that ends it."""
    if len(changes) == 1:
        return 0.0
    left = max(min(changes), SETTLED) / SETTLED
    return float(1.0 - np.log(left) / max(np.log(changes[1] / SETTLED), 1.0))


def _games(problem: Problem, tables: Tables, values: Reals) -> Reals:
    """The matrix game `[S, A1, A2]` of every state, to the first."""
    shape = (len(values), *problem.action_counts)
    return value_iteration.action_values(tables, problem.discount, values).reshape(shape)


def _play(games: Reals) -> tuple[Reals, Reals]:
    """What both do in every state."""
    solved = zero_sum.every(games)
    return solved.rows, solved.columns


def _evaluate(tables: Tables, discount: float, play: tuple[Reals, Reals]) -> Reals:
    """The first's values `[S]` while both play so for ever."""
    joint = (play[0][:, :, None] * play[1][:, None]).reshape(len(play[0]), -1)
    return value_iteration.evaluate(tables, discount, joint)


def _weighed(problem: Problem, play: tuple[Reals, Reals], seat: int) -> tuple[Reals, Reals, float]:
    """What a seat earns `[S]`, what each action is worth `[S, A]`, and what it could gain."""
    model = best_response.faced(problem, seat, play)
    values = sparse.evaluate(model, problem.discount, play[seat])
    gain = sparse.optimal(model, problem.discount).max(axis=1) - values
    return (
        values,
        sparse.action_values(model, problem.discount, values),
        float(max(gain.max(), 0.0)),
    )


def _opposed(problem: Problem) -> Tables:
    """The arrays of a game of two in which one gains what the other loses, to scale."""
    if len(problem.agents) != 2 or problem.hidden:
        raise BadParameter(
            f"got {counted(len(problem.agents), 'agent')}, expected two who see the state"
        )
    if problem.discount >= 1.0:
        raise BadParameter("a game without end needs a discount below 1")
    if not isinstance(problem.states, int) or problem.states > LARGEST:
        raise BadParameter(f"got {problem.states} states, expected at most {LARGEST}")
    tables = tabulate(problem)
    first, second = tables.rewards.reshape(-1, 2).T
    spread = first - first.mean()
    slope = float((spread * second).sum() / ((spread * spread).sum() or 1.0))
    if slope >= 0 or abs(second - second.mean() - slope * spread).max() > SETTLED:
        raise BadParameter("got rewards that are not opposed: one must fall as the other rises")
    return tables
