"""Simple games of any number of agents: an equilibrium in pure actions, else matched regrets.

Where nobody gains by another action than one that is sure the game is solved. Else each agent
plays by how much it regrets not to have played each action, at least 0 (Hart and Mas-Colell, 2000;
Tammelin, 2014, for the + ), and what all played on average is told with what each could gain: of
two who oppose each other that vanishes, of more agents it need not.
"""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Reals
from dmplay.solvers.value_iteration import VALUE_TOLERANCE

MAX_ROUNDS = 4096


class RegretMatchingResult(NamedTuple):
    """What each agent plays, and what it could gain by another action."""

    mixed_strategies: tuple[Reals, ...]  # [A] of each agent
    regrets: Reals  # [n]
    round_count: int  # 0 where it is an equilibrium in pure actions


def find_equilibrium(payoffs: Reals) -> RegretMatchingResult:
    """The best that is found for the payoffs `[A1, ..., An, n]`."""
    pure = _find_pure_equilibrium(payoffs)
    return pure or _run_regret_matching(payoffs)


def compute_response_values(
    payoffs: Reals, mixed_strategies: tuple[Reals, ...], seat: int
) -> Reals:
    """What each action `[A]` of a seat earns it while the others play so."""
    worth = np.moveaxis(payoffs[..., seat], seat, 0)
    for other in reversed([mix for place, mix in enumerate(mixed_strategies) if place != seat]):
        worth = worth @ other
    return np.asarray(worth)


def compute_regrets(payoffs: Reals, mixed_strategies: tuple[Reals, ...]) -> Reals:
    """What each agent `[n]` could gain by another action."""
    each = [
        compute_response_values(payoffs, mixed_strategies, seat)
        for seat in range(len(mixed_strategies))
    ]
    return np.array(
        [worth.max() - mix @ worth for worth, mix in zip(each, mixed_strategies, strict=True)]
    )


def _find_pure_equilibrium(payoffs: Reals) -> RegretMatchingResult | None:
    """The first equilibrium in pure actions, if there is one."""
    agents = payoffs.shape[-1]
    stable = np.ones(payoffs.shape[:-1], bool)
    for seat in range(agents):
        own = payoffs[..., seat]
        stable &= own >= own.max(axis=seat, keepdims=True) - VALUE_TOLERANCE
    if not stable.any():
        return None
    place = np.argwhere(stable)[0]
    mixes = tuple(np.eye(stable.shape[seat])[place[seat]] for seat in range(agents))
    return RegretMatchingResult(mixes, np.maximum(compute_regrets(payoffs, mixes), 0.0), 0)


def _run_regret_matching(payoffs: Reals) -> RegretMatchingResult:
    """The average of the rounds by which the least could be gained, looked at now and then."""
    budget = Budget("matching regrets", "try fewer agents or actions")
    agents = payoffs.shape[-1]
    regrets = [np.zeros(many) for many in payoffs.shape[:-1]]
    sums = [np.zeros(many) for many in payoffs.shape[:-1]]
    best: RegretMatchingResult | None = None
    for done in range(1, MAX_ROUNDS + 1):
        budget.spend_work(ARRAY_CALL_WORK * agents + 4.0 * payoffs.size * agents, done / MAX_ROUNDS)
        for seat in range(agents):  # one after the other
            mixes = tuple(map(_compute_regret_strategy, regrets))
            worth = compute_response_values(payoffs, mixes, seat)
            sums[seat] += done * mixes[seat]
            regrets[seat] = np.maximum(regrets[seat] + worth - mixes[seat] @ worth, 0.0)
        if done & (done - 1) == 0:
            mean = tuple(one / one.sum() for one in sums)
            found = RegretMatchingResult(mean, compute_regrets(payoffs, mean), done)
            if best is None or found.regrets.max() < best.regrets.max():
                best = found
            if best.regrets.max() <= VALUE_TOLERANCE:
                break
    assert best
    return best


def _compute_regret_strategy(cumulative_regret: Reals) -> Reals:
    """A mix in proportion to regrets; anything where there are none."""
    total = cumulative_regret.sum()
    return np.asarray(
        cumulative_regret / total
        if total > 0
        else np.full(len(cumulative_regret), 1.0 / len(cumulative_regret))
    )
