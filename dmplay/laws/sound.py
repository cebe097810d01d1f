"""What must hold of a problem that somebody brings before it is played: facts, arrays, a turn."""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import fields

import numpy as np

from dmplay.chance import Array, Categorical, Chance, DiscreteUniform, Normal, Uniform, sample_all
from dmplay.core import (
    ContinuousStates,
    Interval,
    Labels,
    Outcome,
    Problem,
    RealVector,
    TextLine,
    normalize_label,
)
from dmplay.describe import format_count
from dmplay.errors import BadParameter
from dmplay.laws import arrays
from dmplay.laws.breach import (
    CheckResult,
    CheckResults,
    check_real_array,
    has_shape,
    make_violation,
)
from dmplay.tabular import Tabular

TRIED_ROWS = 2  # of the turn that is tried
MAX_LINE_CHARACTERS = 1000  # characters of a name, or of a state in a line
MAX_TEXT_CHARACTERS = 20_000  # characters of an observation
MAX_COUNT = 2**63 - 1  # states, turns
FORBIDDEN_LABEL_CHARACTERS = ",;#"  # characters that a typed action cannot have
RESERVED_WORDS = frozenset({  # what a typed word does in a game, unless an action has its name
    "act", "agent", "agents", "auto", "belief", "branch", "exit", "export", "figure", "guide",
    "help", "hint", "info", "keys", "legal", "list", "load", "look", "new", "play", "policy",
    "quit", "records", "redo", "replay", "reroll", "restart", "resume", "review", "save", "screen",
    "seed", "set", "solve", "state", "step", "transcript", "undo", "value", "values", "whatif",
})  # fmt: skip


def check_playable(name: str, problem: Problem) -> None:
    """Raises BadParameter where a fact, an array or the first turn of a problem cannot be."""
    every = (fact for stage in CHECK_STAGES for facts in stage for fact in facts(problem))
    for fact in every:
        if not fact.ok:
            raise BadParameter(
                make_violation(type(problem), fact.attribute, fact.message).format_with_name(name)
            )


def _check_agents(problem: Problem) -> CheckResults:
    agents = problem.agents
    told = f"agents: got {agents!r}, expected names, each another"
    yield CheckResult(_are_distinct_names(agents), "agents", told)


def _check_actions(problem: Problem) -> CheckResults:
    agents, actions = problem.agents, problem.actions
    holds = isinstance(actions, tuple)
    yield CheckResult(holds, "actions", f"actions: got {actions!r}, expected (Labels(...),)")
    told = (
        f"got {format_count(len(actions), 'action set')} for {format_count(len(agents), 'agent')}"
    )
    yield CheckResult(len(actions) == len(agents), "actions", f"actions: {told}, expected one each")
    for known in actions:
        told = f"actions: got {known!r}, expected Labels of names, each another, or an Interval"
        yield CheckResult(
            isinstance(known, Interval) or _are_distinct_labels(known), "actions", told
        )
        yield from (
            _check_interval(known)
            if isinstance(known, Interval)
            else check_typable_labels("actions", known)
        )


def _check_interval(interval: Interval) -> CheckResults:
    low, high = interval.low, interval.high
    holds = math.isfinite(low) and math.isfinite(high) and low < high
    yield CheckResult(
        holds, "actions", f"actions: got {interval!r}, expected two numbers, the lower first"
    )


def check_typable_labels(attribute: str, labels: Labels) -> CheckResults:
    """Labels of actions can be typed, and mean nothing else."""
    for label in labels:
        if label.lower() in RESERVED_WORDS:
            told = (
                f"{attribute}: got {label!r}, which is a command in a game; expected another name"
            )
            yield CheckResult(False, attribute, told, independent=True)
        if label != label.strip() or any(sign in label for sign in FORBIDDEN_LABEL_CHARACTERS):
            told = f"{attribute}: got {label!r}, expected no '{FORBIDDEN_LABEL_CHARACTERS}' in it and no blanks around it"
            yield CheckResult(False, attribute, told, independent=True)
    typed = Counter(map(normalize_label, labels))
    alike = [label for label in labels if typed[normalize_label(label)] > 1]
    told = f"{attribute}: got {', '.join(alike)}, which are typed alike; expected each another"
    yield CheckResult(not alike, attribute, told)


def _check_observations(problem: Problem) -> CheckResults:
    agents, seen = problem.agents, problem.observations
    known = isinstance(seen, tuple) and all(
        _are_distinct_labels(one) or _is_observation_space(one) for one in seen
    )
    told = (
        f"observations: got {seen!r}, expected Labels, RealVector or TextLine for each agent, or ()"
    )
    yield CheckResult(known and len(seen) in (0, len(agents)), "observations", told)
    kinds = {(type(one), one.shape) for one in seen}
    told = f"observations: got {seen!r}, expected the same kind for all agents"
    yield CheckResult(len(kinds) <= 1, "observations", told)


def _check_spaces(problem: Problem) -> CheckResults:
    if isinstance(problem, Tabular):
        told = f"state_names: got {problem.state_names!r}, expected names, each another"
        yield CheckResult(_are_distinct_names(problem.state_names), "state_names", told)
    turns, states, discount = problem.horizon, problem.state_count, problem.discount
    told = f"horizon: got {turns!r}, expected a number of turns, or None"
    yield CheckResult(turns is None or _is_count(turns), "horizon", told)
    holds = isinstance(states, ContinuousStates) or states == math.inf or _is_count(states)
    told = f"state_count: got {states!r}, expected how many, math.inf or ContinuousStates(...)"
    yield CheckResult(holds, "state_count", told)
    holds = type(discount) in (int, float) and 0 <= discount <= 1
    yield CheckResult(
        holds,
        "discount",
        f"discount: got {discount!r}, expected a number from 0 to 1",
        independent=True,
    )
    yield from _check_bounds(problem)


def _check_bounds(problem: Problem) -> CheckResults:
    """Bounds are a lower and an upper one."""
    for name in ("reward_bounds", "state_bounds"):
        told = getattr(problem, name)
        holds = told is None or (
            isinstance(told, tuple) and len(told) == 2 and bool(np.less_equal(*told).all())
        )
        said = f"{name}: got {told!r}, expected the lower and the upper, or None"
        yield CheckResult(holds, name, said, independent=True)


def _check_parameters(problem: Problem) -> CheckResults:
    """Parameters can be written into a transcript and read again."""
    for one in (one for one in fields(problem) if one.repr):
        value = getattr(problem, one.name)
        holds = isinstance(value, bool | int | float | str | tuple | list)
        told = f"{one.name}: got {type(value).__name__}, expected a number, text, flag or list"
        yield CheckResult(holds, one.name, told, independent=True)


def _check_start(problem: Problem) -> CheckResults:
    """A start, tried."""
    opening = problem.initial_chance(TRIED_ROWS)
    yield from _check_chances("initial_chance", opening)
    s = problem.initial_states(TRIED_ROWS, _sample_median_events(opening))
    row = f"expected an array, a state for each of {TRIED_ROWS} rows"
    yield CheckResult(
        _has_tried_rows(s), "initial_states", lambda: f"initial_states: got {s!r}, {row}"
    )
    holds = problem.state_count != 1 or (s.shape == (TRIED_ROWS,) and not np.any(s))
    told = f"state_count: got 1, expected how many, as initial_states gives {_describe_array(s)}; ContinuousStates(n) for reals"
    yield CheckResult(holds, "state_count", told)
    if isinstance(problem.state_count, ContinuousStates):
        shape = (TRIED_ROWS, problem.state_count.dimensions)
        told = f"initial_states: got {_describe_array(s)}, expected reals of shape {shape}, as state_count says"
        yield CheckResult(s.shape == shape and s.dtype.kind == "f", "initial_states", told)
    yield from _check_state_indices(problem, "initial_states", s)
    yield from _check_state_text(problem, s)


def _check_state_indices(problem: Problem, attribute: str, s: Array) -> CheckResults:
    """States that are counted are of those that there are."""
    if isinstance(problem.state_count, int) and len(s):
        places, last = problem.state_indices(s), problem.state_count - 1
        whole = "expected whole numbers, where states are counted"
        yield CheckResult(
            places.dtype.kind in "iu", attribute, lambda: f"{attribute}: got {s!r}, {whole}"
        )
        far = [one for one in (places.min(), places.max()) if not 0 <= one <= last]
        told = f"{attribute}: got state {[*far, 0][0]}, expected 0 to {last}, as state_count says"
        alone = f"state_count: got 1, expected how many, as {attribute} gives state {[*far, 0][0]}"
        yield CheckResult(not far, attribute if last else "state_count", told if last else alone)


def _check_state_text(problem: Problem, s: Array) -> CheckResults:
    """A state is written and read without loss."""
    told = problem.format_state(s[0])
    what = (
        f"format_state: got {told!r}, expected a line of at most {MAX_LINE_CHARACTERS} characters"
    )
    yield CheckResult(_is_one_line(told), "format_state", what)
    again = np.asarray(problem.parse_state(told))
    yield CheckResult(
        again.shape == s[0].shape and bool(np.all(again == s[0])),
        "parse_state",
        lambda: (
            f"parse_state: got {again!r} from {told!r}, expected {s[0]!r}, which format_state wrote"
        ),
    )


def _check_first_turn(problem: Problem) -> CheckResults:
    """A turn, tried."""
    s = problem.initial_states(
        TRIED_ROWS, _sample_median_events(problem.initial_chance(TRIED_ROWS))
    )
    over, legal = problem.terminal(s), problem.legal_actions_mask(s)
    holds = _has_tried_rows(over) and over.dtype == bool and over.ndim == 1
    each = f"expected true or false for each of {TRIED_ROWS} rows"
    yield CheckResult(holds, "terminal", lambda: f"terminal: got {over!r}, {each}")
    shape = (TRIED_ROWS, len(problem.agents), max(problem.action_counts))
    holds = legal is None or (
        has_shape(legal, shape) and legal.dtype == bool and _has_legal_actions(legal, over)
    )
    able = f"expected None, or one action at least, of shape {shape}"
    yield CheckResult(
        holds, "legal_actions_mask", lambda: f"legal_actions_mask: got {legal!r}, {able}"
    )
    a = np.tile([known.candidate_actions()[0] for known in problem.actions], (TRIED_ROWS, 1))
    if legal is not None:
        a = legal.argmax(axis=2)
    chances = problem.chance(s, a)
    yield from _check_chances("chance", chances)
    outcome = problem.resolve_events(s, a, _sample_median_events(chances))
    yield CheckResult(
        isinstance(outcome, tuple) and len(outcome) == len(Outcome._fields),
        "resolve_events",
        lambda: f"resolve_events: got {outcome!r}, expected Outcome(state, rewards, observations)",
    )
    yield from check_outcome(problem, s, outcome)


def check_outcome(problem: Problem, s: Array, outcome: Outcome) -> CheckResults:
    """What a turn brought about has the shapes and ranges that the problem states."""
    moved, rewards, seen = outcome
    holds = has_shape(moved, s.shape) and moved.dtype.kind == s.dtype.kind
    as_placed = f"expected them of shape {s.shape}, as from initial_states"
    yield CheckResult(
        holds, "resolve_events", lambda: f"resolve_events: got the states {moved!r}, {as_placed}"
    )
    yield from _check_state_indices(problem, "resolve_events", moved)
    rows = len(s), len(problem.agents)
    yield from check_real_array("resolve_events: rewards", "resolve_events", rewards, rows)
    if problem.shared_reward:
        told = "resolve_events: got rewards that differ, expected the same for all, as shared_reward says"
        yield CheckResult(bool((rewards == rewards[:, :1]).all()), "resolve_events", told)
    yield from _check_within_bounds("reward_bounds", problem.reward_bounds, rewards)
    yield from _check_within_bounds("state_bounds", problem.state_bounds, moved)
    if not problem.partially_observable:
        holds = has_shape(seen, s.shape) and seen.dtype == moved.dtype and (seen == moved).all()
        new = "expected the new states"
        yield CheckResult(
            bool(holds), "resolve_events", lambda: f"resolve_events: got {seen!r} to be seen, {new}"
        )
        return
    yield from _check_observation_array(problem, rows, seen)


def _check_within_bounds(
    name: str, bounds: tuple[Array, Array] | tuple[float, float] | None, values: Array
) -> CheckResults:
    """Numbers stay within the bounds that the problem declares."""
    if bounds is not None:
        low, high = bounds
        told = f"resolve_events: got {values.min():g} to {values.max():g}, expected {name}, {low} to {high}"
        yield CheckResult(bool(((values >= low) & (values <= high)).all()), "resolve_events", told)


def _check_observation_array(
    problem: Problem, leading_shape: tuple[int, int], observations: Array
) -> CheckResults:
    """Observations are of the kind that is named."""
    kind = problem.observations[0]
    shape = (*leading_shape, *kind.shape)
    letters, what = {Labels: ("iu", "whole numbers"), RealVector: ("f", "reals")}.get(
        type(kind), ("U", "an array of text")
    )
    holds = has_shape(observations, shape) and observations.dtype.kind in letters
    yield _observation_result(holds, observations, f"expected {what} of shape {shape}")
    if isinstance(kind, RealVector):
        yield _observation_result(
            bool(np.isfinite(observations).all()), observations, "expected none infinite or NaN"
        )
    elif isinstance(kind, Labels):
        holds = bool(((observations >= 0) & (observations < problem.observation_counts)).all())
        yield _observation_result(holds, observations, "expected the numbers of their labels")
    else:
        wrong = [str(one) for one in observations.flat if not _is_printable_text(one)]
        told = f"expected printable text, not empty, of at most {MAX_TEXT_CHARACTERS:,} characters"
        got = f"resolve_events: got the observation {wrong[0]!r:.99}" if wrong else ""
        yield CheckResult(not wrong, "resolve_events", f"{got}, {told}")


def _observation_result(holds: bool, observations: Array, expected: str) -> CheckResult:
    return CheckResult(
        holds,
        "resolve_events",
        lambda: f"resolve_events: got the observations {observations!r}, {expected}",
    )


CHECK_STAGES: tuple[
    tuple[Callable[[Problem], CheckResults], ...], ...
] = (  # each rests on those before
    (_check_agents,),
    (_check_actions, _check_observations, _check_spaces, _check_parameters),
    (arrays.check_tables,),
    (
        arrays.check_transition,
        arrays.check_rewards,
        arrays.check_observations,
        arrays.check_start_belief,
    ),
    (_check_start,),
    (_check_first_turn,),
)


def _are_distinct_names(value: object) -> bool:
    """Whether these are names that can be written in a line, each another."""
    return (
        isinstance(value, tuple | list)
        and bool(value)
        and all(_is_one_line(one) for one in value)
        and len(set(value)) == len(value)
    )


def _is_one_line(value: object) -> bool:
    """Whether this is a text that can be written in a line."""
    return (
        isinstance(value, str)
        and value.isprintable()
        and 0 < len(value.strip()) <= MAX_LINE_CHARACTERS
    )


def _is_printable_text(value: object) -> bool:
    """Whether this can be shown, in one line or several."""
    rows = value.split("\n") if isinstance(value, str) else []
    printable = all(row.isprintable() for row in rows)
    return printable and isinstance(value, str) and 0 < len(value.strip()) <= MAX_TEXT_CHARACTERS


def _are_distinct_labels(value: object) -> bool:
    return isinstance(value, Labels) and _are_distinct_names(value)


def _is_observation_space(value: object) -> bool:
    return isinstance(value, TextLine) or (isinstance(value, RealVector) and _is_count(value.size))


def _is_count(value: object) -> bool:
    return type(value) is int and 0 < value <= MAX_COUNT


def _has_tried_rows(value: object) -> bool:
    return isinstance(value, np.ndarray) and value.shape[:1] == (TRIED_ROWS,)


def _describe_array(value: object) -> str:
    """What an array is, in a few words."""
    if not isinstance(value, np.ndarray):
        return repr(value)
    return f"{value.dtype} of shape {value.shape}"


def _has_legal_actions(legal: Array, over: Array) -> bool:
    """Whether each agent can do something wherever the game goes on."""
    able = np.all(np.any(legal, axis=2), axis=1)
    return bool(np.all(able | over))


def _check_chances(attribute: str, value: object) -> CheckResults:
    """What nature draws."""
    kinds = Categorical | DiscreteUniform | Uniform | Normal
    holds = isinstance(value, tuple) and all(isinstance(chance, kinds) for chance in value)
    yield CheckResult(
        holds, attribute, f"{attribute}: got {value!r}, expected (DiscreteUniform(...),), a tuple, or ()"
    )
    assert isinstance(value, tuple)
    for chance in value:
        if isinstance(chance, Categorical):
            yield from _check_categorical(attribute, np.asarray(chance.cumulative))
        got = f"{attribute}: got {chance!r}, expected what can be drawn"
        yield CheckResult(_can_be_sampled(chance), attribute, got)


def _check_categorical(attribute: str, cumulative: Array) -> CheckResults:
    """Cumulative probabilities, a row for each, or one for all."""
    holds = (
        cumulative.ndim == 2
        and len(cumulative) in (1, TRIED_ROWS)
        and cumulative.dtype.kind in "fiu"
    )
    got = f"{attribute}: got a Categorical of {_describe_array(cumulative)}, expected rows of cumulative probabilities"
    yield CheckResult(holds, attribute, got)
    p = np.diff(cumulative, prepend=0, append=1)
    got = f"{attribute}: got probabilities {p.min():g} to {p.max():g}, expected 0 to 1"
    yield CheckResult(bool((p >= -arrays.PROBABILITY_TOLERANCE).all()), attribute, got)


def _can_be_sampled(chance: object) -> bool:
    """Whether the numbers of this are such that nature can draw it."""
    match chance:
        case DiscreteUniform(n, most):
            return bool(((np.asarray(n) >= 1) & (np.asarray(n) <= most)).all())
        case Uniform(low, high):
            return bool(np.isfinite(low).all() and np.isfinite(high).all())
        case Normal():
            return all(np.isfinite(one).all() for one in vars(chance).values())
    return True


def _sample_median_events(chances: tuple[Chance, ...]) -> tuple[Array, ...]:
    """What comes of them in the middle of the dice."""
    return sample_all(
        chances, np.full((TRIED_ROWS, sum(chance.uniform_count for chance in chances)), 0.5)
    )
