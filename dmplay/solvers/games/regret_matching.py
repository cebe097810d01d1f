"""Simple games of any number of agents: a pure equilibrium, else regret matching+.

In regret matching each agent plays in proportion to its nonnegative cumulative regrets (Hart and
Mas-Colell, 2000; Tammelin, 2014, for the +). The result is the average strategy of all agents with
their regrets; these vanish for two opposed agents, but not always for more.
"""

from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.best_actions import VALUE_TOLERANCE, compute_reward_scale
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget

MAX_ROUNDS = 4096


class RegretMatchingResult(NamedTuple):
    """A mixed strategy for each agent, and each agent's gain by its best action."""

    mixed_strategies: tuple[Reals, ...]  # [A] of each agent
    regrets: Reals  # [n]
    round_count: int  # 0 for a pure equilibrium
    pure_count: int = 0  # number of pure equilibria


def find_equilibrium(payoffs: Reals) -> RegretMatchingResult:
    """Return the best solution found for the payoffs `[A1, ..., An, n]`."""
    pure = _find_pure_equilibrium(payoffs)
    return pure or _run_regret_matching(payoffs)


def compute_response_values(
    payoffs: Reals, mixed_strategies: tuple[Reals, ...], seat: int
) -> Reals:
    """Return the expected payoff of each action `[A]` of a seat against the others' strategies."""
    values = np.moveaxis(payoffs[..., seat], seat, 0)
    for other_strategy in reversed([*mixed_strategies[:seat], *mixed_strategies[seat + 1 :]]):
        values = values @ other_strategy
    return np.asarray(values)


def compute_regrets(payoffs: Reals, mixed_strategies: tuple[Reals, ...]) -> Reals:
    """Return the gain `[n]` of each agent by its best action."""
    regrets = np.zeros(len(mixed_strategies))
    for seat, strategy in enumerate(mixed_strategies):
        values = compute_response_values(payoffs, mixed_strategies, seat)
        regrets[seat] = values.max() - strategy @ values
    return regrets


def _compute_payoff_scale(seat_payoffs: Reals) -> float:
    """Return the scale of a seat's payoffs; a part that all of them share does not count."""
    return compute_reward_scale(seat_payoffs - seat_payoffs.min())


def _find_pure_equilibrium(payoffs: Reals) -> RegretMatchingResult | None:
    """Return the first equilibrium in pure actions, or None."""
    agents = payoffs.shape[-1]
    stable = np.ones(payoffs.shape[:-1], bool)
    for seat in range(agents):
        seat_payoffs = payoffs[..., seat]
        tolerance = VALUE_TOLERANCE * _compute_payoff_scale(seat_payoffs)
        stable &= seat_payoffs >= seat_payoffs.max(axis=seat, keepdims=True) - tolerance
    if not stable.any():
        return None
    actions = np.argwhere(stable)[0]
    strategies = tuple(np.eye(stable.shape[seat])[actions[seat]] for seat in range(agents))
    regrets = np.maximum(compute_regrets(payoffs, strategies), 0.0)
    return RegretMatchingResult(strategies, regrets, 0, int(np.count_nonzero(stable)))


def _run_regret_matching(payoffs: Reals) -> RegretMatchingResult:
    """Return the average strategies with the least maximum regret.

    `payoffs` is `[A1, A2, ..., n]`. The averages are checked after rounds 1, 2, 4, 8, ..., until
    no agent can gain or `MAX_ROUNDS` are over.
    """
    budget = Budget("regret matching", "try fewer agents or actions")
    agents = payoffs.shape[-1]
    regrets = [np.zeros(action_count) for action_count in payoffs.shape[:-1]]
    sums = [np.zeros(action_count) for action_count in payoffs.shape[:-1]]
    best: RegretMatchingResult | None = None
    scales = np.array([_compute_payoff_scale(payoffs[..., seat]) for seat in range(agents)])
    for round_number in range(1, MAX_ROUNDS + 1):
        work = ARRAY_CALL_WORK * agents + 4.0 * payoffs.size * agents
        budget.spend_work(work, round_number / MAX_ROUNDS)
        for seat in range(agents):  # Agents are updated one after another.
            strategies = tuple(map(_compute_regret_strategy, regrets))
            values = compute_response_values(payoffs, strategies, seat)
            sums[seat] += round_number * strategies[seat]
            regrets[seat] = np.maximum(regrets[seat] + values - strategies[seat] @ values, 0.0)
        if round_number & (round_number - 1) == 0:
            averages = tuple(weighted_sum / weighted_sum.sum() for weighted_sum in sums)
            result = RegretMatchingResult(
                averages, compute_regrets(payoffs, averages), round_number
            )
            if best is None or (result.regrets / scales).max() < (best.regrets / scales).max():
                best = result
            if (best.regrets / scales).max() <= VALUE_TOLERANCE:
                break
    assert best
    return best


def _compute_regret_strategy(cumulative_regret: Reals) -> Reals:
    """Return a strategy in proportion to cumulative regrets, or the uniform one if all are 0."""
    total, action_count = cumulative_regret.sum(), len(cumulative_regret)
    return cumulative_regret / total if total > 0 else np.full(action_count, 1.0 / action_count)
