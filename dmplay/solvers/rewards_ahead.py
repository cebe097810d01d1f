"""What the states of a small problem are worth to one seat, found at once and roughly right.

A search stops its simulations by it. Value iteration over what can happen (section 7.5), as if all
were seen from then on: an upper bound where states are hidden, as of QMDP (section 21.1). The
others act uniformly at random; a team that shares its reward acts as one.
"""

import math
from dataclasses import dataclass

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Array, Finite, Ints, Reals
from dmplay.core import Memory, Problem, placed, possible
from dmplay.errors import BadParameter, TooMuch
from dmplay.tabular import allowed, joint_actions

OUTCOMES, BLOCK = 8_000_000, 2**17  # that are listed, and in one go
WORK = 2e9
BYTES = 2**26  # of values by the turns left
LONG = 1000  # sweeps
STILL = 1e-6  # a change, beside the greatest value, that ends them


@dataclass(frozen=True)
class RewardsAhead:
    """The rewards to expect from each state, by the turns left; the last line for more."""

    problem: Problem
    values: Reals  # [K, S]

    def __call__(self, s: Array, memory: Memory, left: Ints) -> Reals:
        """Those of states `[N, ...]` with so many turns left `[N]`."""
        turns = np.minimum(left, len(self.values) - 1)
        return np.asarray(self.values[turns, self.problem.index(s)])


def found(problem: Problem, seat: int, turns: int | None) -> RewardsAhead | None:
    """The rewards ahead in a game of so many turns; None where they are not found at once."""
    if not isinstance(problem.states, int) or (turns is None and problem.discount == 1.0):
        return None
    sweeps = LONG if turns is None else turns
    kept = 1 if turns is None else sweeps + 1
    try:
        budget = Budget("rewards ahead", "search needs none", WORK, BYTES)
        budget.hold(8.0 * kept * problem.states)
        return RewardsAhead(problem, _swept(problem, seat, sweeps, kept, budget))
    except (BadParameter, TooMuch):
        return None


def _swept(problem: Problem, seat: int, sweeps: int, kept: int, budget: Budget) -> Reals:
    """The values `[K, S]` after each of the last sweeps, made as long as the values change."""
    first, p, after, rewards = _listed(problem, seat, budget)
    shape = problem.action_counts
    others = tuple(1 + i for i in range(len(shape)) if i != seat)
    values = [np.zeros(len(rewards))]
    for _ in range(sweeps):
        budget.spend(ROUND + 4 * len(p))
        later = np.add.reduceat(p * values[-1][after], first).reshape(rewards.shape)
        q = (rewards + problem.discount * later).reshape(-1, *shape)
        each = q.max(axis=others) if problem.shared_reward else q.mean(axis=others)
        values.append(each.max(axis=1))
        change = np.abs(values[-1] - values[-2]).max()
        values = values[-max(kept, 2) :]
        if change <= STILL * np.abs(values[-1]).max():
            break
    return np.array(values[-kept:])


def _listed(problem: Problem, seat: int, budget: Budget) -> tuple[Ints, Reals, Ints, Reals]:
    """Where the outcomes of each state and joint action begin, their p and states; R `[S, A]`."""
    states, choices = problem.enumerated(), joint_actions(problem)
    some = problem.chance(states[:1], allowed(problem, states[:1], choices[:1]))
    each = [one.probabilities().shape[1] for one in some if isinstance(one, Finite)]
    many = len(choices) * math.prod(each)
    if len(each) < len(some) or len(states) * many > OUTCOMES:
        raise TooMuch("rewards ahead", f"more than {OUTCOMES} outcomes", "search needs none")
    parts = []
    for at in range(0, len(states), max(BLOCK // many, 1)):
        here = states[at : at + max(BLOCK // many, 1)]
        budget.spend(ROUND + 100.0 * len(here) * many)
        s, a = np.repeat(here, len(choices), axis=0), np.tile(choices, (len(here), 1))
        row, p, outcome = possible(problem, s, allowed(problem, s, a))
        rewards = np.bincount(row, p * outcome.rewards[:, seat], len(s)).astype(float)
        parts.append(
            (np.bincount(row, minlength=len(s)), p, placed(problem, outcome.state), rewards)
        )
    lengths, p, after, rewards = (np.concatenate(part) for part in zip(*parts, strict=True))
    return np.cumsum(lengths) - lengths, p, after, rewards.reshape(len(states), -1)
