"""Invariants of every problem, checked on turns that random play leads to.

An invariant yields check results; `find_violations` turns those that fail into violations. The
tests check the built-in problems for them.
"""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from dmplay.core.arrays import Array
from dmplay.core.chance import sample_chance_events
from dmplay.core.playability_checks import (
    check_legal_actions,
    check_outcome,
    check_parsed_state,
    check_typable_labels,
    format_first_state,
)
from dmplay.core.problem import Problem, enumerate_outcomes
from dmplay.core.spaces import Labels
from dmplay.core.tabular import tabulate
from dmplay.core.user_code_locations import describe_error_location
from dmplay.core.violation import (
    CheckResult,
    CheckResults,
    Findings,
    Violation,
    expect,
    make_violation,
    require,
)
from dmplay.errors import BadParameter, BudgetExceeded, UnknownName
from dmplay.simulation.random_play import (
    MAX_ENUMERATED_STATES,
    WALK_LENGTH,
    SampledTurns,
    count_uniforms,
    has_finite_outcomes,
    is_bitwise_equal,
    make_arrays_readonly,
    random_joint_actions,
    step_turn,
)

MAX_LISTED_TURNS = 24  # maximum number of turns whose outcomes are listed
ROUNDING_TOLERANCE = 1e-12  # difference of numbers that is due to rounding alone
MIN_PROBABILITY = -1e-15  # lowest probability that rounding can cause
# the method behind each array of `compute_batch_results`
RESPONSIBLE_METHODS = (
    "initial_states", *["resolve_events"] * 3, "terminal", "legal_actions_mask", "state_indices"
)  # fmt: skip


def _is_close(first: Array | float, second: Array | float) -> bool:
    """Return whether two arrays or numbers are equal up to rounding."""
    return np.allclose(first, second, rtol=1e-7, atol=ROUNDING_TOLERANCE)


def find_violations(owner: type, invariant: Callable[[], Findings]) -> Iterator[Violation]:
    """Yield the violations of an invariant, up to the first on which later checks depend.

    An error that the problem's own code raises is a violation too; an error of dmplay is raised
    again.
    """
    try:
        for result in invariant():
            if isinstance(result, Violation):
                yield result
            elif not result.ok:
                yield make_violation(owner, result.attribute, result.message)
                if not result.independent:
                    return
    except BudgetExceeded:  # too large to check, which is not a violation
        return
    except (BadParameter, UnknownName) as error:
        if str(error)[:1] in "./":
            yield Violation("", str(error))
        elif isinstance(error, BadParameter):  # it is about an event or a state
            yield make_violation(owner, "resolve_events", f"resolve_events: {error}")
        else:
            yield user_error_to_violation(error)
    except Exception as error:  # raised by user code
        yield user_error_to_violation(error)


def user_error_to_violation(error: Exception) -> Violation:
    """Return the violation of an error that user code raised; raise an error of dmplay again."""
    location, _, description = describe_error_location(error).partition(": ")
    if not location:
        raise error
    remedy = "; copy the array first" if "read-only" in description else ""
    return Violation(location, description + remedy)


def compute_batch_results(problem: Problem, turns: SampledTurns) -> tuple[Array, ...]:
    """Return all that a problem computes from a batch; the first axis of each array is the row."""
    rows = len(turns.s)
    legal = problem.legal_actions_mask(turns.s)
    is_finite = isinstance(problem.state_count, int)
    return (
        problem.sample_initial_states(turns.start_uniforms),
        *problem.step(turns.s, turns.a, turns.u),
        problem.terminal(turns.s),
        np.ones(rows, bool) if legal is None else legal,
        problem.state_indices(turns.s) if is_finite else np.zeros(rows, int),
    )


def check_row_independence(
    problem: Problem, subset: SampledTurns, expected: tuple[Array, ...]
) -> CheckResults:
    """Yield checks that rows give the same bits in a smaller batch as in the whole batch.

    `expected` has the whole batch's results for the rows of `subset`.
    """
    remedy = "expected it to be independent of the other rows"
    return _check_equal_batches(
        problem, subset, expected, f" for the same row in two batches; {remedy}"
    )


def check_determinism(
    problem: Problem, turns: SampledTurns, expected: tuple[Array, ...]
) -> CheckResults:
    """Yield checks that the same uniforms give the same results again, and no input is modified."""
    expectation = " from the same random numbers; expected the same result both times"
    return _check_equal_batches(problem, turns, expected, expectation)


def _check_equal_batches(
    problem: Problem, turns: SampledTurns, expected: tuple[Array, ...], expectation: str
) -> CheckResults:
    """Yield checks that turns give the same bits as expected."""
    arrays = zip(RESPONSIBLE_METHODS, expected, compute_batch_results(problem, turns), strict=True)
    for attribute, first, second in arrays:
        message = partial(_describe_difference, attribute, first, second, expectation)
        yield CheckResult(is_bitwise_equal(first, second), attribute, message)


def _describe_difference(attribute: str, first: Array, second: Array, expectation: str) -> str:
    """Return a message about the first row in which two arrays differ."""
    if first.shape != second.shape:
        return f"{attribute}: got the shapes {second.shape} and {first.shape}{expectation}"
    rows = np.flatnonzero((first != second).reshape(len(first), -1).any(axis=1))
    pair = "values that differ only in their bits"
    if len(rows):
        pair = f"{second[rows[0]].tolist()} and {first[rows[0]].tolist()}"
    return f"{attribute}: got {pair}{expectation}"


def check_sampling(problem: Problem, turns: SampledTurns) -> CheckResults:
    """Yield checks that start states and steps are those that the sampled events give."""
    rows = len(turns.s)
    start_events = sample_chance_events(problem.initial_chance(rows), turns.start_uniforms)
    states = problem.initial_states(rows, start_events)
    sampled = problem.sample_initial_states(turns.start_uniforms)
    got = "got a different state from the same random numbers, expected that of initial_states"
    yield require(is_bitwise_equal(states, sampled), f"sample_initial_states: {got}")
    events = sample_chance_events(problem.chance(turns.s, turns.a), turns.u)
    resolved = problem.resolve_events(turns.s, turns.a, events)
    outcome = problem.step(turns.s, turns.a, turns.u)
    got = "got a different outcome from the same random numbers, expected that of resolve_events"
    yield require(all(map(is_bitwise_equal, resolved, outcome)), f"step: {got}")


def check_shapes(problem: Problem, turns: SampledTurns) -> CheckResults:
    """Yield checks that outcomes have the declared shapes, ranges and number of uniforms."""
    count, expected = count_uniforms(problem, turns.s, turns.a), problem.uniform_counts.step
    got = f"chance: got distributions that consume {count} random numbers"
    yield require(count == expected, f"{got}, expected {expected}, as in the first turn")
    yield from check_outcome(problem, turns.s, problem.step(turns.s, turns.a, turns.u))


def check_state_text(problem: Problem, states: Array) -> CheckResults:
    """Yield checks that a state is written in one line, parsed again and written as before.

    The line may be long: the states of some problems contain the history of a game.
    """
    for s in states:
        text = problem.format_state(s)
        is_valid = text == text.strip() and len(text.splitlines()) == 1
        expected = "one line without spaces at its start or end"
        yield expect(is_valid, "format_state", text, expected)
        yield from check_parsed_state(problem, s, text)
        rewritten = problem.format_state(np.asarray(problem.parse_state(text)))
        message = f"format_state: got {rewritten!r} after parse_state, expected {text!r}"
        yield require(rewritten == text, message)


def check_state_index(problem: Problem, turns: SampledTurns) -> CheckResults:
    """Yield checks that the index of a state is its position in the list of all states."""
    if not isinstance(problem.state_count, int):
        return
    states = problem.enumerate_states()
    expected = f"expected {problem.state_count}, to match state_count"
    message = f"enumerate_states: got {len(states)} states, {expected}"
    yield require(len(states) == problem.state_count, message)
    indices = problem.state_indices(states)
    message = f"state_indices: got {indices.tolist()[:9]}, expected 0 to {len(states) - 1} in order"
    yield require(np.array_equal(indices, np.arange(len(states))), message)
    message = "enumerate_states: got a different state at the index that state_indices gives"
    yield require(np.array_equal(states[problem.state_indices(turns.s)], turns.s), message)


def check_terminal_states(problem: Problem, states: Array) -> CheckResults:
    """Yield checks that a terminal state does not change and has reward 0."""
    terminal_states = make_arrays_readonly(states[problem.terminal(states)])[0]
    for turn in range(4 if len(terminal_states) else 0):
        a = random_joint_actions(problem, None, turn, len(terminal_states))
        next_states, rewards, _ = step_turn(problem, terminal_states, a, turn)
        has_changed = (next_states != terminal_states).reshape(len(terminal_states), -1).any(axis=1)
        example = format_first_state(problem, terminal_states, has_changed)
        got = f"resolve_events: got a different state after the terminal state {example!r}"
        yield require(not has_changed.any(), f"{got}, expected it not to change")
        got = f"resolve_events: got rewards {rewards.min():g} to {rewards.max():g}"
        yield require((rewards == 0).all(), f"{got} after a terminal state, expected 0")
        message = "terminal: got False after a terminal state, expected True"
        yield require(problem.terminal(next_states).all(), message)


def check_action_labels(problem: Problem, turns: SampledTurns) -> CheckResults:
    """Yield checks that the action labels of a state are distinct names that can be typed."""
    for s in turns.s[:MAX_LISTED_TURNS]:
        spaces = zip(problem.action_labels(s) or (), problem.actions, strict=False)
        for labels, action_space in spaces:
            is_valid = isinstance(labels, Labels) and len(labels) == len(action_space.labels)
            expected = f"Labels with a name for each of {action_space!r}"
            yield expect(is_valid, "action_labels", labels, expected)
            yield from check_typable_labels("action_labels", labels)


def check_probabilities(problem: Problem, turns: SampledTurns) -> CheckResults:
    """Yield checks that probabilities are not negative and sum to 1."""
    s, a = turns.s[:MAX_LISTED_TURNS], turns.a[:MAX_LISTED_TURNS]
    if has_finite_outcomes(problem.chance(s, a)):
        p = enumerate_outcomes(problem, s, a).probabilities
        message = f"chance: got a probability of {p.min():g}, expected none below 0"
        yield require((p >= MIN_PROBABILITY).all(), message)
        message = f"chance: got probabilities that sum to {p.sum(axis=1).max():g}, expected 1"
        yield require(_is_close(p.sum(axis=1), 1), message)
    if isinstance(problem.state_count, int) and problem.state_count <= MAX_ENUMERATED_STATES:
        transition, _, observation = tabulate(problem)
        for table in (transition, *([] if observation is None else [observation])):
            is_valid = (table >= MIN_PROBABILITY).all() and _is_close(table.sum(axis=2), 1)
            message = "chance: got table rows that are not probabilities, expected sums of 1"
            yield require(is_valid, message)


def check_table_rows(problem: Problem, s: Array, a: Array) -> CheckResults:
    """Yield checks that the tables' rows for these turns are sums over the listed outcomes.

    Terminal states are left out if states are not hidden: the tables make them absorbing, and
    `check_terminal_states` checks them.
    """
    included = ~problem.terminal(s) | problem.partially_observable
    s, a = s[included], a[included]
    tables = tabulate(problem)
    p, outcomes = enumerate_outcomes(problem, s, a)
    joint = np.ravel_multi_index(tuple(a.T), problem.action_counts)
    rewards = (p[:, :, None] * outcomes.rewards).sum(axis=1)
    state_indices = problem.state_indices(s)
    message = "resolve_events: got rewards that differ from the tables, expected the same"
    is_close = _is_close(tables.rewards[state_indices, joint], rewards)
    yield require(is_close, message)
    for row, transition in enumerate(tables.transition[state_indices, joint]):
        expected = np.bincount(problem.state_indices(outcomes.state[row]), p[row], len(transition))
        message = "resolve_events: got next states that differ from the tables, expected the same"
        yield require(_is_close(transition, expected), message)


def check_tabulation(problem: Problem, turns: SampledTurns) -> CheckResults:
    """Yield checks of the tables of a problem with few states, on the first sampled turns."""
    count = problem.state_count
    has_few_states = isinstance(count, int) and count <= MAX_ENUMERATED_STATES
    if has_few_states and all(problem.action_counts):
        s = turns.s[:MAX_LISTED_TURNS]
        a = random_joint_actions(problem, s, WALK_LENGTH, len(s))
        yield from check_table_rows(problem, s, a)


def check_belief_update(problem: Problem, turns: SampledTurns) -> CheckResults:
    """Yield checks that an overridden `joint_belief_update` agrees with the listed outcomes."""
    is_inherited = type(problem).joint_belief_update is Problem.joint_belief_update
    if is_inherited or not isinstance(problem.state_count, int):
        return
    state_indices = problem.state_indices(turns.s[:: max(len(turns.s) // 29, 1)])
    belief = np.bincount(state_indices, minlength=problem.state_count) / len(state_indices)
    for joint_action, observations in _iter_partial_knowledge(problem, turns.a[0]):
        updated = problem.joint_belief_update(belief, joint_action, observations)
        expected = Problem.joint_belief_update(problem, belief, joint_action, observations)
        got = "joint_belief_update: got a belief that differs from the enumerated outcomes"
        yield require(_is_close(updated, expected), f"{got}, expected the same")


def _iter_partial_knowledge(
    problem: Problem, a: Array
) -> Iterator[tuple[list[int | None], list[int | None]]]:
    """Yield joint actions and joint observations of a turn, with None for unknown parts.

    First come one agent's action with its first observation, its last, and none; then all actions.
    """
    unknown: list[int | None] = [None] * len(problem.agents)
    for seat, observation_count in enumerate(problem.observation_counts):
        joint_action = unknown.copy()
        joint_action[seat] = int(a[seat])
        for observation in (0, observation_count - 1):
            joint_observation = unknown.copy()
            joint_observation[seat] = observation
            yield joint_action, joint_observation
        yield joint_action, unknown
    yield [int(action) for action in a], unknown


def check_extreme_uniforms(problem: Problem, turns: SampledTurns) -> CheckResults:
    """Yield checks that the least and the greatest uniform give outcomes that are possible."""
    for row in (0, 1, 100, 101):
        row_slice = slice(row, row + 1)
        s, a, u = turns.s[row_slice], turns.a[row_slice], turns.u[row_slice]
        if len(s) and has_finite_outcomes(problem.chance(s, a)):
            p, outcomes = enumerate_outcomes(problem, s, a)
            state = problem.step(s, a, u).state[0]
            is_equal = outcomes.state[0][p[0] > 0] == state
            is_possible = is_equal.reshape(len(is_equal), -1).all(axis=1).any()
            got = f"chance: got {problem.format_state(state)!r}, which has probability 0"
            yield require(is_possible, f"{got}, expected a possible state")


INVARIANTS: tuple[Callable[[Problem, SampledTurns], CheckResults], ...] = (
    check_sampling,
    check_state_index,
    lambda problem, turns: check_legal_actions(problem, turns.s),
    check_action_labels,
    check_probabilities,
    check_tabulation,
    check_belief_update,
    check_extreme_uniforms,
)
