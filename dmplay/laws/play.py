"""What every problem keeps: laws over turns that random play comes to, which tests ask of ours.

A law tells, fact by fact, what holds; `held` turns what does not into breaches.
"""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from dmplay.chance import Array, sample_all
from dmplay.core import Labels, Problem, enumerate_outcomes
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.laws.breach import CheckResult, CheckResults, Violation, make_violation
from dmplay.laws.samples import (
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
from dmplay.laws.sound import check_outcome, check_typable_labels
from dmplay.places import describe_error_location
from dmplay.tabular import tabulate

MAX_LISTED_TURNS = 24  # turns whose outcomes are listed
ROUNDING_TOLERANCE = 1e-12  # how near numbers are that differ by rounding alone
MIN_PROBABILITY = -1e-15  # a probability that rounding took below 0
RESPONSIBLE_METHODS = (
    "initial_states",
    "resolve_events",
    "resolve_events",
    "resolve_events",
    "terminal",
    "legal_actions_mask",
    "state_indices",
)  # what says each part


def _is_close(first: Array | float, second: Array | float) -> bool:
    """Equal but for rounding."""
    return np.allclose(first, second, rtol=1e-7, atol=ROUNDING_TOLERANCE)


def find_violations(owner: type, invariant: Callable[[], CheckResults]) -> Iterator[Violation]:
    """What does not hold of a law, up to the first on which the rest depends; what fails too."""
    try:
        for fact in invariant():
            if not fact.ok:
                yield make_violation(owner, fact.attribute, fact.message)
                if not fact.independent:
                    return
    except BudgetExceeded:  # which is no fault
        return
    except BadParameter as error:
        placed = str(error)[:1] in "./"  # else of what nature or the game made of a move
        yield (
            Violation("", str(error))
            if placed
            else make_violation(owner, "resolve_events", f"resolve_events: {error}")
        )
    except Exception as error:  # of code that is not ours
        told = describe_error_location(error)
        if not told:
            raise
        where, _, what = told.partition(": ")
        cure = "; copy it first" if "read-only" in what else ""
        yield Violation(where, what + cure)


def evaluate_batch(problem: Problem, turns: SampledTurns) -> tuple[Array, ...]:
    """All that a problem computes from a batch, each with the row as its first axis."""
    rows = len(turns.s)
    legal = problem.legal_actions_mask(turns.s)
    counted = isinstance(problem.state_count, int)
    return (
        problem.sample_initial_states(turns.start_uniforms),
        *problem.step(turns.s, turns.a, turns.u),
        problem.terminal(turns.s),
        np.ones(rows, bool) if legal is None else legal,
        problem.state_indices(turns.s) if counted else np.zeros(rows, int),
    )


def check_row_independence(
    problem: Problem, subset: SampledTurns, expected: tuple[Array, ...]
) -> CheckResults:
    """A row comes out the same, to the last bit, as beside other rows."""
    for said, one, other in zip(
        RESPONSIBLE_METHODS, expected, evaluate_batch(problem, subset), strict=True
    ):
        told = partial(
            _describe_difference, said, one, other, "; expected a row to depend on itself alone"
        )
        yield CheckResult(is_bitwise_equal(one, other), said, told)


def check_determinism(
    problem: Problem, turns: SampledTurns, expected: tuple[Array, ...]
) -> CheckResults:
    """The same draws give the same outcome, and nothing is written into."""
    for said, one, other in zip(
        RESPONSIBLE_METHODS, expected, evaluate_batch(problem, turns), strict=True
    ):
        told = partial(
            _describe_difference, said, one, other, " from the same draws; expected the same again"
        )
        yield CheckResult(is_bitwise_equal(one, other), said, told)


def _describe_difference(attribute: str, first: Array, second: Array, expectation: str) -> str:
    """What is said of the first row in which two arrays differ."""
    if first.shape != second.shape:
        return f"{attribute}: got shape {second.shape} beside {first.shape}{expectation}"
    rows = np.flatnonzero((first != second).reshape(len(first), -1).any(axis=1))
    pair = (
        f"{second[rows[0]].tolist()} beside {first[rows[0]].tolist()}" if len(rows) else "the same"
    )
    return f"{attribute}: got {pair}{expectation}"


def check_sampling(problem: Problem, turns: SampledTurns) -> CheckResults:
    """A start is where the sampled events place it, a step the move of the sampled events."""
    rows = len(turns.s)
    placed = problem.initial_states(
        rows, sample_all(problem.initial_chance(rows), turns.start_uniforms)
    )
    told = "sample_initial_states: got another state than initial_states gives for the same draws"
    yield CheckResult(
        is_bitwise_equal(placed, problem.sample_initial_states(turns.start_uniforms)),
        "sample_initial_states",
        told,
    )
    events = sample_all(problem.chance(turns.s, turns.a), turns.u)
    both = zip(
        problem.resolve_events(turns.s, turns.a, events),
        problem.step(turns.s, turns.a, turns.u),
        strict=True,
    )
    told = "step: got another outcome than resolve_events gives for the same draws"
    yield CheckResult(all(is_bitwise_equal(*pair) for pair in both), "step", told)


def check_shapes(problem: Problem, turns: SampledTurns) -> CheckResults:
    """Outcomes have the shapes and ranges that the problem states, and take as many draws."""
    many = count_uniforms(problem, turns.s, turns.a)
    told = f"chance: got {many} draws, expected {problem.uniform_counts.step} as in the first turn"
    yield CheckResult(many == problem.uniform_counts.step, "chance", told)
    yield from check_outcome(problem, turns.s, problem.step(turns.s, turns.a, turns.u))


def check_state_text(problem: Problem, states: Array) -> CheckResults:
    """A state is written in one line and read again without loss."""
    for s in states:
        text = problem.format_state(s)
        told = f"format_state: got {text!r}, expected one line without blanks around it"
        yield CheckResult(
            text == text.strip() and len(text.splitlines()) == 1, "format_state", told
        )
        again = np.asarray(problem.parse_state(text))
        told = f"parse_state: got {again.tolist()} from {text!r}, expected {s.tolist()}"
        yield CheckResult(again.shape == s.shape and np.array_equal(again, s), "parse_state", told)
        twice = problem.format_state(again)
        told = f"format_state: got {twice!r} after parse_state, expected {text!r}"
        yield CheckResult(twice == text, "format_state", told)


def check_state_index(problem: Problem, turns: SampledTurns) -> CheckResults:
    """The place of a state in the list of all is its index."""
    if not isinstance(problem.state_count, int):
        return
    states = problem.enumerate_states()
    told = f"enumerate_states: got {len(states)} states, expected {problem.state_count}, as state_count says"
    yield CheckResult(len(states) == problem.state_count, "enumerate_states", told)
    places = problem.state_indices(states)
    told = f"state_indices: got {places.tolist()[:9]}, expected 0 to {len(states) - 1} in order"
    yield CheckResult(np.array_equal(places, np.arange(len(states))), "state_indices", told)
    told = "enumerate_states: got other states than those of this index in play"
    yield CheckResult(
        np.array_equal(states[problem.state_indices(turns.s)], turns.s), "enumerate_states", told
    )


def check_terminal_states(problem: Problem, states: Array) -> CheckResults:
    """A terminal state stays, and pays nothing."""
    ends = make_arrays_readonly(states[problem.terminal(states)])[0]
    for turn in range(4 if len(ends) else 0):
        a = random_joint_actions(problem, None, turn, len(ends))
        moved, rewards, _ = step_turn(problem, ends, a, turn)
        left = (moved != ends).reshape(len(ends), -1).any(axis=1)
        which = problem.format_state(ends[np.flatnonzero(left)[0]]) if left.any() else ""
        told = (
            f"resolve_events: got another state after the terminal {which!r}, expected it to stay"
        )
        yield CheckResult(not left.any(), "resolve_events", told)
        told = (
            f"resolve_events: got {rewards.min():g} to {rewards.max():g} after the end, expected 0"
        )
        yield CheckResult(bool((rewards == 0).all()), "resolve_events", told)
        still = problem.terminal(moved)
        yield CheckResult(
            bool(still.all()), "terminal", "terminal: got false for a state that was over"
        )


def check_legal_actions(problem: Problem, turns: SampledTurns) -> CheckResults:
    """Wherever the game goes on, each agent can do something."""
    legal = problem.legal_actions_mask(turns.s)
    if legal is not None:
        free = np.all(np.any(legal, axis=2), axis=1)
        stuck = ~free & ~problem.terminal(turns.s)
        which = problem.format_state(turns.s[np.flatnonzero(stuck)[0]]) if stuck.any() else ""
        told = f"legal_actions_mask: got no action in {which!r}, expected one at least, or a terminal state"
        yield CheckResult(not stuck.any(), "legal_actions_mask", told)


def check_action_labels(problem: Problem, turns: SampledTurns) -> CheckResults:
    """What actions are called in a state are names, each another, that can be typed."""
    for s in turns.s[:MAX_LISTED_TURNS]:
        for called, known in zip(problem.action_labels(s) or (), problem.actions, strict=False):
            told = f"action_labels: got {called!r}, expected Labels, a name for each of {known!r}"
            holds = isinstance(called, Labels) and len(called) == len(known.labels)
            yield CheckResult(holds, "action_labels", told)
            yield from check_typable_labels("action_labels", called)


def check_probabilities(problem: Problem, turns: SampledTurns) -> CheckResults:
    """Probabilities are none below 0, and sum to 1."""
    s, a = turns.s[:MAX_LISTED_TURNS], turns.a[:MAX_LISTED_TURNS]
    if has_finite_outcomes(problem.chance(s, a)):
        p = enumerate_outcomes(problem, s, a).probabilities
        told = f"chance: got a probability of {p.min():g}, expected none below 0"
        yield CheckResult(bool((p >= MIN_PROBABILITY).all()), "chance", told)
        told = f"chance: got probabilities that sum to {p.sum(axis=1).max():g}, expected 1"
        yield CheckResult(_is_close(p.sum(axis=1), 1), "chance", told)
    if isinstance(problem.state_count, int) and problem.state_count <= MAX_ENUMERATED_STATES:
        transition, _, observation = tabulate(problem)
        for table in (transition, *([] if observation is None else [observation])):
            holds = (table >= MIN_PROBABILITY).all() and _is_close(table.sum(axis=2), 1)
            told = "chance: got tables whose rows are no probabilities, expected them to sum to 1"
            yield CheckResult(bool(holds), "chance", told)


def check_table_rows(problem: Problem, s: Array, a: Array) -> CheckResults:
    """The rows of the tables for these turns are sums over the listed outcomes.

    Of what is over another law asks: in tables it stays, whatever its moves say.
    """
    going = ~problem.terminal(s) | problem.partially_observable
    s, a = s[going], a[going]
    tables = tabulate(problem)
    p, outcome = enumerate_outcomes(problem, s, a)
    joint = np.ravel_multi_index(tuple(a.T), problem.action_counts)
    rewards = (p[:, :, None] * outcome.rewards).sum(axis=1)
    here = problem.state_indices(s)
    told = "resolve_events: got other rewards than the tables have, expected the same"
    holds = _is_close(tables.rewards[here, joint], rewards)
    yield CheckResult(holds, "resolve_events", told)
    for row, transition in enumerate(tables.transition[here, joint]):
        reached = np.bincount(problem.state_indices(outcome.state[row]), p[row], len(transition))
        told = "resolve_events: got other next states than the tables have, expected the same"
        yield CheckResult(_is_close(transition, reached), "resolve_events", told)


def check_tabulation(problem: Problem, turns: SampledTurns) -> CheckResults:
    """Tables are what the listed outcomes amount to."""
    counted = isinstance(problem.state_count, int) and problem.state_count <= MAX_ENUMERATED_STATES
    if counted and all(problem.action_counts):
        s = turns.s[:MAX_LISTED_TURNS]
        yield from check_table_rows(
            problem, s, random_joint_actions(problem, s, WALK_LENGTH, len(s))
        )


def check_belief_update(problem: Problem, turns: SampledTurns) -> CheckResults:
    """A belief is carried as the listed outcomes say."""
    if type(problem).joint_belief_update is Problem.joint_belief_update or not isinstance(
        problem.state_count, int
    ):
        return
    some = problem.state_indices(turns.s[:: max(len(turns.s) // 29, 1)])
    belief = np.bincount(some, minlength=problem.state_count) / len(some)
    for actions_, seen in _iter_partial_knowledge(problem, turns.a[0]):
        told = problem.joint_belief_update(belief, actions_, seen)
        right = Problem.joint_belief_update(problem, belief, actions_, seen)
        what = "joint_belief_update: got another belief than the listed outcomes give, expected the same"
        yield CheckResult(_is_close(told, right), "joint_belief_update", what)


def _iter_partial_knowledge(
    problem: Problem, a: Array
) -> Iterator[tuple[list[int | None], list[int | None]]]:
    """What one agent may know of a turn, and what all know who tell each other what they did."""
    nothing: list[int | None] = [None] * len(problem.agents)
    for seat, many in enumerate(problem.observation_counts):
        did = nothing.copy()
        did[seat] = int(a[seat])
        for kind in (0, many - 1):
            seen = nothing.copy()
            seen[seat] = kind
            yield did, seen
        yield did, nothing
    yield [int(one) for one in a], nothing


def check_extreme_uniforms(problem: Problem, turns: SampledTurns) -> CheckResults:
    """The least and the greatest draw give outcomes that can happen."""
    for row in (0, 1, 100, 101):
        one = slice(row, row + 1)
        s, a, u = turns.s[one], turns.a[one], turns.u[one]
        if len(s) and has_finite_outcomes(problem.chance(s, a)):
            p, possible = enumerate_outcomes(problem, s, a)
            got = problem.step(s, a, u).state[0]
            among = possible.state[0][p[0] > 0]
            held = bool((among == got).reshape(len(among), -1).all(axis=1).any())
            told = (
                f"chance: got {problem.format_state(got)!r} from a draw, expected what can happen"
            )
            yield CheckResult(held, "chance", told)


INVARIANTS: tuple[Callable[[Problem, SampledTurns], CheckResults], ...] = (
    check_sampling, check_state_index, check_legal_actions, check_action_labels, check_probabilities, check_tabulation, check_belief_update, check_extreme_uniforms,
)  # fmt: skip
