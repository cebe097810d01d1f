"""Turns that random play comes to, under dice of their own, on which laws are tried."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from dmplay.chance import Array, Chance, Normal, Reals, Span
from dmplay.core import Outcome, Problem
from dmplay.dice import NATURE, uniforms

SEED = 7
WALK = 12  # turns of random play behind the turns that a law is asked of
LAST = 0.999999999  # the greatest draw
FEW = 300  # states that are all looked at


class Turns(NamedTuple):
    """Turns that random play comes to, write-protected."""

    opening: Reals  # [B, draws.start]
    s: Array  # [B, ...]
    a: Array  # [B, n]
    u: Reals  # [B, draws.step], the least and the greatest draws among them


def turns(problem: Problem, rows: int) -> Turns:
    """Row r is what the r-th game is at after r % WALK turns, and a legal action there."""
    opening = draws(problem.draws.start, 0, rows)
    opening[0], opening[1] = 0.0, LAST
    s = problem.start(opening)
    states = s.copy()
    for turn in range(1, WALK):
        s = after(problem, s, actions(problem, s, turn, rows), turn).state
        here = np.arange(rows) % WALK == turn
        states[here] = s[here]
    a = actions(problem, states, WALK, rows)
    u = draws(taken(problem, states, a), WALK, rows)
    u[::100], u[1::100] = 0.0, LAST
    return Turns(*frozen(opening, states, a, u))


def taken(problem: Problem, s: Array, a: Array) -> int:
    """How many draws a row of these turns takes."""
    return sum(chance.draws for chance in problem.chance(s, a))


def after(problem: Problem, s: Array, a: Array, turn: int) -> Outcome:
    """What comes of these actions under the dice of a turn."""
    return problem.step(s, a, draws(taken(problem, s, a), turn, len(s)))


def actions(problem: Problem, s: Array | None, turn: int, rows: int) -> Array:
    """Random joint actions `[B, n]`: legal ones in states `s`, or any."""
    legal = None if s is None else problem.legal(s)
    each = [
        known.draw(draws(1, turn, rows, 1 + seat)[:, 0], None if legal is None else legal[:, seat])
        for seat, known in enumerate(problem.actions)
    ]
    return np.stack(each, axis=1)


def frozen(*arrays: Array) -> tuple[Array, ...]:
    """The same arrays, which raise an error where they are written to."""
    for one in arrays:
        one.setflags(write=False)
    return arrays


def parts(values: Iterable[Array], rows: slice) -> tuple[Array, ...]:
    """Some rows of several arrays."""
    return tuple(value[rows] for value in values)


def finite(chances: Iterable[Chance]) -> bool:
    """Whether the outcomes of these can be listed."""
    return not any(isinstance(chance, Span | Normal) for chance in chances)


def draws(count: int, turn: int, rows: int, stream: int = NATURE) -> Reals:
    """The uniforms `[B, count]` of a turn."""
    return uniforms(SEED, stream, turn, rows=rows, count=count)


def same(one: Array, other: Array) -> bool:
    """Equal to the last bit; texts, which are as wide as their batch, and objects as such."""
    if one.dtype.kind in "UO":
        return np.array_equal(one, other)
    alike = one.dtype == other.dtype and one.shape == other.shape
    return alike and one.tobytes() == other.tobytes()


def final(problem: Problem, games: int, most: int) -> Array:
    """The states in which random games of so many turns end, and all states of a finite problem."""
    s = problem.start(draws(problem.draws.start, 0, games))
    for turn in range(1, most + 1):
        going = ~problem.terminal(s)
        if not going.any():
            break
        moved = after(problem, s, actions(problem, s, turn, games), turn).state
        s = np.where(going.reshape(-1, *[1] * (s.ndim - 1)), moved, s)
    if isinstance(problem.states, int) and problem.states <= FEW:
        return np.concatenate([s, problem.enumerated()])
    return s
