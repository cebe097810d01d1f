"""Simple games of any number of agents: an equilibrium in pure actions, else matched regrets.

Where nobody gains by another action than one that is sure the game is solved. Else each agent
plays by how much it regrets not to have played each action, at least 0 (Hart and Mas-Colell, 2000;
Tammelin, 2014, for the + ), and what all played on average is told with what each could gain: of
two who oppose each other that vanishes, of more agents it need not.
"""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Reals
from dmplay.solvers.value_iteration import SLACK

ROUNDS = 4096


class Matched(NamedTuple):
    """What each agent plays, and what it could gain by another action."""

    mixes: tuple[Reals, ...]  # [A] of each agent
    gains: Reals  # [n]
    rounds: int  # 0 where it is an equilibrium in pure actions


def equilibrium(payoffs: Reals) -> Matched:
    """The best that is found for the payoffs `[A1, ..., An, n]`."""
    pure = _pure(payoffs)
    return pure or _matched(payoffs)


def replies(payoffs: Reals, mixes: tuple[Reals, ...], seat: int) -> Reals:
    """What each action `[A]` of a seat earns it while the others play so."""
    worth = np.moveaxis(payoffs[..., seat], seat, 0)
    for other in reversed([mix for place, mix in enumerate(mixes) if place != seat]):
        worth = worth @ other
    return np.asarray(worth)


def gains(payoffs: Reals, mixes: tuple[Reals, ...]) -> Reals:
    """What each agent `[n]` could gain by another action."""
    each = [replies(payoffs, mixes, seat) for seat in range(len(mixes))]
    return np.array([worth.max() - mix @ worth for worth, mix in zip(each, mixes, strict=True)])


def _pure(payoffs: Reals) -> Matched | None:
    """The first equilibrium in pure actions, if there is one."""
    agents = payoffs.shape[-1]
    stable = np.ones(payoffs.shape[:-1], bool)
    for seat in range(agents):
        own = payoffs[..., seat]
        stable &= own >= own.max(axis=seat, keepdims=True) - SLACK
    if not stable.any():
        return None
    place = np.argwhere(stable)[0]
    mixes = tuple(np.eye(stable.shape[seat])[place[seat]] for seat in range(agents))
    return Matched(mixes, np.maximum(gains(payoffs, mixes), 0.0), 0)


def _matched(payoffs: Reals) -> Matched:
    """The average of the rounds by which the least could be gained, looked at now and then."""
    budget = Budget("matching regrets", "try fewer agents or actions")
    agents = payoffs.shape[-1]
    regrets = [np.zeros(many) for many in payoffs.shape[:-1]]
    sums = [np.zeros(many) for many in payoffs.shape[:-1]]
    best: Matched | None = None
    for done in range(1, ROUNDS + 1):
        budget.spend(ROUND * agents + 4.0 * payoffs.size * agents, done / ROUNDS)
        for seat in range(agents):  # one after the other
            mixes = tuple(map(_by_regret, regrets))
            worth = replies(payoffs, mixes, seat)
            sums[seat] += done * mixes[seat]
            regrets[seat] = np.maximum(regrets[seat] + worth - mixes[seat] @ worth, 0.0)
        if done & (done - 1) == 0:
            mean = tuple(one / one.sum() for one in sums)
            found = Matched(mean, gains(payoffs, mean), done)
            if best is None or found.gains.max() < best.gains.max():
                best = found
            if best.gains.max() <= SLACK:
                break
    assert best
    return best


def _by_regret(regret: Reals) -> Reals:
    """A mix in proportion to regrets; anything where there are none."""
    total = regret.sum()
    return np.asarray(regret / total if total > 0 else np.full(len(regret), 1.0 / len(regret)))
