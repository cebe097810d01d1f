"""Pairs of games that a seat cannot distinguish, and that differ in hidden information."""

from functools import cache
from itertools import islice
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Array, Reals
from dmplay.core.problem import Problem
from dmplay.core.uniforms import NATURE_STREAM, SeededUniforms
from tests.support.problem_cases import (
    draw_uniforms,
    is_identical,
    load_small_problem,
    sample_actions,
)


class GameScript(NamedTuple):
    """The uniforms and actions of the first turns of a game."""

    initial_chance: Reals
    uniform_counts: tuple[Reals, ...]  # one array for each turn
    actions: tuple[Array, ...]  # one joint action for each turn


class TwinUniforms:
    """The uniforms of a scripted game, then those of a seed; one seat draws from its own seed."""

    def __init__(self, game: GameScript, seat: int, seat_seed: int, other_seed: int) -> None:
        self.game, self.seat = game, seat
        self.seat_uniforms, self.others = SeededUniforms(seat_seed), SeededUniforms(other_seed)

    def generate_uniforms(self, stream: int, turn: int, reroll: int, count: int) -> Reals:
        if stream == 1 + self.seat:
            return self.seat_uniforms.generate_uniforms(stream, turn, reroll, count)
        if stream == NATURE_STREAM and turn <= len(self.game.uniform_counts):
            scripted = (self.game.initial_chance, *self.game.uniform_counts)[turn]
            return scripted[None]
        return self.others.generate_uniforms(stream, turn, reroll, count)


class TwinGames(NamedTuple):
    """Two games that a seat cannot distinguish, and that differ in hidden information."""

    first: GameScript
    second: GameScript


@cache
def find_twin_games(name: str, seat: int) -> list[TwinGames]:
    problem = load_small_problem(name)
    if not problem.partially_observable:
        return [make_public_twins(problem, 1)]
    pairs = (pair for attempt in range(1, 4) for pair in find_hidden_twins(problem, seat, attempt))
    return [*islice(pairs, 2)]


def make_public_twins(problem: Problem, row: int) -> TwinGames:
    """Make two games with different uniforms that have the same effects."""
    first_draws, second_draws, actions = [], [], []
    start_uniforms = draw_uniforms(problem.uniform_counts.start, 0, row + 1)[row]
    s = problem.sample_initial_states(start_uniforms[None])
    for turn in range(1, 4):
        u = draw_uniforms(problem.uniform_counts.step, turn, row + 1)[row:]
        a = sample_actions(problem, s, 10 * row + turn, 1)
        nudged = np.where(u < 0.5, u + 1e-9, u - 1e-9)
        outcome = problem.step(s, a, u)
        has_same_effect = is_identical(tuple(problem.step(s, a, nudged)), tuple(outcome))
        first_draws.append(u[0])
        second_draws.append(nudged[0] if has_same_effect else u[0])
        actions.append(a[0])
        s = outcome.state
        if problem.terminal(s)[0]:
            break
    return TwinGames(
        *(
            GameScript(start_uniforms, tuple(turn_draws), tuple(actions))
            for turn_draws in (first_draws, second_draws)
        )
    )


def find_hidden_twins(problem: Problem, seat: int, attempt: int) -> list[TwinGames]:
    """Sample games; return pairs with equal actions and observations of the seat but other states.

    If there are other agents, at least one of their actions also differs.
    """
    rows = 3000
    start_uniforms = draw_uniforms(problem.uniform_counts.start, 100 * attempt, rows)
    s = problem.sample_initial_states(start_uniforms)
    nature, actions, observations = [], [], []
    for turn in range(100 * attempt + 1, 100 * attempt + 4):
        a = sample_actions(problem, None, turn, rows)
        a[:, seat] = a[0, seat]
        nature.append(draw_uniforms(problem.uniform_counts.step, turn, rows))
        actions.append(a)
        outcome = problem.step(s, a, nature[-1])
        observations.append(outcome.observations[:, seat])
        s = outcome.state
    stacked = np.stack(observations)
    is_twin = (stacked == stacked[:, :1]).all(axis=0) & (s != s[0]).reshape(rows, -1).any(axis=1)
    if len(problem.agents) > 1:
        is_twin &= (np.stack(actions) != np.stack(actions)[:, :1]).any(axis=(0, 2))
    games = [
        GameScript(
            start_uniforms[row], tuple(u[row] for u in nature), tuple(a[row] for a in actions)
        )
        for row in (0, *np.flatnonzero(is_twin)[:1])
    ]
    return [TwinGames(games[0], game) for game in games[1:]]
