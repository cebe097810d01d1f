"""Checks that a user-defined problem can be played: its attributes, its arrays and one turn."""

import inspect
import math
from collections import Counter
from collections.abc import Callable
from dataclasses import fields
from functools import cached_property, partial
from typing import cast

import numpy as np

from dmplay.core import table_checks
from dmplay.core.arrays import Array
from dmplay.core.chance import (
    Categorical,
    Chance,
    DiscreteUniform,
    Normal,
    Uniform,
    sample_chance_events,
)
from dmplay.core.problem import ContinuousStates, Outcome, Problem, StatePart, StateParts
from dmplay.core.spaces import Interval, Labels, RealVector, TextLine, normalize_label
from dmplay.core.state_grid import GridAxis, StateGrid
from dmplay.core.tabular import Tabular
from dmplay.core.text import format_count
from dmplay.core.violation import (
    CheckResult,
    CheckResults,
    check_real_array,
    expect,
    has_shape,
    make_violation,
    require,
)
from dmplay.errors import BadParameter

TRIED_ROWS = 2  # rows of the turn that is tried
MAX_LINE_CHARACTERS = 1000  # maximum characters of a name, or of a state in one line
MAX_TEXT_CHARACTERS = 20_000  # maximum characters of an observation that is text
MAX_COUNT = 2**63 - 1  # maximum number of states, and of turns
FORBIDDEN_LABEL_CHARACTERS = ",;#"  # characters that a typed action cannot contain
# commands of a game, which a typed word means unless an action has its name
RESERVED_WORDS = frozenset({
    "act", "agent", "agents", "assume", "auto", "belief", "branch", "exit", "export", "guide",
    "help", "hint", "info", "keys", "learn", "legal", "list", "load", "look", "new", "play", "plot",
    "policy", "quit", "records", "redo", "replay", "reroll", "restart", "resume", "review", "save",
    "screen", "seat", "seed", "set", "solve", "state", "step", "transcript", "undo", "value",
    "values", "watch", "whatif", "why",
})  # fmt: skip


def check_playable(name: str, problem: Problem) -> None:
    """Raise BadParameter if an attribute, an array or the first turn of a problem is invalid."""
    results = (result for stage in CHECK_STAGES for check in stage for result in check(problem))
    for result in results:
        if not result.ok:
            violation = make_violation(type(problem), result.attribute, result.message)
            raise BadParameter(violation.format_with_name(name))


def _check_member_kinds(problem: Problem) -> CheckResults:
    """Yield checks that methods of Problem are still methods, and values are not methods."""
    for name, member in vars(Problem).items():
        is_value = isinstance(member, property | cached_property)
        if name.startswith("_") or not (is_value or inspect.isfunction(member)):
            continue
        if is_value:
            is_method = inspect.isfunction(getattr(type(problem), name))
            message = f"{name}: got a method, expected a value; put @property above it"
            yield CheckResult(not is_method, name, message, independent=True)
        elif not callable(value := getattr(problem, name)):
            message = f"{name}: got {_describe_array(value)}, expected a method"
            yield CheckResult(False, name, message, independent=True)
        elif getattr(type(problem), name) is not member:
            yield _check_arguments(name, value, member)


def _check_arguments(name: str, method: Callable[..., object], member: object) -> CheckResult:
    """Return the result of the check that a method takes the arguments of the one of Problem."""
    expected = [*inspect.signature(cast("Callable[..., object]", member)).parameters]
    try:
        signature = inspect.signature(method)
    except ValueError:  # of a function in C
        return CheckResult(True, name, "")
    try:
        signature.bind(*expected[1:])
    except TypeError:
        got = ", ".join(["self", *map(str, signature.parameters.values())])
        return CheckResult(False, name, f"{name}: got ({got}), expected ({', '.join(expected)})")
    return CheckResult(True, name, "")


def _check_agent_names(problem: Problem) -> CheckResults:
    """Yield the check that `agents` is a tuple of distinct names."""
    yield _check_names("agents", problem.agents)


def _check_names(attribute: str, names: object) -> CheckResult:
    """Return the result of the check that an attribute is a tuple of distinct names."""
    expected = f"a tuple of {_describe_expected_names(names)}"
    return expect(_are_distinct_names(names), attribute, names, expected)


def _check_actions(problem: Problem) -> CheckResults:
    """Yield checks that there is a valid action set for each agent."""
    agents, actions = problem.agents, problem.actions
    yield expect(isinstance(actions, tuple), "actions", actions, "(Labels(...),)")
    counts = f"{format_count(len(actions), 'action set')} for {format_count(len(agents), 'agent')}"
    message = f"actions: got {counts}, expected one for each agent"
    yield require(len(actions) == len(agents), message)
    for space in actions:
        if isinstance(space, Interval):
            continue
        expected = f"Labels with {_describe_expected_names(space)}, or an Interval"
        yield expect(_are_distinct_labels(space), "actions", space, expected)
        yield from check_typable_labels("actions", space)


def check_typable_labels(attribute: str, labels: Labels) -> CheckResults:
    """Yield checks that action labels can be typed and cannot be mistaken for something else."""
    for label in labels:
        if label.lower() in RESERVED_WORDS:
            got = f"{attribute}: got {label!r}, which is a command in a game"
            yield CheckResult(False, attribute, f"{got}; expected another name", independent=True)
        is_typable = label == label.strip() and not {*label} & {*FORBIDDEN_LABEL_CHARACTERS}
        characters = f"a name without any of '{FORBIDDEN_LABEL_CHARACTERS}'"
        expected = f"{characters} and without spaces at its start or end"
        yield expect(is_typable, attribute, label, expected, independent=True)
    counts = Counter(map(normalize_label, labels))
    duplicates = [label for label in labels if counts[normalize_label(label)] > 1]
    message = (
        f"{attribute}: got {', '.join(duplicates)}, which are equal when typed "
        "(case is ignored, and _ is read as -); expected distinct names"
    )
    yield CheckResult(not duplicates, attribute, message)


def _check_observations(problem: Problem) -> CheckResults:
    """Yield checks that the observation spaces are valid and all of one kind."""
    agents, spaces = problem.agents, problem.observations
    is_valid = isinstance(spaces, tuple) and all(
        _are_distinct_labels(space) or _is_observation_space(space) for space in spaces
    )
    is_valid = is_valid and len(spaces) in (0, len(agents))
    expected = "Labels, RealVector or TextLine for each agent, or ()"
    yield expect(is_valid, "observations", spaces, expected)
    kinds = {(type(space), space.shape) for space in spaces}
    yield expect(len(kinds) <= 1, "observations", spaces, "the same kind for all agents")


def _check_spaces(problem: Problem) -> CheckResults:
    """Yield checks of the state names, the horizon, the states, the discount and the bounds."""
    if isinstance(problem, Tabular):
        yield _check_names("state_names", problem.state_names)
    horizon, states, discount = problem.horizon, problem.state_count, problem.discount
    is_valid = horizon is None or _is_count(horizon)
    yield expect(is_valid, "horizon", horizon, "a whole number of turns, 1 or more, or None")
    is_rule, expected = problem.is_finite_horizon, "False, or True and a horizon"
    is_valid = is_rule is False or (is_rule is True and horizon is not None)
    yield expect(is_valid, "is_finite_horizon", is_rule, expected, independent=True)
    is_valid = isinstance(states, ContinuousStates) or states == math.inf or _is_count(states)
    expected = "a number of states, math.inf or ContinuousStates(...)"
    yield expect(is_valid, "state_count", states, expected)
    is_valid = type(discount) in (int, float) and 0 <= discount <= 1
    yield expect(is_valid, "discount", discount, "a number from 0 to 1", independent=True)
    yield from _check_bounds(problem)
    yield from _check_state_grid(problem)


def _check_state_grid(problem: Problem) -> CheckResults:
    """Yield a check that the grid has an axis for each number of a state, and ascending points."""
    grid = problem.state_grid
    is_valid = grid is None or (isinstance(grid, StateGrid) and _grid_fits_states(grid, problem))
    message = (
        f"state_grid: got a {type(grid).__name__}, expected a StateGrid with a GridAxis for each "
        "number of a state, each with an array of ascending points; x and y are two of the axes"
    )
    yield CheckResult(is_valid, "state_grid", message, independent=True)


def _grid_fits_states(grid: StateGrid, problem: Problem) -> bool:
    """Return whether a grid has an axis for each number of a state, each of ascending points."""
    axes: object = grid.axes
    if not isinstance(axes, tuple) or problem.state_count != ContinuousStates(len(axes)):
        return False
    has_map = grid.x != grid.y and {grid.x, grid.y} <= {*range(len(axes))}
    return has_map and all(
        isinstance(axis, GridAxis) and _are_ascending(axis.points) for axis in axes
    )


def _are_ascending(points: object) -> bool:
    """Return whether grid points are an array of at least two ascending numbers."""
    if not isinstance(points, np.ndarray) or points.ndim != 1 or points.dtype.kind not in "if":
        return False
    return len(points) > 1 and bool((points[1:] > points[:-1]).all())


def _check_bounds(problem: Problem) -> CheckResults:
    """Yield checks that declared bounds are pairs of a lower and an upper one."""
    for name in ("reward_bounds", "return_bounds", "state_bounds"):
        bounds = getattr(problem, name)
        is_valid = bounds is None or (
            isinstance(bounds, tuple) and len(bounds) == 2 and bool(np.less_equal(*bounds).all())
        )
        yield expect(is_valid, name, bounds, "a pair (lower, upper), or None", independent=True)


def _check_parameters(problem: Problem) -> CheckResults:
    """Yield checks that parameters can be written into a transcript and read again."""
    expected = "expected a number, a text, True or False, or a list"
    for name in (parameter.name for parameter in fields(problem) if parameter.repr):
        value = getattr(problem, name)
        is_valid = isinstance(value, bool | int | float | str | tuple | list)
        message = f"{name}: got {type(value).__name__}, {expected}"
        yield CheckResult(is_valid, name, message, independent=True)


def _check_start(problem: Problem) -> CheckResults:
    """Yield checks of sampled start states."""
    chances = problem.initial_chance(TRIED_ROWS)
    yield from _check_chances("initial_chance", chances)
    s = problem.initial_states(TRIED_ROWS, _sample_median_events(chances))
    expected = f"an array with one state for each of {TRIED_ROWS} rows"
    yield expect(_has_row_per_trial(s), "initial_states", s, expected)
    is_valid = problem.state_count != 1 or (s.shape == (TRIED_ROWS,) and not np.any(s))
    message = (
        "state_count: got 1, expected the number of states, because initial_states "
        f"returns {_describe_array(s)}; use ContinuousStates(n) for real numbers"
    )
    yield require(is_valid, message)
    if isinstance(problem.state_count, ContinuousStates):
        shape = (TRIED_ROWS, problem.state_count.dimensions)
        expected = f"expected real numbers of shape {shape}, to match state_count"
        message = f"initial_states: got {_describe_array(s)}, {expected}"
        yield require(s.shape == shape and s.dtype.kind == "f", message)
    yield from _check_state_indices(problem, "initial_states", s)
    text = problem.format_state(s[0])
    expected = f"a line of at most {MAX_LINE_CHARACTERS} characters"
    yield expect(_is_one_line(text), "format_state", text, expected)
    yield from check_parsed_state(problem, s[0], text)


def _check_state_parts(problem: Problem) -> CheckResults:
    """Yield checks that parts of a hidden state give the index of a label for each state."""
    seats = range(len(problem.agents)) if problem.partially_observable else ()
    for parts in (problem.state_parts(seat) for seat in seats):
        expected = "StateParts with a name of all parts and a list of StatePart, or None"
        is_valid = isinstance(parts, StateParts) and isinstance(parts.parts, list | tuple)
        yield expect(parts is None or is_valid, "state_parts", parts, expected)
        for part in parts.parts if parts else ():
            expected = "a StatePart with a list of labels and an array of their indices"
            is_valid = isinstance(part, StatePart) and isinstance(part.labels, list | tuple)
            yield expect(is_valid, "state_parts", part, expected)
            indices, last = part.value_of_state, len(part.labels) - 1
            is_valid = (
                isinstance(indices, np.ndarray)
                and indices.shape == (problem.state_count,)
                and indices.dtype.kind in "iu"
            )
            expected = f"whole numbers of shape {(problem.state_count,)}, one for each state"
            yield expect(is_valid, "state_parts", indices, expected)
            is_valid = bool(((indices >= 0) & (indices <= last)).all())
            expected = f"0 to {last}, the indices of its labels"
            yield expect(is_valid, "state_parts", indices, expected)


def _check_state_indices(problem: Problem, attribute: str, s: Array) -> CheckResults:
    """Yield checks that state indices are whole numbers below the number of states."""
    if isinstance(problem.state_count, int) and len(s):
        indices, last = problem.state_indices(s), problem.state_count - 1
        expected = "whole numbers, because state_count is finite"
        yield expect(indices.dtype.kind in "iu", attribute, s, expected)
        out_of_range = [index for index in (indices.min(), indices.max()) if not 0 <= index <= last]
        state = [*out_of_range, 0][0]
        message = f"{attribute}: got state {state}, expected 0 to {last}, to match state_count"
        if not last:
            cause = f"because {attribute} returns state {state}"
            message = f"state_count: got 1, expected the number of states, {cause}"
        yield require(not out_of_range, message)


def check_parsed_state(problem: Problem, s: Array, text: str) -> CheckResults:
    """Yield a check that the text of a state is parsed without loss."""
    parsed = np.asarray(problem.parse_state(text))

    def describe_difference() -> str:
        """Return the message about a text that is parsed as another state."""
        expected = f"expected {s.tolist()}, for which format_state returns this text"
        return f"parse_state: got {parsed.tolist()} from {text!r}, {expected}"

    is_equal = parsed.shape == s.shape and bool(np.all(parsed == s))
    yield CheckResult(is_equal, "parse_state", describe_difference)


def check_legal_actions(problem: Problem, s: Array) -> CheckResults:
    """Yield a check that each agent has a legal action unless the game is over."""
    legal = problem.legal_actions_mask(s)
    if legal is not None:
        has_action = np.all(np.any(legal, axis=2), axis=1)
        stuck = ~has_action & ~problem.terminal(s)
        message = (
            f"legal_actions_mask: got no legal action in {format_first_state(problem, s, stuck)!r}"
            ", expected at least one legal action for each agent, or a terminal state"
        )
        yield require(not stuck.any(), message)


def format_first_state(problem: Problem, s: Array, selected: Array) -> str:
    """Return the first selected state as text, '' if none is selected."""
    return problem.format_state(s[np.flatnonzero(selected)[0]]) if selected.any() else ""


def _check_first_turn(problem: Problem) -> CheckResults:
    """Yield checks of a first turn: terminal states, legal actions, chances and the outcome."""
    events = _sample_median_events(problem.initial_chance(TRIED_ROWS))
    s = problem.initial_states(TRIED_ROWS, events)
    is_over, legal = problem.terminal(s), problem.legal_actions_mask(s)
    is_valid = _has_row_per_trial(is_over) and is_over.dtype == bool and is_over.ndim == 1
    yield expect(is_valid, "terminal", is_over, f"a Boolean array of shape {(TRIED_ROWS,)}")
    shape = (TRIED_ROWS, len(problem.agents), max(problem.action_counts))
    is_valid = legal is None or (has_shape(legal, shape) and legal.dtype == bool)
    expected = f"None, or a Boolean array of shape {shape}"
    yield expect(is_valid, "legal_actions_mask", legal, expected)
    yield from check_legal_actions(problem, s)
    a = np.tile([space.candidate_actions()[0] for space in problem.actions], (TRIED_ROWS, 1))
    if legal is not None:
        a = legal.argmax(axis=2)
    chances = problem.chance(s, a)
    yield from _check_chances("chance", chances)
    outcome = problem.resolve_events(s, a, _sample_median_events(chances))
    is_valid = isinstance(outcome, tuple) and len(outcome) == len(Outcome._fields)
    yield expect(is_valid, "resolve_events", outcome, "Outcome(state, rewards, observations)")
    yield from check_outcome(problem, s, outcome)


def check_outcome(problem: Problem, s: Array, outcome: Outcome) -> CheckResults:
    """Yield checks that an outcome has the shapes and ranges that the problem declares."""
    next_states, rewards, observations = outcome
    is_valid = has_shape(next_states, s.shape) and next_states.dtype.kind == s.dtype.kind
    expected = f"an array of shape {s.shape} with the number type of initial_states"
    yield _check_array(is_valid, "states", next_states, expected)
    yield from _check_state_indices(problem, "resolve_events", next_states)
    reward_shape = len(s), len(problem.agents)
    yield from check_real_array("resolve_events: rewards", "resolve_events", rewards, reward_shape)
    if problem.shared_reward:
        expected = "expected the same for all agents, because shared_reward is True"
        message = f"resolve_events: got different rewards, {expected}"
        yield require((rewards == rewards[:, :1]).all(), message)
    yield from _check_within_bounds("reward_bounds", problem.reward_bounds, rewards)
    yield from _check_within_bounds("state_bounds", problem.state_bounds, next_states)
    if not problem.partially_observable:
        has_type = has_shape(observations, s.shape) and observations.dtype == next_states.dtype
        is_valid = has_type and (observations == next_states).all()
        expected = "the next states, because no states are hidden"
        yield _check_array(is_valid, "observations", observations, expected)
        return
    yield from _check_observation_array(problem, reward_shape, observations)


def _check_within_bounds(
    name: str, bounds: tuple[Array, Array] | tuple[float, float] | None, values: Array
) -> CheckResults:
    """Yield a check that numbers are within the bounds that the problem declares."""
    if bounds is not None:
        low, high = bounds
        is_within = bool(((values >= low) & (values <= high)).all())
        got = f"{values.min():g} to {values.max():g}"
        message = f"resolve_events: got {got}, expected numbers within {name}, {low} to {high}"
        yield require(is_within, message)


def _check_observation_array(
    problem: Problem, leading_shape: tuple[int, int], observations: Array
) -> CheckResults:
    """Yield checks that observations have the declared kind, shape and range."""
    kind = problem.observations[0]
    shape = (*leading_shape, *kind.shape)
    dtype_kinds, description = {
        Labels: ("iu", "whole numbers"),
        RealVector: ("f", "real numbers"),
    }.get(type(kind), ("U", "an array of text"))
    is_valid = has_shape(observations, shape) and observations.dtype.kind in dtype_kinds
    yield _check_array(is_valid, "observations", observations, f"{description} of shape {shape}")
    if isinstance(kind, RealVector):
        is_valid = bool(np.isfinite(observations).all())
        yield _check_array(is_valid, "observations", observations, "finite numbers")
    elif isinstance(kind, Labels):
        is_valid = bool(((observations >= 0) & (observations < problem.observation_counts)).all())
        yield _check_array(
            is_valid, "observations", observations, "indices of the observation labels"
        )
    else:
        invalid = [str(text) for text in observations.flat if not _is_printable_text(text)]
        length = f"of at most {MAX_TEXT_CHARACTERS:,} characters"
        message = f"resolve_events: got the observation {invalid[0]!r:.99}" if invalid else ""
        message = f"{message}, expected printable text, not empty, {length}"
        yield CheckResult(not invalid, "resolve_events", message)


def _check_array(holds: object, name: str, array: Array, expected: str) -> CheckResult:
    """Return the result of a check of an array of an outcome."""
    message = partial("resolve_events: got the {} {!r}, expected {}".format, name, array, expected)
    return CheckResult(bool(holds), "resolve_events", message)


# each stage relies on those before it
CHECK_STAGES: tuple[tuple[Callable[[Problem], CheckResults], ...], ...] = (
    (_check_member_kinds,),
    (_check_agent_names,),
    (_check_actions, _check_observations, _check_spaces, _check_parameters),
    (table_checks.check_tables,),
    table_checks.TABLE_CHECKS,
    (_check_start, _check_state_parts),
    (_check_first_turn,),
)


def _are_distinct_names(value: object) -> bool:
    """Return whether a value is a non-empty sequence of distinct names, each of one line."""
    if not isinstance(value, tuple | list) or not all(map(_is_one_line, value)):
        return False
    return 0 < len(value) == len({*value})


def _describe_expected_names(value: object) -> str:
    """Return the names that a sequence should contain, by the first mistake in it."""
    for name in value if isinstance(value, tuple | list) else ():
        if isinstance(name, str):
            for character in name:
                if not character.isprintable():
                    return f"names of printable characters, without U+{ord(character):04X}"
            if len(name.strip()) > MAX_LINE_CHARACTERS:
                return f"names of at most {MAX_LINE_CHARACTERS} characters"
    return "distinct names"


def _is_one_line(value: object) -> bool:
    """Return whether a value is printable text of one line."""
    if not isinstance(value, str) or not value.isprintable():
        return False
    return 0 < len(value.strip()) <= MAX_LINE_CHARACTERS


def _is_printable_text(value: object) -> bool:
    """Return whether a value is printable text, of one line or several."""
    if not isinstance(value, str) or not value.replace("\n", "").isprintable():
        return False
    return 0 < len(value.strip()) <= MAX_TEXT_CHARACTERS


def _are_distinct_labels(value: object) -> bool:
    """Return whether a value is Labels with distinct names."""
    return isinstance(value, Labels) and _are_distinct_names(value)


def _is_observation_space(value: object) -> bool:
    """Return whether a value is an observation space of text or of real numbers."""
    return isinstance(value, TextLine) or (isinstance(value, RealVector) and _is_count(value.size))


def _is_count(value: object) -> bool:
    """Return whether a value is a whole number from 1 to MAX_COUNT."""
    return type(value) is int and 0 < value <= MAX_COUNT


def _has_row_per_trial(value: object) -> bool:
    """Return whether a value is an array with TRIED_ROWS rows."""
    return isinstance(value, np.ndarray) and value.shape[:1] == (TRIED_ROWS,)


def _describe_array(value: object) -> str:
    """Return the dtype and shape of an array as text, or the repr of another value."""
    if not isinstance(value, np.ndarray):
        return repr(value)
    return f"{value.dtype} of shape {value.shape}"


def _check_chances(attribute: str, value: object) -> CheckResults:
    """Yield checks that a value is a tuple of distributions from which can be sampled."""
    types = Categorical | DiscreteUniform | Uniform | Normal
    is_tuple = isinstance(value, tuple) and all(isinstance(chance, types) for chance in value)
    expected = "a tuple of distributions, such as (DiscreteUniform(...),), or ()"
    yield expect(is_tuple, attribute, value, expected)
    assert isinstance(value, tuple)
    for chance in value:
        if isinstance(chance, Categorical):
            yield from _check_categorical(attribute, np.asarray(chance.cumulative))
        expected = "a distribution that can be sampled"
        yield expect(_can_be_sampled(chance), attribute, chance, expected)


def _check_categorical(attribute: str, cumulative: Array) -> CheckResults:
    """Yield checks of an array of cumulative probabilities, with a row each or one for all."""
    is_valid = (
        cumulative.ndim == 2
        and len(cumulative) in (1, TRIED_ROWS)
        and cumulative.dtype.kind in "fiu"
    )
    expected = "expected rows of cumulative probabilities"
    message = f"{attribute}: got a Categorical of {_describe_array(cumulative)}, {expected}"
    yield CheckResult(is_valid, attribute, message)
    p = np.diff(cumulative, prepend=0, append=1)
    message = f"{attribute}: got probabilities {p.min():g} to {p.max():g}, expected 0 to 1"
    yield CheckResult(bool((p >= -table_checks.PROBABILITY_TOLERANCE).all()), attribute, message)


def _can_be_sampled(chance: object) -> bool:
    """Return whether the numbers of a distribution are valid, so that it can be sampled."""
    match chance:
        case DiscreteUniform(n, max_n):
            return bool(((np.asarray(n) >= 1) & (np.asarray(n) <= max_n)).all())
        case Uniform(low, high):
            is_finite = np.isfinite(low).all() and np.isfinite(high).all()
            return bool(is_finite and np.less_equal(low, high).all())
        case Normal():
            return all(np.isfinite(array).all() for array in vars(chance).values())
    return True


def _sample_median_events(chances: tuple[Chance, ...]) -> tuple[Array, ...]:
    """Return the events that uniforms of 0.5 give, in the middle of their range."""
    count = sum(chance.uniform_count for chance in chances)
    return sample_chance_events(chances, np.full((TRIED_ROWS, count), 0.5))
