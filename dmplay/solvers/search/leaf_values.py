"""Quick value estimates of the states of a small problem, for the leaves of a search.

A search uses them to end its simulations early. They come from value iteration over the possible
outcomes (section 7.5), as if every state were observed from then on: an upper bound if states are
hidden, as for QMDP (section 21.1). The other agents act uniformly at random; agents that share
one reward act together as one.
"""

import math
from dataclasses import dataclass

import numpy as np

from dmplay.core.arrays import Array, Ints, Reals
from dmplay.core.chance import FiniteChance
from dmplay.core.policy import Memory
from dmplay.core.problem import Problem, checked_state_indices, enumerate_possible_outcomes
from dmplay.core.tabular import joint_actions, replace_illegal_actions
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.errors import BadParameter, BudgetExceeded

# maximum outcomes of a problem, and outcomes listed at a time
MAX_OUTCOMES, OUTCOMES_PER_BLOCK = 8_000_000, 2**17
WORK_LIMIT = 2e9
MAX_VALUE_BYTES = 2**26  # bytes of the values by turns left
MAX_SWEEPS = 1000
CONVERGENCE_TOLERANCE = 1e-6  # relative to the greatest value


@dataclass(frozen=True)
class LeafValues:
    """Estimated values of the states, by the number of turns left.

    The last row also serves larger numbers of turns.
    """

    problem: Problem
    values_by_turns_left: Reals  # [K, S]

    def __call__(self, s: Array, memory: Memory, turns_left: Ints) -> Reals:
        """Return the values `[N]` of states `[N, ...]` with `turns_left` `[N]` turns to play."""
        turns = np.minimum(turns_left, len(self.values_by_turns_left) - 1)
        return np.asarray(self.values_by_turns_left[turns, self.problem.state_indices(s)])


def estimate_leaf_values(problem: Problem, seat: int, turns: int | None) -> LeafValues | None:
    """Return leaf values for games of `turns` turns, or None if they cannot be found quickly.

    None is returned for infinitely many states, for games without a last turn or a discount, and if
    the outcomes cannot be listed within the limits.
    """
    if not isinstance(problem.state_count, int) or (turns is None and problem.discount == 1.0):
        return None
    max_sweeps = MAX_SWEEPS if turns is None else turns
    stored_sweep_count = 1 if turns is None else max_sweeps + 1
    try:
        budget = Budget("leaf values", "use playouts instead", WORK_LIMIT, MAX_VALUE_BYTES)
        budget.check_memory(8.0 * stored_sweep_count * problem.state_count)
        values = _sweep_values(problem, seat, max_sweeps, stored_sweep_count, budget)
        return LeafValues(problem, values)
    except (BadParameter, BudgetExceeded):
        return None


def _sweep_values(
    problem: Problem, seat: int, max_sweeps: int, stored_sweep_count: int, budget: Budget
) -> Reals:
    """Return the values `[K, S]` after each of the last sweeps of value iteration.

    The sweeps stop early once the values no longer change.
    """
    outcome_starts, p, next_states, rewards = _list_outcomes(problem, seat, budget)
    rewards = rewards.reshape(-1, *problem.action_counts)
    other_axes = tuple(1 + i for i in range(len(problem.agents)) if i != seat)
    values = [np.zeros(len(rewards))]
    for _ in range(max_sweeps):
        budget.spend_work(ARRAY_CALL_WORK + 4 * len(p))
        expected_next = np.add.reduceat(p * values[-1][next_states], outcome_starts)
        q = rewards + problem.discount * expected_next.reshape(rewards.shape)
        seat_q = q.max(axis=other_axes) if problem.shared_reward else q.mean(axis=other_axes)
        values.append(seat_q.max(axis=1))
        change = np.abs(values[-1] - values[-2]).max()
        values = values[-max(stored_sweep_count, 2) :]
        if change <= CONVERGENCE_TOLERANCE * np.abs(values[-1]).max():
            break
    return np.array(values[-stored_sweep_count:])


def _list_outcomes(problem: Problem, seat: int, budget: Budget) -> tuple[Ints, Reals, Ints, Reals]:
    """Return the outcomes of each state and joint action, and the seat's expected rewards.

    The result holds the index of the first outcome of each state and joint action, the
    probabilities and next states of all outcomes, and R `[S * A]`. Raises BudgetExceeded if there
    are too many.
    """
    states, choices = problem.enumerate_states(), joint_actions(problem)
    first_actions = replace_illegal_actions(problem, states[:1], choices[:1])
    chances = problem.chance(states[:1], first_actions)
    event_counts = [
        chance.probabilities().shape[1] for chance in chances if isinstance(chance, FiniteChance)
    ]
    outcomes_per_state = len(choices) * math.prod(event_counts)
    if len(event_counts) < len(chances) or len(states) * outcomes_per_state > MAX_OUTCOMES:
        raise BudgetExceeded(budget.task, f"more than {MAX_OUTCOMES} outcomes", budget.remedy)
    parts, step = [], max(OUTCOMES_PER_BLOCK // outcomes_per_state, 1)
    for start in range(0, len(states), step):
        block = states[start : start + step]
        budget.spend_work(ARRAY_CALL_WORK + 100.0 * len(block) * outcomes_per_state)
        s, a = np.repeat(block, len(choices), axis=0), np.tile(choices, (len(block), 1))
        a = replace_illegal_actions(problem, s, a)
        rows, p, outcome = enumerate_possible_outcomes(problem, s, a)
        rewards = np.bincount(rows, p * outcome.rewards[:, seat], len(s)).astype(float)
        next_states = checked_state_indices(problem, outcome.state)
        parts.append((np.bincount(rows, minlength=len(s)), p, next_states, rewards))
    counts, p, next_states, rewards = map(np.concatenate, zip(*parts, strict=True))
    return np.cumsum(counts) - counts, p, next_states, rewards
