"""Turns that random play comes to, of every kind that a law is to hold in."""

from collections.abc import Iterable
from functools import cache
from typing import NamedTuple

import numpy as np

from dmplay.chance import Array, Chance, Normal, Reals, Span
from tests.support.cases import ROWS, anything, draws, frozen, load

WALK = 12  # turns of random play behind the states of a pool
LAST = 0.999999999  # the greatest draw


class Pool(NamedTuple):
    """Turns that random play comes to, write-protected."""

    opening: Reals  # [B, draws.start]
    s: Array  # [B, ...]
    a: Array  # [B, n], any actions
    u: Reals  # [B, draws.step], the least and the greatest draws among them


@cache
def pool(name: str) -> Pool:
    """Row r is what the r-th game is at after r % WALK turns."""
    problem = load(name)
    opening = draws(problem.draws.start, turn=0)
    opening[0], opening[1] = 0.0, LAST
    s = problem.start(opening)
    states = s.copy()
    for turn in range(1, WALK):
        s = problem.step(s, anything(problem, s, turn), draws(problem.draws.step, turn)).state
        here = np.arange(ROWS) % WALK == turn
        states[here] = s[here]
    u = draws(problem.draws.step, WALK)
    u[::100], u[1::100] = 0.0, LAST
    return Pool(*frozen(opening, states, anything(problem, None, WALK), u))


def parts(values: Iterable[Array], rows: slice) -> tuple[Array, ...]:
    return tuple(value[rows] for value in values)


def lists(chances: Iterable[Chance]) -> bool:
    """Whether the outcomes of these can be listed."""
    return not any(isinstance(chance, Span | Normal) for chance in chances)
