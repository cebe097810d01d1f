"""What must hold of a problem that somebody brings before it is played: facts, arrays, a turn."""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import fields

import numpy as np

from dmplay.chance import Array, Categorical, Chance, Normal, Pick, Span, sample
from dmplay.core import Continuous, Interval, Labels, Numbers, Outcome, Problem, Texts, plain
from dmplay.describe import counted
from dmplay.errors import BadParameter
from dmplay.laws import arrays
from dmplay.laws.breach import Fact, Facts, breach, reals, shaped
from dmplay.tabular import Tabular

ROWS = 2  # of the turn that is tried
LONGEST = 1000  # characters of a name, or of a state in a line
LONGEST_TEXT = 20_000  # characters of an observation
MOST = 2**63 - 1  # states, turns
UNTYPED = ",;#"  # characters that a typed action cannot have
COMMANDS = frozenset({  # what a typed word does in a game, unless an action has its name
    "act", "agent", "agents", "auto", "belief", "branch", "exit", "export", "figure", "guide",
    "help", "hint", "info", "keys", "legal", "list", "load", "look", "new", "play", "policy",
    "quit", "records", "redo", "replay", "reroll", "restart", "resume", "review", "save", "screen",
    "seed", "set", "solve", "state", "step", "transcript", "undo", "value", "values", "whatif",
})  # fmt: skip


def sound(name: str, problem: Problem) -> None:
    """Raises BadParameter where a fact, an array or the first turn of a problem cannot be."""
    every = (fact for stage in STAGES for facts in stage for fact in facts(problem))
    for fact in every:
        if not fact.holds:
            raise BadParameter(breach(type(problem), fact.said, fact.told).of(name))


def _agents(problem: Problem) -> Facts:
    agents = problem.agents
    told = f"agents: got {agents!r}, expected names, each another"
    yield Fact(_names(agents), "agents", told)


def _actions(problem: Problem) -> Facts:
    agents, actions = problem.agents, problem.actions
    holds = isinstance(actions, tuple)
    yield Fact(holds, "actions", f"actions: got {actions!r}, expected (Labels(...),)")
    told = f"got {counted(len(actions), 'action set')} for {counted(len(agents), 'agent')}"
    yield Fact(len(actions) == len(agents), "actions", f"actions: {told}, expected one each")
    for known in actions:
        told = f"actions: got {known!r}, expected Labels of names, each another, or an Interval"
        yield Fact(isinstance(known, Interval) or _labels(known), "actions", told)
        yield from _span(known) if isinstance(known, Interval) else typable("actions", known)


def _span(known: Interval) -> Facts:
    low, high = known.low, known.high
    holds = math.isfinite(low) and math.isfinite(high) and low < high
    yield Fact(holds, "actions", f"actions: got {known!r}, expected two numbers, the lower first")


def typable(said: str, labels: Labels) -> Facts:
    """Labels of actions can be typed, and mean nothing else."""
    for label in labels:
        if label.lower() in COMMANDS:
            told = f"{said}: got {label!r}, which is a command in a game; expected another name"
            yield Fact(False, said, told, alone=True)
        if label != label.strip() or any(sign in label for sign in UNTYPED):
            told = f"{said}: got {label!r}, expected no '{UNTYPED}' in it and no blanks around it"
            yield Fact(False, said, told, alone=True)
    typed = Counter(map(plain, labels))
    alike = [label for label in labels if typed[plain(label)] > 1]
    told = f"{said}: got {', '.join(alike)}, which are typed alike; expected each another"
    yield Fact(not alike, said, told)


def _observations(problem: Problem) -> Facts:
    agents, seen = problem.agents, problem.observations
    known = isinstance(seen, tuple) and all(_labels(one) or _sight(one) for one in seen)
    told = f"observations: got {seen!r}, expected Labels, Numbers or Texts for each agent, or ()"
    yield Fact(known and len(seen) in (0, len(agents)), "observations", told)
    kinds = {(type(one), one.shape) for one in seen}
    told = f"observations: got {seen!r}, expected the same kind for all agents"
    yield Fact(len(kinds) <= 1, "observations", told)


def _spaces(problem: Problem) -> Facts:
    if isinstance(problem, Tabular):
        told = f"names: got {problem.names!r}, expected names, each another"
        yield Fact(_names(problem.names), "names", told)
    turns, states, discount = problem.horizon, problem.states, problem.discount
    told = f"horizon: got {turns!r}, expected a number of turns, or None"
    yield Fact(turns is None or _count(turns), "horizon", told)
    holds = isinstance(states, Continuous) or states == math.inf or _count(states)
    told = f"states: got {states!r}, expected how many, math.inf or Continuous(...)"
    yield Fact(holds, "states", told)
    holds = type(discount) in (int, float) and 0 <= discount <= 1
    yield Fact(
        holds, "discount", f"discount: got {discount!r}, expected a number from 0 to 1", alone=True
    )
    yield from _bounds(problem)


def _bounds(problem: Problem) -> Facts:
    """Bounds are a lower and an upper one."""
    for name in ("reward_bounds", "state_bounds"):
        told = getattr(problem, name)
        holds = told is None or (
            isinstance(told, tuple) and len(told) == 2 and bool(np.less_equal(*told).all())
        )
        said = f"{name}: got {told!r}, expected the lower and the upper, or None"
        yield Fact(holds, name, said, alone=True)


def _parameters(problem: Problem) -> Facts:
    """Parameters can be written into a transcript and read again."""
    for one in (one for one in fields(problem) if one.repr):
        value = getattr(problem, one.name)
        holds = isinstance(value, bool | int | float | str | tuple | list)
        told = f"{one.name}: got {type(value).__name__}, expected a number, text, flag or list"
        yield Fact(holds, one.name, told, alone=True)


def _start(problem: Problem) -> Facts:
    """A start, tried."""
    opening = problem.opening(ROWS)
    yield from _chances("opening", opening)
    s = problem.place(ROWS, _events(opening))
    row = f"expected an array, a state for each of {ROWS} rows"
    yield Fact(_rows(s), "place", lambda: f"place: got {s!r}, {row}")
    holds = problem.states != 1 or (s.shape == (ROWS,) and not np.any(s))
    told = f"states: got 1, expected how many, as place gives {_shape(s)}; Continuous(n) for reals"
    yield Fact(holds, "states", told)
    if isinstance(problem.states, Continuous):
        shape = (ROWS, problem.states.dimensions)
        told = f"place: got {_shape(s)}, expected reals of shape {shape}, as states says"
        yield Fact(s.shape == shape and s.dtype.kind == "f", "place", told)
    yield from _counted(problem, "place", s)
    yield from _notes(problem, s)


def _counted(problem: Problem, said: str, s: Array) -> Facts:
    """States that are counted are of those that there are."""
    if isinstance(problem.states, int) and len(s):
        places, last = problem.index(s), problem.states - 1
        whole = "expected whole numbers, where states are counted"
        yield Fact(places.dtype.kind in "iu", said, lambda: f"{said}: got {s!r}, {whole}")
        far = [one for one in (places.min(), places.max()) if not 0 <= one <= last]
        told = f"{said}: got state {[*far, 0][0]}, expected 0 to {last}, as states says"
        alone = f"states: got 1, expected how many, as {said} gives state {[*far, 0][0]}"
        yield Fact(not far, said if last else "states", told if last else alone)


def _notes(problem: Problem, s: Array) -> Facts:
    """A state is written and read without loss."""
    told = problem.notation(s[0])
    what = f"notation: got {told!r}, expected a line of at most {LONGEST} characters"
    yield Fact(_line(told), "notation", what)
    again = np.asarray(problem.parse(told))
    yield Fact(
        again.shape == s[0].shape and bool(np.all(again == s[0])),
        "parse",
        lambda: f"parse: got {again!r} from {told!r}, expected {s[0]!r}, which notation wrote",
    )


def _turn(problem: Problem) -> Facts:
    """A turn, tried."""
    s = problem.place(ROWS, _events(problem.opening(ROWS)))
    over, legal = problem.terminal(s), problem.legal(s)
    holds = _rows(over) and over.dtype == bool and over.ndim == 1
    each = f"expected true or false for each of {ROWS} rows"
    yield Fact(holds, "terminal", lambda: f"terminal: got {over!r}, {each}")
    shape = (ROWS, len(problem.agents), max(problem.action_counts))
    holds = legal is None or (shaped(legal, shape) and legal.dtype == bool and _able(legal, over))
    able = f"expected None, or one action at least, of shape {shape}"
    yield Fact(holds, "legal", lambda: f"legal: got {legal!r}, {able}")
    a = np.tile([known.grid()[0] for known in problem.actions], (ROWS, 1))
    if legal is not None:
        a = legal.argmax(axis=2)
    chances = problem.chance(s, a)
    yield from _chances("chance", chances)
    outcome = problem.move(s, a, _events(chances))
    yield Fact(
        isinstance(outcome, tuple) and len(outcome) == len(Outcome._fields),
        "move",
        lambda: f"move: got {outcome!r}, expected Outcome(state, rewards, observations)",
    )
    yield from outcomes(problem, s, outcome)


def outcomes(problem: Problem, s: Array, outcome: Outcome) -> Facts:
    """What a turn brought about has the shapes and ranges that the problem states."""
    moved, rewards, seen = outcome
    holds = shaped(moved, s.shape) and moved.dtype.kind == s.dtype.kind
    as_placed = f"expected them of shape {s.shape}, as from place"
    yield Fact(holds, "move", lambda: f"move: got the states {moved!r}, {as_placed}")
    yield from _counted(problem, "move", moved)
    rows = len(s), len(problem.agents)
    yield from reals("move: rewards", "move", rewards, rows)
    if problem.shared_reward:
        told = "move: got rewards that differ, expected the same for all, as shared_reward says"
        yield Fact(bool((rewards == rewards[:, :1]).all()), "move", told)
    yield from _within("reward_bounds", problem.reward_bounds, rewards)
    yield from _within("state_bounds", problem.state_bounds, moved)
    if not problem.hidden:
        holds = shaped(seen, s.shape) and seen.dtype == moved.dtype and (seen == moved).all()
        new = "expected the new states"
        yield Fact(bool(holds), "move", lambda: f"move: got {seen!r} to be seen, {new}")
        return
    yield from _observed(problem, rows, seen)


def _within(
    name: str, bounds: tuple[Array, Array] | tuple[float, float] | None, got: Array
) -> Facts:
    """Numbers stay within the bounds that the problem declares."""
    if bounds is not None:
        low, high = bounds
        told = f"move: got {got.min():g} to {got.max():g}, expected {name}, {low} to {high}"
        yield Fact(bool(((got >= low) & (got <= high)).all()), "move", told)


def _observed(problem: Problem, rows: tuple[int, int], seen: Array) -> Facts:
    """Observations are of the kind that is named."""
    kind = problem.observations[0]
    shape = (*rows, *kind.shape)
    letters, what = {Labels: ("iu", "whole numbers"), Numbers: ("f", "reals")}.get(
        type(kind), ("U", "an array of text")
    )
    holds = shaped(seen, shape) and seen.dtype.kind in letters
    yield _seen(holds, seen, f"expected {what} of shape {shape}")
    if isinstance(kind, Numbers):
        yield _seen(bool(np.isfinite(seen).all()), seen, "expected none infinite or NaN")
    elif isinstance(kind, Labels):
        holds = bool(((seen >= 0) & (seen < problem.observation_counts)).all())
        yield _seen(holds, seen, "expected the numbers of their labels")
    else:
        wrong = [str(one) for one in seen.flat if not _text(one)]
        told = f"expected printable text, not empty, of at most {LONGEST_TEXT:,} characters"
        got = f"move: got the observation {wrong[0]!r:.99}" if wrong else ""
        yield Fact(not wrong, "move", f"{got}, {told}")


def _seen(holds: bool, seen: Array, expected: str) -> Fact:
    return Fact(holds, "move", lambda: f"move: got the observations {seen!r}, {expected}")


STAGES: tuple[tuple[Callable[[Problem], Facts], ...], ...] = (  # each rests on those before
    (_agents,),
    (_actions, _observations, _spaces, _parameters),
    (arrays.tables,),
    (arrays.transition, arrays.rewards, arrays.observations, arrays.start),
    (_start,),
    (_turn,),
)


def _names(told: object) -> bool:
    """Whether these are names that can be written in a line, each another."""
    return (
        isinstance(told, tuple | list)
        and bool(told)
        and all(_line(one) for one in told)
        and len(set(told)) == len(told)
    )


def _line(told: object) -> bool:
    """Whether this is a text that can be written in a line."""
    return isinstance(told, str) and told.isprintable() and 0 < len(told.strip()) <= LONGEST


def _text(told: object) -> bool:
    """Whether this can be shown, in one line or several."""
    rows = told.split("\n") if isinstance(told, str) else []
    printable = all(row.isprintable() for row in rows)
    return printable and isinstance(told, str) and 0 < len(told.strip()) <= LONGEST_TEXT


def _labels(told: object) -> bool:
    return isinstance(told, Labels) and _names(told)


def _sight(told: object) -> bool:
    return isinstance(told, Texts) or (isinstance(told, Numbers) and _count(told.many))


def _count(told: object) -> bool:
    return type(told) is int and 0 < told <= MOST


def _rows(told: object) -> bool:
    return isinstance(told, np.ndarray) and told.shape[:1] == (ROWS,)


def _shape(told: object) -> str:
    """What an array is, in a few words."""
    if not isinstance(told, np.ndarray):
        return repr(told)
    return f"{told.dtype} of shape {told.shape}"


def _able(legal: Array, over: Array) -> bool:
    """Whether each agent can do something wherever the game goes on."""
    able = np.all(np.any(legal, axis=2), axis=1)
    return bool(np.all(able | over))


def _chances(said: str, told: object) -> Facts:
    """What nature draws."""
    kinds = Categorical | Pick | Span | Normal
    holds = isinstance(told, tuple) and all(isinstance(chance, kinds) for chance in told)
    yield Fact(holds, said, f"{said}: got {told!r}, expected (Pick(...),), a tuple, or ()")
    assert isinstance(told, tuple)
    for chance in told:
        if isinstance(chance, Categorical):
            yield from _categorical(said, np.asarray(chance.cumulative))
        got = f"{said}: got {chance!r}, expected what can be drawn"
        yield Fact(_drawn(chance), said, got)


def _categorical(said: str, edges: Array) -> Facts:
    """Cumulative probabilities, a row for each, or one for all."""
    holds = edges.ndim == 2 and len(edges) in (1, ROWS) and edges.dtype.kind in "fiu"
    got = f"{said}: got a Categorical of {_shape(edges)}, expected rows of cumulative probabilities"
    yield Fact(holds, said, got)
    p = np.diff(edges, prepend=0, append=1)
    got = f"{said}: got probabilities {p.min():g} to {p.max():g}, expected 0 to 1"
    yield Fact(bool((p >= -arrays.CLOSE).all()), said, got)


def _drawn(chance: object) -> bool:
    """Whether the numbers of this are such that nature can draw it."""
    match chance:
        case Pick(n, most):
            return bool(((np.asarray(n) >= 1) & (np.asarray(n) <= most)).all())
        case Span(low, high):
            return bool(np.isfinite(low).all() and np.isfinite(high).all())
        case Normal():
            return all(np.isfinite(one).all() for one in vars(chance).values())
    return True


def _events(chances: tuple[Chance, ...]) -> tuple[Array, ...]:
    """What comes of them in the middle of the dice."""
    return sample(chances, np.full((ROWS, sum(chance.draws for chance in chances)), 0.5))
