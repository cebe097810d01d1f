"""What the states of a small problem are worth to one seat, found at once and roughly right.

A search stops its simulations by it. Value iteration over what can happen (section 7.5), as if all
were seen from then on: an upper bound where states are hidden, as of QMDP (section 21.1). The
others act uniformly at random; a team that shares its reward acts as one.
"""

import math
from dataclasses import dataclass

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Array, FiniteChance, Ints, Reals
from dmplay.core import Memory, Problem, checked_state_indices, enumerate_possible_outcomes
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.tabular import joint_actions, replace_illegal_actions

MAX_OUTCOMES, OUTCOMES_PER_BLOCK = 8_000_000, 2**17  # that are listed, and in one go
WORK_LIMIT = 2e9
MAX_VALUE_BYTES = 2**26  # of values by the turns left
MAX_SWEEPS = 1000  # sweeps
CONVERGENCE_TOLERANCE = 1e-6  # a change, beside the greatest value, that ends them


@dataclass(frozen=True)
class LeafValues:
    """The rewards to expect from each state, by the turns left; the last line for more."""

    problem: Problem
    values_by_turns_left: Reals  # [K, S]

    def __call__(self, s: Array, memory: Memory, turns_left: Ints) -> Reals:
        """Those of states `[N, ...]` with so many turns left `[N]`."""
        turns = np.minimum(turns_left, len(self.values_by_turns_left) - 1)
        return np.asarray(self.values_by_turns_left[turns, self.problem.state_indices(s)])


def estimate_leaf_values(problem: Problem, seat: int, turns: int | None) -> LeafValues | None:
    """The rewards ahead in a game of so many turns; None where they are not found at once."""
    if not isinstance(problem.state_count, int) or (turns is None and problem.discount == 1.0):
        return None
    sweeps = MAX_SWEEPS if turns is None else turns
    kept = 1 if turns is None else sweeps + 1
    try:
        budget = Budget("rewards ahead", "search needs none", WORK_LIMIT, MAX_VALUE_BYTES)
        budget.check_memory(8.0 * kept * problem.state_count)
        return LeafValues(problem, _sweep_values(problem, seat, sweeps, kept, budget))
    except (BadParameter, BudgetExceeded):
        return None


def _sweep_values(
    problem: Problem, seat: int, max_sweeps: int, stored_sweep_count: int, budget: Budget
) -> Reals:
    """The values `[K, S]` after each of the last sweeps, made as long as the values change."""
    first, p, after, rewards = _list_outcomes(problem, seat, budget)
    shape = problem.action_counts
    others = tuple(1 + i for i in range(len(shape)) if i != seat)
    values = [np.zeros(len(rewards))]
    for _ in range(max_sweeps):
        budget.spend_work(ARRAY_CALL_WORK + 4 * len(p))
        later = np.add.reduceat(p * values[-1][after], first).reshape(rewards.shape)
        q = (rewards + problem.discount * later).reshape(-1, *shape)
        each = q.max(axis=others) if problem.shared_reward else q.mean(axis=others)
        values.append(each.max(axis=1))
        change = np.abs(values[-1] - values[-2]).max()
        values = values[-max(stored_sweep_count, 2) :]
        if change <= CONVERGENCE_TOLERANCE * np.abs(values[-1]).max():
            break
    return np.array(values[-stored_sweep_count:])


def _list_outcomes(problem: Problem, seat: int, budget: Budget) -> tuple[Ints, Reals, Ints, Reals]:
    """Where the outcomes of each state and joint action begin, their p and states; R `[S, A]`."""
    states, choices = problem.enumerate_states(), joint_actions(problem)
    some = problem.chance(states[:1], replace_illegal_actions(problem, states[:1], choices[:1]))
    each = [one.probabilities().shape[1] for one in some if isinstance(one, FiniteChance)]
    many = len(choices) * math.prod(each)
    if len(each) < len(some) or len(states) * many > MAX_OUTCOMES:
        raise BudgetExceeded(
            "rewards ahead", f"more than {MAX_OUTCOMES} outcomes", "search needs none"
        )
    parts = []
    for at in range(0, len(states), max(OUTCOMES_PER_BLOCK // many, 1)):
        here = states[at : at + max(OUTCOMES_PER_BLOCK // many, 1)]
        budget.spend_work(ARRAY_CALL_WORK + 100.0 * len(here) * many)
        s, a = np.repeat(here, len(choices), axis=0), np.tile(choices, (len(here), 1))
        row, p, outcome = enumerate_possible_outcomes(
            problem, s, replace_illegal_actions(problem, s, a)
        )
        rewards = np.bincount(row, p * outcome.rewards[:, seat], len(s)).astype(float)
        parts.append(
            (
                np.bincount(row, minlength=len(s)),
                p,
                checked_state_indices(problem, outcome.state),
                rewards,
            )
        )
    lengths, p, after, rewards = (np.concatenate(part) for part in zip(*parts, strict=True))
    return np.cumsum(lengths) - lengths, p, after, rewards.reshape(len(states), -1)
