"""What one agent may do tells it nothing of a hidden state: all that it may be in allow the same.

Else who is told what is legal knows more than its belief does, and no value of a belief holds.
"""

from collections.abc import Iterator

import numpy as np

from dmplay.chance import Array, Bools, Ints
from dmplay.core import Problem, exact_start, placed, possible
from dmplay.errors import BadParameter, TooMuch
from dmplay.laws.arrays import CLOSE
from dmplay.laws.breach import Fact, Facts
from dmplay.laws.samples import FEW


def secret(problem: Problem) -> Facts:
    """States that look alike allow the same, as far as some hundred sets of them tell."""
    few = isinstance(problem.states, int) and problem.states <= FEW
    if not (problem.hidden and few and len(problem.agents) == 1 and problem.actions[0].labels):
        return
    states = problem.enumerated()
    legal = problem.legal(states)
    if legal is None or not (legal != legal[:1]).any():
        return
    able = legal[:, 0]
    try:
        alike = [*_alike(problem, states, able)]
    except (BadParameter, TooMuch):  # what can happen is not listed, or a law before is broken
        return
    for some in alike:
        other = some[(able[some] != able[some[0]]).any(axis=1)][:1]
        one, two = (problem.notation(states[s]) for s in (some[0], *other, some[0])[:2])
        apart = f"other actions in {two!r} than in {one!r}, which nothing seen tells apart"
        yield Fact(not len(other), "legal", f"legal: got {apart}")


def betrayed(problem: Problem) -> bool:
    """Whether what is legal tells of a hidden state, so that no value of a belief holds."""
    return not all(fact.holds for fact in secret(problem))


def _alike(problem: Problem, states: Array, able: Bools) -> Iterator[Ints]:
    """Sets of states that an agent which sees what they allow cannot tell apart, some hundred."""
    ways = [_led(problem, states, able[:, a], a) for a in range(able.shape[1])]
    goes_on, sight = ~problem.terminal(states), problem.first(states)[:, 0]
    p, begun = exact_start(problem)
    start = np.isin(np.arange(len(states)), placed(problem, begun)[p > CLOSE])
    found = [start & (sight == seen) for seen in np.unique(sight[start])]
    known = {one.tobytes() for one in found}
    for here in found:  # which grows
        some = np.flatnonzero(here & goes_on)
        if not len(some):
            continue
        yield some
        if len(found) > FEW:
            continue
        for a in np.flatnonzero(able[some].all(axis=0)):
            led = np.isin(ways[a][0], some)
            _, after, seen = (part[led] for part in ways[a])
            for one in np.unique(seen):
                then = np.isin(np.arange(len(states)), after[seen == one])
                if then.tobytes() not in known:
                    known.add(then.tobytes())
                    found.append(then)


def _led(problem: Problem, states: Array, able: Bools, a: int) -> tuple[Ints, Ints, Ints]:
    """From which state an action can lead to which, and what is seen then, each `[N]`."""
    some = np.flatnonzero(able)
    row, p, outcome = possible(problem, states[some], np.full((len(some), 1), a))
    found = some[row], placed(problem, outcome.state), outcome.observations[:, 0]
    source, after, seen = (part[p > CLOSE] for part in found)  # the rest is rounding
    return source, after, seen
