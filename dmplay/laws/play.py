"""What every problem keeps: laws over turns that random play comes to, which tests ask of ours.

A law tells, fact by fact, what holds; `held` turns what does not into breaches.
"""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from dmplay.chance import Array, sample
from dmplay.core import Labels, Problem, exact
from dmplay.errors import BadParameter, TooMuch
from dmplay.laws.breach import Breach, Fact, Facts, breach
from dmplay.laws.samples import FEW, WALK, Turns, actions, after, finite, frozen, same, taken
from dmplay.laws.sound import outcomes, typable
from dmplay.places import blamed
from dmplay.tabular import tabulate

SOME = 24  # turns whose outcomes are listed
CLOSE = 1e-12  # how near numbers are that differ by rounding alone
NONE = -1e-15  # a probability that rounding took below 0
FOUND = ("place", "move", "move", "move", "terminal", "legal", "index")  # what says each part


def _close(one: Array | float, other: Array | float) -> bool:
    """Equal but for rounding."""
    return np.allclose(one, other, rtol=1e-7, atol=CLOSE)


def held(owner: type, law: Callable[[], Facts]) -> Iterator[Breach]:
    """What does not hold of a law, up to the first on which the rest depends; what fails too."""
    try:
        for fact in law():
            if not fact.holds:
                yield breach(owner, fact.said, fact.told)
                if not fact.alone:
                    return
    except TooMuch:  # which is no fault
        return
    except BadParameter as error:
        placed = str(error)[:1] in "./"  # else of what nature or the game made of a move
        yield Breach("", str(error)) if placed else breach(owner, "move", f"move: {error}")
    except Exception as error:  # of code that is not ours
        told = blamed(error)
        if not told:
            raise
        where, _, what = told.partition(": ")
        cure = "; copy it first" if "read-only" in what else ""
        yield Breach(where, what + cure)


def everything(problem: Problem, found: Turns) -> tuple[Array, ...]:
    """All that a problem computes from a batch, each with the row as its first axis."""
    rows = len(found.s)
    legal = problem.legal(found.s)
    counted = isinstance(problem.states, int)
    return (
        problem.start(found.opening),
        *problem.step(found.s, found.a, found.u),
        problem.terminal(found.s),
        np.ones(rows, bool) if legal is None else legal,
        problem.index(found.s) if counted else np.zeros(rows, int),
    )


def alone(problem: Problem, some: Turns, expected: tuple[Array, ...]) -> Facts:
    """A row comes out the same, to the last bit, as beside other rows."""
    for said, one, other in zip(FOUND, expected, everything(problem, some), strict=True):
        told = partial(_differing, said, one, other, "; expected a row to depend on itself alone")
        yield Fact(same(one, other), said, told)


def repeated(problem: Problem, found: Turns, whole: tuple[Array, ...]) -> Facts:
    """The same draws give the same outcome, and nothing is written into."""
    for said, one, other in zip(FOUND, whole, everything(problem, found), strict=True):
        told = partial(
            _differing, said, one, other, " from the same draws; expected the same again"
        )
        yield Fact(same(one, other), said, told)


def _differing(said: str, one: Array, other: Array, expected: str) -> str:
    """What is said of the first row in which two arrays differ."""
    if one.shape != other.shape:
        return f"{said}: got shape {other.shape} beside {one.shape}{expected}"
    rows = np.flatnonzero((one != other).reshape(len(one), -1).any(axis=1))
    pair = f"{other[rows[0]].tolist()} beside {one[rows[0]].tolist()}" if len(rows) else "the same"
    return f"{said}: got {pair}{expected}"


def sampled(problem: Problem, found: Turns) -> Facts:
    """A start is where the sampled events place it, a step the move of the sampled events."""
    rows = len(found.s)
    placed = problem.place(rows, sample(problem.opening(rows), found.opening))
    told = "start: got another state than place gives for the same draws"
    yield Fact(same(placed, problem.start(found.opening)), "start", told)
    events = sample(problem.chance(found.s, found.a), found.u)
    both = zip(
        problem.move(found.s, found.a, events), problem.step(found.s, found.a, found.u), strict=True
    )
    told = "step: got another outcome than move gives for the same draws"
    yield Fact(all(same(*pair) for pair in both), "step", told)


def shaped(problem: Problem, found: Turns) -> Facts:
    """Outcomes have the shapes and ranges that the problem states, and take as many draws."""
    many = taken(problem, found.s, found.a)
    told = f"chance: got {many} draws, expected {problem.draws.step} as in the first turn"
    yield Fact(many == problem.draws.step, "chance", told)
    yield from outcomes(problem, found.s, problem.step(found.s, found.a, found.u))


def written(problem: Problem, states: Array) -> Facts:
    """A state is written in one line and read again without loss."""
    for s in states:
        text = problem.notation(s)
        told = f"notation: got {text!r}, expected one line without blanks around it"
        yield Fact(text == text.strip() and len(text.splitlines()) == 1, "notation", told)
        again = np.asarray(problem.parse(text))
        told = f"parse: got {again.tolist()} from {text!r}, expected {s.tolist()}"
        yield Fact(again.shape == s.shape and np.array_equal(again, s), "parse", told)
        twice = problem.notation(again)
        told = f"notation: got {twice!r} after parse, expected {text!r}"
        yield Fact(twice == text, "notation", told)


def listed(problem: Problem, found: Turns) -> Facts:
    """The place of a state in the list of all is its index."""
    if not isinstance(problem.states, int):
        return
    states = problem.enumerated()
    told = f"enumerated: got {len(states)} states, expected {problem.states}, as states says"
    yield Fact(len(states) == problem.states, "enumerated", told)
    places = problem.index(states)
    told = f"index: got {places.tolist()[:9]}, expected 0 to {len(states) - 1} in order"
    yield Fact(np.array_equal(places, np.arange(len(states))), "index", told)
    told = "enumerated: got other states than those of this index in play"
    yield Fact(np.array_equal(states[problem.index(found.s)], found.s), "enumerated", told)


def absorbing(problem: Problem, states: Array) -> Facts:
    """A terminal state stays, and pays nothing."""
    ends = frozen(states[problem.terminal(states)])[0]
    for turn in range(4 if len(ends) else 0):
        a = actions(problem, None, turn, len(ends))
        moved, rewards, _ = after(problem, ends, a, turn)
        left = (moved != ends).reshape(len(ends), -1).any(axis=1)
        which = problem.notation(ends[np.flatnonzero(left)[0]]) if left.any() else ""
        told = f"move: got another state after the terminal {which!r}, expected it to stay"
        yield Fact(not left.any(), "move", told)
        told = f"move: got {rewards.min():g} to {rewards.max():g} after the end, expected 0"
        yield Fact(bool((rewards == 0).all()), "move", told)
        still = problem.terminal(moved)
        yield Fact(bool(still.all()), "terminal", "terminal: got false for a state that was over")


def able(problem: Problem, found: Turns) -> Facts:
    """Wherever the game goes on, each agent can do something."""
    legal = problem.legal(found.s)
    if legal is not None:
        free = np.all(np.any(legal, axis=2), axis=1)
        stuck = ~free & ~problem.terminal(found.s)
        which = problem.notation(found.s[np.flatnonzero(stuck)[0]]) if stuck.any() else ""
        told = f"legal: got no action in {which!r}, expected one at least, or a terminal state"
        yield Fact(not stuck.any(), "legal", told)


def named(problem: Problem, found: Turns) -> Facts:
    """What actions are called in a state are names, each another, that can be typed."""
    for s in found.s[:SOME]:
        for called, known in zip(problem.called(s) or (), problem.actions, strict=False):
            told = f"called: got {called!r}, expected Labels, a name for each of {known!r}"
            holds = isinstance(called, Labels) and len(called) == len(known.labels)
            yield Fact(holds, "called", told)
            yield from typable("called", called)


def summed(problem: Problem, found: Turns) -> Facts:
    """Probabilities are none below 0, and sum to 1."""
    s, a = found.s[:SOME], found.a[:SOME]
    if finite(problem.chance(s, a)):
        p = exact(problem, s, a).probabilities
        told = f"chance: got a probability of {p.min():g}, expected none below 0"
        yield Fact(bool((p >= NONE).all()), "chance", told)
        told = f"chance: got probabilities that sum to {p.sum(axis=1).max():g}, expected 1"
        yield Fact(_close(p.sum(axis=1), 1), "chance", told)
    if isinstance(problem.states, int) and problem.states <= FEW:
        transition, _, observation = tabulate(problem)
        for table in (transition, *([] if observation is None else [observation])):
            holds = (table >= NONE).all() and _close(table.sum(axis=2), 1)
            told = "chance: got tables whose rows are no probabilities, expected them to sum to 1"
            yield Fact(bool(holds), "chance", told)


def amounting(problem: Problem, s: Array, a: Array) -> Facts:
    """The rows of the tables for these turns are sums over the listed outcomes.

    Of what is over another law asks: in tables it stays, whatever its moves say.
    """
    going = ~problem.terminal(s) | problem.hidden
    s, a = s[going], a[going]
    tables = tabulate(problem)
    p, outcome = exact(problem, s, a)
    joint = np.ravel_multi_index(tuple(a.T), problem.action_counts)
    rewards = (p[:, :, None] * outcome.rewards).sum(axis=1)
    here = problem.index(s)
    told = "move: got other rewards than the tables have, expected the same"
    holds = _close(tables.rewards[here, joint], rewards)
    yield Fact(holds, "move", told)
    for row, transition in enumerate(tables.transition[here, joint]):
        reached = np.bincount(problem.index(outcome.state[row]), p[row], len(transition))
        told = "move: got other next states than the tables have, expected the same"
        yield Fact(_close(transition, reached), "move", told)


def tabulated(problem: Problem, found: Turns) -> Facts:
    """Tables are what the listed outcomes amount to."""
    counted = isinstance(problem.states, int) and problem.states <= FEW
    if counted and all(problem.action_counts):
        s = found.s[:SOME]
        yield from amounting(problem, s, actions(problem, s, WALK, len(s)))


def carried(problem: Problem, found: Turns) -> Facts:
    """A belief is carried as the listed outcomes say."""
    if type(problem).carry is Problem.carry or not isinstance(problem.states, int):
        return
    some = problem.index(found.s[:: max(len(found.s) // 29, 1)])
    belief = np.bincount(some, minlength=problem.states) / len(some)
    for actions_, seen in _known(problem, found.a[0]):
        told = problem.carry(belief, actions_, seen)
        right = Problem.carry(problem, belief, actions_, seen)
        what = "carry: got another belief than the listed outcomes give, expected the same"
        yield Fact(_close(told, right), "carry", what)


def _known(problem: Problem, a: Array) -> Iterator[tuple[list[int | None], list[int | None]]]:
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


def extreme(problem: Problem, found: Turns) -> Facts:
    """The least and the greatest draw give outcomes that can happen."""
    for row in (0, 1, 100, 101):
        one = slice(row, row + 1)
        s, a, u = found.s[one], found.a[one], found.u[one]
        if len(s) and finite(problem.chance(s, a)):
            p, possible = exact(problem, s, a)
            got = problem.step(s, a, u).state[0]
            among = possible.state[0][p[0] > 0]
            held = bool((among == got).reshape(len(among), -1).all(axis=1).any())
            told = f"chance: got {problem.notation(got)!r} from a draw, expected what can happen"
            yield Fact(held, "chance", told)


LAWS: tuple[Callable[[Problem, Turns], Facts], ...] = (
    sampled, listed, able, named, summed, tabulated, carried, extreme,
)  # fmt: skip
