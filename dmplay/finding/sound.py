"""What must hold of a problem that somebody brings: said before it is played, in one sentence."""

import math
from collections.abc import Iterator

import numpy as np

from dmplay.chance import Array, Categorical, Chance, Normal, Pick, Span, sample
from dmplay.core import Continuous, Interval, Labels, Outcome, Problem, placed
from dmplay.errors import BadParameter
from dmplay.tabular import Tabular

ROWS = 2  # of the turn that is tried
CLOSE = 1e-6  # how near to 1 probabilities sum

LONGEST = 1000  # characters of a name, or of a state in a line
MOST = 2**63 - 1  # states, turns

Facts = Iterator[tuple[bool, str]]  # whether something holds, and what is said where it does not


def sound(name: str, problem: Problem) -> None:
    """Raises BadParameter where a fact, an array or the first turn of a problem cannot be."""
    for facts in (_facts, _arrays, _turn):
        for holds, what in facts(problem):
            if not holds:
                raise BadParameter(f"{name}: {what}")


def _facts(problem: Problem) -> Facts:
    """What it says of itself."""
    agents, actions, seen = problem.agents, problem.actions, problem.observations
    yield _names(agents), f"agents: got {agents!r}, expected names, each another"
    yield isinstance(actions, tuple), f"actions: got {actions!r}, expected (Labels(...),)"
    told = f"got {len(actions)} action sets for {len(agents)} agents, one each"
    yield len(actions) == len(agents), told
    for known in actions:
        expected = "expected Labels of names, each another, or an Interval"
        yield isinstance(known, Interval) or _labels(known), f"actions: got {known!r}, {expected}"
    holds = isinstance(seen, tuple) and all(map(_labels, seen)) and len(seen) in (0, len(agents))
    yield holds, f"observations: got {seen!r}, expected Labels for each agent, or ()"
    if isinstance(problem, Tabular):
        yield _names(problem.names), f"names: got {problem.names!r}, expected names, each another"
    turns, states, discount = problem.horizon, problem.states, problem.discount
    holds = turns is None or _count(turns)
    yield holds, f"horizon: got {turns!r}, expected a number of turns, or None"
    holds = isinstance(states, Continuous) or states == math.inf or _count(states)
    yield holds, f"states: got {states!r}, expected how many, math.inf or Continuous(...)"
    holds = type(discount) in (int, float) and 0 <= discount <= 1
    yield holds, f"discount: got {discount!r}, expected a number from 0 to 1"


def _arrays(problem: Problem) -> Facts:
    """The arrays of one that is made of them."""
    if not isinstance(problem, Tabular):
        return
    yield all(problem.action_counts), "actions: expected Labels, which are rows of the arrays"
    many, each = len(problem.names), math.prod(problem.action_counts)
    transition, rewards, observation = problem.tables
    yield from _shares("transition", transition, (many, each, many))
    yield from _reals("rewards", rewards, (many, each, len(problem.agents)))
    yield from _shares("start_belief", problem.start_belief, (many,))
    if problem.hidden:
        kinds = math.prod(len(labels) for labels in problem.observations)
        yield from _shares("observation", observation, (each, many, kinds))
    else:
        yield observation is None, "observation: expected None where no observations are named"


def _turn(problem: Problem) -> Facts:
    """A start and a turn of it, tried."""
    opening = problem.opening(ROWS)
    yield _chances(opening), f"opening: got {opening!r}, expected what can be drawn, or ()"
    s = problem.place(ROWS, _events(opening))
    yield _rows(s), f"place: got {s!r}, expected an array, a state for each of {ROWS} rows"
    holds = not isinstance(problem.states, int) or problem.index(s).dtype.kind in "iu"
    yield holds, f"place: got {s!r}, expected whole numbers, where states are counted"
    placed(problem, s)
    over, legal = problem.terminal(s), problem.legal(s)
    holds = _rows(over) and over.dtype == bool and over.ndim == 1
    yield holds, f"terminal: got {over!r}, expected true or false for each of {ROWS} rows"
    shape = (ROWS, len(problem.agents), max(problem.action_counts))
    holds = legal is None or (_shaped(legal, shape) and legal.dtype == bool and _able(legal, over))
    yield holds, f"legal: got {legal!r}, expected None, or one action at least, of shape {shape}"
    told = problem.notation(s[0])
    yield _line(told), f"notation: got {told!r}, expected a line of at most {LONGEST} characters"
    a = np.tile([known.grid()[0] for known in problem.actions], (ROWS, 1))
    if legal is not None:
        a = legal.argmax(axis=2)
    chances = problem.chance(s, a)
    yield _chances(chances), f"chance: got {chances!r}, expected what can be drawn, or ()"
    outcome = problem.move(s, a, _events(chances))
    holds = isinstance(outcome, tuple) and len(outcome) == len(Outcome._fields)
    yield holds, f"move: got {outcome!r}, expected Outcome(state, rewards, observations)"
    yield from _outcome(problem, s, outcome)


def _outcome(problem: Problem, s: Array, outcome: Outcome) -> Facts:
    """What a turn brought about."""
    moved, rewards, seen = outcome
    holds = _shaped(moved, s.shape) and moved.dtype.kind == s.dtype.kind
    yield holds, f"move: got the states {moved!r}, expected them of shape {s.shape}, as from place"
    yield from _reals("move: rewards", rewards, (ROWS, len(problem.agents)))
    if not problem.hidden:
        holds = _shaped(seen, s.shape) and seen.dtype == moved.dtype and (seen == moved).all()
        yield bool(holds), f"move: got {seen!r} to be seen, expected the new states"
        return
    holds = _shaped(seen, (ROWS, len(problem.agents))) and seen.dtype.kind == "i"
    yield holds, f"move: got the observations {seen!r}, expected whole numbers for each row, agent"
    many = [len(labels) for labels in problem.observations]
    holds = bool(((seen >= 0) & (seen < many)).all())
    yield holds, f"move: got the observations {seen!r}, expected the numbers of their labels"


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


def _labels(told: object) -> bool:
    return isinstance(told, Labels) and _names(told)


def _count(told: object) -> bool:
    return type(told) is int and 0 < told <= MOST


def _rows(told: object) -> bool:
    return isinstance(told, np.ndarray) and told.shape[:1] == (ROWS,)


def _shaped(told: object, shape: tuple[int, ...]) -> bool:
    return isinstance(told, np.ndarray) and told.shape == shape


def _able(legal: Array, over: Array) -> bool:
    """Whether each agent can do something wherever the game goes on."""
    able = np.all(np.any(legal, axis=2), axis=1)
    return bool(np.all(able | over))


def _chances(told: object) -> bool:
    return isinstance(told, tuple) and all(map(_drawn, told))


def _drawn(chance: object) -> bool:
    """Whether this is something that nature can draw."""
    match chance:
        case Categorical(cumulative):
            edges = np.asarray(cumulative)
            shaped = edges.ndim == 2 and len(edges) in (1, ROWS) and edges.dtype.kind in "fiu"
            return shaped and bool((np.diff(edges, prepend=0, append=1) >= -CLOSE).all())
        case Pick(n, most):
            return bool(((np.asarray(n) >= 1) & (np.asarray(n) <= most)).all())
        case Span(low, high):
            return bool(np.isfinite(low).all() and np.isfinite(high).all())
        case Normal():
            return all(np.isfinite(one).all() for one in vars(chance).values())
    return False


def _events(chances: tuple[Chance, ...]) -> tuple[Array, ...]:
    """What comes of them in the middle of the dice."""
    return sample(chances, np.full((ROWS, sum(chance.draws for chance in chances)), 0.5))


def _reals(what: str, told: object, shape: tuple[int, ...]) -> Facts:
    """An array of real numbers of a shape."""
    got = f"shape {told.shape}" if isinstance(told, np.ndarray) else repr(told)
    yield _shaped(told, shape), f"{what}: got {got}, expected an array of shape {shape}"
    array = np.asarray(told)
    holds = array.dtype.kind in "fiu" and bool(np.isfinite(array).all())
    yield holds, f"{what}: expected numbers, none infinite and none missing"


def _shares(what: str, told: object, shape: tuple[int, ...]) -> Facts:
    """An array whose rows are probabilities."""
    yield from _reals(what, told, shape)
    array = np.asarray(told)
    sums = array.sum(axis=-1)
    worst = sums.flat[abs(sums - 1).argmax()]
    yield bool(array.min() >= 0), f"{what}: got {array.min():g}, expected no negative probability"
    yield bool(abs(worst - 1) <= CLOSE), f"{what}: got probabilities that sum to {worst:g}, not 1"
