"""Games that a seat cannot tell apart, and that differ in what it may not know."""

from functools import cache
from itertools import islice
from typing import NamedTuple

import numpy as np

from dmplay.chance import Array, Reals
from dmplay.core import Problem
from dmplay.dice import NATURE_STREAM, SeededUniforms
from tests.support.cases import anything, draws, same, small


class Game(NamedTuple):
    """The first turns of a game, written down."""

    initial_chance: Reals
    uniform_counts: tuple[Reals, ...]  # one a turn
    actions: tuple[Array, ...]  # joint, one a turn


class Told:
    """The draws of a written game, then those of one seed; of another for the seat's own."""

    def __init__(self, game: Game, seat: int, own: int, others: int) -> None:
        self.game, self.seat = game, seat
        self.own, self.others = SeededUniforms(own), SeededUniforms(others)

    def generate_uniforms(self, stream: int, turn: int, reroll: int, count: int) -> Reals:
        if stream == 1 + self.seat:
            return self.own.generate_uniforms(stream, turn, reroll, count)
        if stream == NATURE_STREAM and turn <= len(self.game.uniform_counts):
            told = (self.game.initial_chance, *self.game.uniform_counts)[turn]
            return told[None]
        return self.others.generate_uniforms(stream, turn, reroll, count)


class Twins(NamedTuple):
    """Two games that a seat cannot tell apart, and that differ in what it may not know."""

    one: Game
    other: Game


@cache
def twins(name: str, seat: int) -> list[Twins]:
    problem = small(name)
    if not problem.partially_observable:
        return [public_twins(problem, 1)]
    found = (pair for attempt in range(1, 4) for pair in hidden_twins(problem, seat, attempt))
    return [*islice(found, 2)]


def public_twins(problem: Problem, row: int) -> Twins:
    """The same game in public, by other draws wherever others have the same effect."""
    one, other, actions = [], [], []
    opening = draws(problem.uniform_counts.start, 0, row + 1)[row]
    s = problem.sample_initial_states(opening[None])
    for turn in range(1, 4):
        u = draws(problem.uniform_counts.step, turn, row + 1)[row:]
        a = anything(problem, s, 10 * row + turn, 1)
        near = np.where(u < 0.5, u + 1e-9, u - 1e-9)
        outcome = problem.step(s, a, u)
        unseen = same(tuple(problem.step(s, a, near)), tuple(outcome))
        one.append(u[0])
        other.append(near[0] if unseen else u[0])
        actions.append(a[0])
        s = outcome.state
        if problem.terminal(s)[0]:
            break
    return Twins(*(Game(opening, tuple(these), tuple(actions)) for these in (one, other)))


def hidden_twins(problem: Problem, seat: int, attempt: int) -> list[Twins]:
    """Of many games, some in which the seat did and saw the same, and the hidden state differs.

    Where there are other agents, they also did something else.
    """
    rows = 3000
    opening = draws(problem.uniform_counts.start, 100 * attempt, rows)
    s = problem.sample_initial_states(opening)
    nature, actions, seen = [], [], []
    for turn in range(100 * attempt + 1, 100 * attempt + 4):
        a = anything(problem, None, turn, rows)
        a[:, seat] = a[0, seat]
        nature.append(draws(problem.uniform_counts.step, turn, rows))
        actions.append(a)
        outcome = problem.step(s, a, nature[-1])
        seen.append(outcome.observations[:, seat])
        s = outcome.state
    sights = np.stack(seen)
    apart = (sights == sights[:, :1]).all(axis=0) & (s != s[0]).reshape(rows, -1).any(axis=1)
    if len(problem.agents) > 1:
        apart &= (np.stack(actions) != np.stack(actions)[:, :1]).any(axis=(0, 2))
    games = [
        Game(opening[row], tuple(u[row] for u in nature), tuple(a[row] for a in actions))
        for row in (0, *np.flatnonzero(apart)[:1])
    ]
    return [Twins(games[0], game) for game in games[1:]]
