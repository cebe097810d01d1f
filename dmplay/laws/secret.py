"""What one agent may do tells it nothing of a hidden state: all that it may be in allow the same.

Else who is told what is legal knows more than its belief does, and no value of a belief holds.
"""

from collections.abc import Iterator

import numpy as np

from dmplay.chance import Array, Bools, Ints
from dmplay.core import (
    Problem,
    checked_state_indices,
    enumerate_possible_outcomes,
    initial_state_distribution,
)
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.laws.arrays import PROBABILITY_TOLERANCE
from dmplay.laws.breach import CheckResult, CheckResults
from dmplay.laws.samples import MAX_ENUMERATED_STATES


def check_legal_action_leak(problem: Problem) -> CheckResults:
    """States that look alike allow the same, as far as some hundred sets of them tell."""
    few = isinstance(problem.state_count, int) and problem.state_count <= MAX_ENUMERATED_STATES
    if not (
        problem.partially_observable
        and few
        and len(problem.agents) == 1
        and problem.actions[0].labels
    ):
        return
    states = problem.enumerate_states()
    legal = problem.legal_actions_mask(states)
    if legal is None or not (legal != legal[:1]).any():
        return
    able = legal[:, 0]
    try:
        alike = [*_iter_indistinguishable_states(problem, states, able)]
    except (
        BadParameter,
        BudgetExceeded,
    ):  # what can happen is not listed, or a law before is broken
        return
    for some in alike:
        other = some[(able[some] != able[some[0]]).any(axis=1)][:1]
        one, two = (problem.format_state(states[s]) for s in (some[0], *other, some[0])[:2])
        apart = f"other actions in {two!r} than in {one!r}, which nothing seen tells apart"
        yield CheckResult(not len(other), "legal_actions_mask", f"legal_actions_mask: got {apart}")


def has_legal_action_leak(problem: Problem) -> bool:
    """Whether what is legal tells of a hidden state, so that no value of a belief holds."""
    return not all(fact.ok for fact in check_legal_action_leak(problem))


def _iter_indistinguishable_states(problem: Problem, states: Array, legal: Bools) -> Iterator[Ints]:
    """Sets of states that an agent which sees what they allow cannot tell apart, some hundred."""
    ways = [_possible_transitions(problem, states, legal[:, a], a) for a in range(legal.shape[1])]
    goes_on, sight = ~problem.terminal(states), problem.initial_observations(states)[:, 0]
    p, begun = initial_state_distribution(problem)
    start = np.isin(
        np.arange(len(states)), checked_state_indices(problem, begun)[p > PROBABILITY_TOLERANCE]
    )
    found = [start & (sight == seen) for seen in np.unique(sight[start])]
    known = {one.tobytes() for one in found}
    for here in found:  # which grows
        some = np.flatnonzero(here & goes_on)
        if not len(some):
            continue
        yield some
        if len(found) > MAX_ENUMERATED_STATES:
            continue
        for a in np.flatnonzero(legal[some].all(axis=0)):
            led = np.isin(ways[a][0], some)
            _, after, seen = (part[led] for part in ways[a])
            for one in np.unique(seen):
                then = np.isin(np.arange(len(states)), after[seen == one])
                if then.tobytes() not in known:
                    known.add(then.tobytes())
                    found.append(then)


def _possible_transitions(
    problem: Problem, states: Array, legal: Bools, a: int
) -> tuple[Ints, Ints, Ints]:
    """From which state an action can lead to which, and what is seen then, each `[N]`."""
    some = np.flatnonzero(legal)
    row, p, outcome = enumerate_possible_outcomes(problem, states[some], np.full((len(some), 1), a))
    found = some[row], checked_state_indices(problem, outcome.state), outcome.observations[:, 0]
    source, after, seen = (
        part[p > PROBABILITY_TOLERANCE] for part in found
    )  # the rest is rounding
    return source, after, seen
