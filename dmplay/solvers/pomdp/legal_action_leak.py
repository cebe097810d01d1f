"""The invariant that the legal actions of one agent reveal nothing about a hidden state.

All states that the agent considers possible must have the same legal actions. Otherwise an agent
that sees the legal actions knows more than its belief, and the values of beliefs are wrong.
"""

from collections.abc import Iterator

import numpy as np

from dmplay.core.arrays import Array, Bools, Ints
from dmplay.core.problem import (
    Problem,
    checked_state_indices,
    enumerate_possible_outcomes,
    initial_state_distribution,
)
from dmplay.core.table_checks import PROBABILITY_TOLERANCE
from dmplay.core.violation import CheckResult, CheckResults
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.simulation.random_play import MAX_ENUMERATED_STATES


def check_legal_action_leak(problem: Problem) -> CheckResults:
    """Yield checks that states which an agent cannot tell apart have the same legal actions.

    At most some hundred sets of such states are checked.
    """
    count = problem.state_count
    has_few_states = isinstance(count, int) and count <= MAX_ENUMERATED_STATES
    is_discrete = has_few_states and len(problem.agents) == 1 and problem.actions[0].labels
    if not problem.partially_observable or not is_discrete:
        return
    states = problem.enumerate_states()
    legal = problem.legal_actions_mask(states)
    if legal is None or not (legal != legal[:1]).any():
        return
    legal_actions = legal[:, 0]
    try:
        state_sets = [*_iter_indistinguishable_states(problem, states, legal_actions)]
    except (BadParameter, BudgetExceeded):  # unlisted outcomes, or another violation
        return
    for state_set in state_sets:
        is_different = (legal_actions[state_set] != legal_actions[state_set[0]]).any(axis=1)
        first, second = (
            problem.format_state(states[s]) for s in state_set[[0, is_different.argmax()]]
        )
        message = (
            f"legal_actions_mask: got different actions in {first!r} and {second!r}, "
            "although the agent cannot distinguish these states"
        )
        yield CheckResult(not is_different.any(), "legal_actions_mask", message)


def has_legal_action_leak(problem: Problem) -> bool:
    """Return whether legal actions reveal something about a hidden state.

    The values of beliefs are then wrong.
    """
    return not all(result.ok for result in check_legal_action_leak(problem))


def _iter_indistinguishable_states(problem: Problem, states: Array, legal: Bools) -> Iterator[Ints]:
    """Yield sets of states that an agent which sees its legal actions cannot tell apart.

    No sets are added to the search after the first `MAX_ENUMERATED_STATES`.
    """
    transitions = [
        _possible_transitions(problem, states, legal[:, a], a) for a in range(legal.shape[1])
    ]
    is_active = ~problem.terminal(states)
    initial_observations = problem.initial_observations(states)[:, 0]
    p, start_states = initial_state_distribution(problem)
    is_start = np.zeros(len(states), bool)
    is_start[checked_state_indices(problem, start_states)[p > PROBABILITY_TOLERANCE]] = True
    masks = [
        is_start & (initial_observations == observation)
        for observation in np.unique(initial_observations[is_start])
    ]
    visited = {value.tobytes() for value in masks}
    for mask in masks:  # the list grows during the loop
        state_set = np.flatnonzero(mask & is_active)
        if not len(state_set):
            continue
        yield state_set
        if len(masks) > MAX_ENUMERATED_STATES:
            continue
        for a in np.flatnonzero(legal[state_set].all(axis=0)):
            is_source = np.isin(transitions[a][0], state_set)
            _, next_states, observation = (part[is_source] for part in transitions[a])
            for value in np.unique(observation):
                next_mask = np.isin(np.arange(len(states)), next_states[observation == value])
                if next_mask.tobytes() not in visited:
                    visited.add(next_mask.tobytes())
                    masks.append(next_mask)


def _possible_transitions(
    problem: Problem, states: Array, legal: Bools, a: int
) -> tuple[Ints, Ints, Ints]:
    """Return the possible transitions of an action: state, next state, observation, each `[N]`."""
    legal_states = np.flatnonzero(legal)
    actions = np.full((len(legal_states), 1), a)
    row, p, outcome = enumerate_possible_outcomes(problem, states[legal_states], actions)
    next_states = checked_state_indices(problem, outcome.state)
    is_possible = p > PROBABILITY_TOLERANCE  # smaller probabilities are rounding errors
    observations = outcome.observations[is_possible, 0]
    return legal_states[row[is_possible]], next_states[is_possible], observations
