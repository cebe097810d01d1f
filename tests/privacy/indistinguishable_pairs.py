"""Pairs of games that a seat cannot tell apart: other seeds and actions, equal observations."""

from collections.abc import Iterator
from functools import cache
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import dmplay
from dmplay.agents.random_agent import Random
from dmplay.core.arrays import Array
from dmplay.core.problem import Problem
from dmplay.core.uniforms import NATURE_STREAM, generate_uniforms
from dmplay.game.game import Game
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest, format_settings
from tests.support.problem_cases import (
    CASE_NAMES,
    LARGE_MAP_PROBLEMS,
    SMALL_MAP_HEXES,
    load_problem,
)
from tests.support.user_problems import Vault

USER_PROBLEM = f"{Vault.__module__}:{Vault.__name__}"
SECRET_PROBLEMS = [
    name
    for name in CASE_NAMES
    if load_problem(name).partially_observable or len(load_problem(name).agents) > 1
] + [USER_PROBLEM]
SECRET_PROBLEM_PARAMS = [  # variants are similar, so they are slow tests
    pytest.param(name, marks=pytest.mark.slow if ":" in name and name in CASE_NAMES else ())
    for name in SECRET_PROBLEMS
]
SLOW_BELIEF_PROBLEMS = ("collaborative-predator-prey", "collaborative-predator-prey:sighted")
FAST_BELIEF_PROBLEMS = [name for name in SECRET_PROBLEMS if name not in SLOW_BELIEF_PROBLEMS]
MULTI_AGENT_PARAMS = [
    parameter
    for parameter in SECRET_PROBLEM_PARAMS
    if len(dmplay.load_problem(str(parameter.values[0])).agents) > 1
]
FIRST_SEED = 70_000  # first seed that is searched
SEED_COUNTS = (30, 150, 600, 2500)  # numbers of seeds to search, small ones first
ACTION_SHIFT_COUNT = 3  # number of shifts of the seat's actions
SHARED_TURNS = 2  # number of turns after which both games look the same
TURN_COUNT = SHARED_TURNS + 1  # the last turn reveals what was hidden
OPEN_GAMES: list[Game] = []  # games whose transcripts are open


class Side(NamedTuple):
    """One of the two games: its seed, and the actions of all agents, including the last turn."""

    seed: int
    actions: tuple[tuple[int, ...], ...]  # by turn and seat


class Pair(NamedTuple):
    """Two games that this seat cannot tell apart before the last turn."""

    name: str
    problem: Problem
    seat_index: int
    first: Side
    second: Side

    @property
    def sides(self) -> tuple[Side, Side]:
        """Both games."""
        return self.first, self.second

    def begun(
        self, side: Side, record: Path | None = None, *, alone: bool = True, ghost: str = ""
    ) -> Game:
        """Start one of the games: a person in the seat, agents or people in the others.

        The seed counts as a new one, so it is not shown.
        """
        agents = self.problem.agents
        others = "random" if alone else "human"
        players = {agent: others for agent in agents} | {agents[self.seat_index]: "human"}
        game = start_new_game(
            GameRequest(
                self.name,
                settings=format_settings(get_parameters(self.name)),
                seed=side.seed,
                seats=[f"{agent}={player}" for agent, player in players.items()],
                turns=TURN_COUNT,
                record_path=record,
                is_seed_visible=False,
                has_fresh_seed=True,
                ghost_agent=ghost,
            )
        )
        OPEN_GAMES.append(game)
        return game


def get_parameters(name: str) -> dict[str, object]:
    """Return the parameters of a problem: a small map if it has a map."""
    return {"hexes": SMALL_MAP_HEXES} if name in LARGE_MAP_PROBLEMS else {}


@cache
def find_pair(name: str, seat: int) -> Pair:
    """Return the first two games with equal observations; other seats differ in the last turn."""
    problem = dmplay.load_problem(name, **get_parameters(name))
    last = [problem.action_counts[item] // 2 for item in range(len(problem.agents))]
    for seed_count, shift in product(SEED_COUNTS, range(ACTION_SHIFT_COUNT)):
        games_by_observations: dict[bytes, ObservedGame] = {}
        for game in _iter_games(problem, seat, range(FIRST_SEED, FIRST_SEED + seed_count), shift):
            match = games_by_observations.setdefault(game.observed_output, game)
            if match is not game and not (
                problem.partially_observable and match.secret == game.secret
            ):
                item, twin = match.side, game.side
                last[seat] = item.actions[-1][seat]
                first_actions = tuple(a if n == seat else 0 for n, a in enumerate(last))
                return Pair(
                    name,
                    problem,
                    seat,
                    Side(item.seed, (*item.actions[:-1], first_actions)),
                    Side(twin.seed, (*twin.actions[:-1], tuple(last))),
                )
    raise AssertionError(f"{name}: no two games look the same to seat {seat}")


class ObservedGame(NamedTuple):
    """The observations of a seat before the last turn, the state then, and the game."""

    observed_output: bytes
    secret: bytes
    side: Side


def _iter_games(problem: Problem, seat: int, seeds: range, shift: int) -> Iterator[ObservedGame]:
    """Yield the games of these seeds, in which the seat plays its actions in cyclic order."""
    s = problem.sample_initial_states(
        _draw_turn_uniforms(seeds, NATURE_STREAM, 0, problem.uniform_counts.start)
    )
    arrays: list[Array] = [] if problem.partially_observable else [s]
    joint_actions: list[Array] = []
    valid = np.ones(len(seeds), bool)
    for turn in range(1, TURN_COUNT + 1):
        a = _choose_joint_actions(problem, s, seat, seeds, turn, shift)
        joint_actions.append(a)
        legal = problem.legal_actions_mask(s)
        if legal is not None:
            arrays.append(legal[:, seat])
            valid &= legal[np.arange(len(seeds)), seat, a[:, seat]]
        if turn == TURN_COUNT:
            break
        rerolls = range(1 + (turn == SHARED_TURNS))  # the last of these turns may be rerolled
        draws = [
            _draw_turn_uniforms(seeds, NATURE_STREAM, turn, problem.uniform_counts.step, reroll)
            for reroll in rerolls
        ]
        outcomes = [problem.step(s, a, u) for u in draws]
        for outcome in outcomes:
            arrays += _list_observations(problem, outcome, a, seat)
        s = outcomes[0].state
        valid &= ~problem.terminal(s)
    flat_arrays = [np.ascontiguousarray(observed.reshape(len(seeds), -1)) for observed in arrays]
    for row in np.flatnonzero(valid):
        observed = b"|".join(part[row].tobytes() for part in flat_arrays)
        actions = tuple(tuple(map(int, joint[row])) for joint in joint_actions)
        yield ObservedGame(observed, s[row].tobytes(), Side(seeds[row], actions))


def _list_observations(
    problem: Problem, outcome: dmplay.Outcome, a: Array, seat: int
) -> list[Array]:
    """Return the arrays that a turn shows to a seat."""
    observations = (
        outcome.observations[:, seat] if problem.partially_observable else outcome.observations
    )
    public_actions = [] if problem.partially_observable else [a]
    return [
        observations,
        *public_actions,
        *([outcome.rewards[:, seat]] if problem.rewards_observable else []),
    ]


def _choose_joint_actions(  # noqa: PLR0913, PLR0917 - all of these determine the actions
    problem: Problem, s: Array, seat: int, seeds: range, turn: int, shift: int
) -> Array:
    """Choose random actions for other seats, and one action in all games for this seat."""
    legal, chosen = problem.legal_actions_mask(s), []
    for index in range(len(problem.agents)):
        policy = Random(problem, index)
        mask = None if legal is None else legal[:, index]
        u = _draw_turn_uniforms(seeds, 1 + index, turn, policy.uniform_count)
        chosen.append(policy.choose((), mask, u))
    action_count = problem.action_counts[seat]
    candidates = [(turn + shift + n) % action_count for n in range(action_count)]
    chosen[seat][:] = next(a for a in candidates if legal is None or legal[:, seat, a].any())
    return np.stack(chosen, axis=1)


@cache
def _draw_turn_uniforms(seeds: range, stream: int, turn: int, count: int, reroll: int = 0) -> Array:
    if not reroll:
        return np.stack([_draw_game_uniforms(seed, stream, count)[turn] for seed in seeds])
    batches = [
        generate_uniforms(seed, stream, turn, reroll=reroll, rows=1, count=count) for seed in seeds
    ]
    return np.concatenate(batches)


@cache
def _draw_game_uniforms(seed: int, stream: int, count: int) -> Array:
    """Return the uniforms `[T, count]` of all turns, which is faster than turn by turn."""
    turns = range(TURN_COUNT + 1)
    return np.concatenate(
        [generate_uniforms(seed, stream, turn, rows=1, count=count) for turn in turns]
    )
