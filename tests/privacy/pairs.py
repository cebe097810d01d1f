"""Two real games that a seat cannot tell apart: other dice, other choices of others, one sight."""

from collections.abc import Iterator
from functools import cache
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import dmplay
from dmplay.chance import Array
from dmplay.core import Problem
from dmplay.dice import NATURE_STREAM, generate_uniforms
from dmplay.game.game import Game
from dmplay.game.request import GameRequest
from dmplay.game.start import start_new_game
from dmplay.policies.general import Random
from tests.support.brought import Vault
from tests.support.cases import CASES, MAP, WIDE, load

BROUGHT = f"{Vault.__module__}:{Vault.__name__}"
GUARDED = [
    name for name in CASES if load(name).partially_observable or len(load(name).agents) > 1
] + [BROUGHT]
EVERY = [  # variants play much alike
    pytest.param(name, marks=pytest.mark.slow if ":" in name and name in CASES else ())
    for name in GUARDED
]
WIDEST = ("collaborative-predator-prey", "collaborative-predator-prey:sighted")
MOST = [name for name in GUARDED if name not in WIDEST]  # whose beliefs take little
TOGETHER = [each for each in EVERY if len(dmplay.load_problem(str(each.values[0])).agents) > 1]
FIRST = 70_000  # of the seeds that are looked through
SEEDS = (30, 150, 600, 2500)  # how many: few at first
SHIFTS = 3  # of what the seat does
LOOKED_AT = 2  # turns after which both games still look the same
TURNS = LOOKED_AT + 1  # and the last, which brings out what was hidden
BEGUN: list[Game] = []  # games whose transcripts are open


class Side(NamedTuple):
    """One of the two: its dice, and everybody's actions, the last turn's too."""

    seed: int
    actions: tuple[tuple[int, ...], ...]  # of each seat, a turn each


class Pair(NamedTuple):
    """Two games that this seat cannot tell apart before the last turn."""

    name: str
    problem: Problem
    seat_index: int
    one: Side
    other: Side

    @property
    def sides(self) -> tuple[Side, Side]:
        """Both games."""
        return self.one, self.other

    def begun(
        self, side: Side, record: Path | None = None, *, alone: bool = True, ghost: str = ""
    ) -> Game:
        """One of them before its first turn: the seat is a person, the others agents or people.

        Its seed is fresh, so nobody is told it.
        """
        agents = self.problem.agents
        others = "random" if alone else "human"
        who = {agent: others for agent in agents} | {agents[self.seat_index]: "human"}
        game = start_new_game(
            GameRequest(
                self.name,
                parameters=parameters(self.name),
                seed=side.seed,
                seats=[f"{agent}={each}" for agent, each in who.items()],
                turns=TURNS,
                record_path=record,
                is_seed_visible=False,
                has_fresh_seed=True,
                ghost_agent=ghost,
            )
        )
        BEGUN.append(game)
        return game


def parameters(name: str) -> dict[str, object]:
    """A small map, where there is a map."""
    return {"hexes": MAP} if name in WIDE else {}


@cache
def pair(name: str, seat: int) -> Pair:
    """The first two games of which the seat knows the same; in the last turn others do others."""
    problem = dmplay.load_problem(name, **parameters(name))
    last = [problem.action_counts[one] // 2 for one in range(len(problem.agents))]
    for many, shift in product(SEEDS, range(SHIFTS)):
        known: dict[bytes, Known] = {}
        for game in _games(problem, seat, range(FIRST, FIRST + many), shift):
            alike = known.setdefault(game.sight, game)
            if alike is not game and not (
                problem.partially_observable and alike.secret == game.secret
            ):
                one, other = alike.side, game.side
                last[seat] = one.actions[-1][seat]
                first = tuple(a if n == seat else 0 for n, a in enumerate(last))
                return Pair(
                    name,
                    problem,
                    seat,
                    Side(one.seed, (*one.actions[:-1], first)),
                    Side(other.seed, (*other.actions[:-1], tuple(last))),
                )
    raise AssertionError(f"{name}: no two games look the same to seat {seat}")


class Known(NamedTuple):
    """What a seat knows of a game before the last turn, the state then, and the game."""

    sight: bytes
    secret: bytes
    side: Side


def _games(problem: Problem, seat: int, seeds: range, shift: int) -> Iterator[Known]:
    """The games of these seeds; the seat's actions are those of its list, from one on."""
    s = problem.sample_initial_states(_draws(seeds, NATURE_STREAM, 0, problem.uniform_counts.start))
    sights: list[Array] = [] if problem.partially_observable else [s]
    played: list[Array] = []
    able = np.ones(len(seeds), bool)
    for turn in range(1, TURNS + 1):
        a = _joint(problem, s, seat, seeds, turn, shift)
        played.append(a)
        legal = problem.legal_actions_mask(s)
        if legal is not None:
            sights.append(legal[:, seat])
            able &= legal[np.arange(len(seeds)), seat, a[:, seat]]
        if turn == TURNS:
            break
        rerolls = range(1 + (turn == LOOKED_AT))  # the last may be played under other dice
        draws = [
            _draws(seeds, NATURE_STREAM, turn, problem.uniform_counts.step, reroll)
            for reroll in rerolls
        ]
        outcomes = [problem.step(s, a, u) for u in draws]
        for outcome in outcomes:
            sights += _sights(problem, outcome, a, seat)
        s = outcomes[0].state
        able &= ~problem.terminal(s)
    told = [np.ascontiguousarray(sight.reshape(len(seeds), -1)) for sight in sights]
    for row in np.flatnonzero(able):
        sight = b"|".join(part[row].tobytes() for part in told)
        actions = tuple(tuple(map(int, each[row])) for each in played)
        yield Known(sight, s[row].tobytes(), Side(seeds[row], actions))


def _sights(problem: Problem, outcome: dmplay.Outcome, a: Array, seat: int) -> list[Array]:
    """What a turn shows to a seat."""
    seen = outcome.observations[:, seat] if problem.partially_observable else outcome.observations
    open_ = [] if problem.partially_observable else [a]
    return [seen, *open_, *([outcome.rewards[:, seat]] if problem.rewards_observable else [])]


def _joint(  # noqa: PLR0913, PLR0917 - who acts, when, and by which dice
    problem: Problem, s: Array, seat: int, seeds: range, turn: int, shift: int
) -> Array:
    """What `random` does in the other seats, and what the seat does: in every game the same."""
    legal, chosen = problem.legal_actions_mask(s), []
    for one in range(len(problem.agents)):
        policy = Random(problem, one)
        able = None if legal is None else legal[:, one]
        u = _draws(seeds, 1 + one, turn, policy.uniform_count)
        chosen.append(policy.choose((), able, u))
    many = problem.action_counts[seat]
    turned = [(turn + shift + n) % many for n in range(many)]
    chosen[seat][:] = next(a for a in turned if legal is None or legal[:, seat, a].any())
    return np.stack(chosen, axis=1)


@cache
def _draws(seeds: range, stream: int, turn: int, count: int, reroll: int = 0) -> Array:
    if not reroll:
        return np.stack([_thrown(seed, stream, count)[turn] for seed in seeds])
    each = [
        generate_uniforms(seed, stream, turn, reroll=reroll, rows=1, count=count) for seed in seeds
    ]
    return np.concatenate(each)


@cache
def _thrown(seed: int, stream: int, count: int) -> Array:
    """The draws `[T, count]` of all turns, which are had together sooner than turn by turn."""
    turns = range(TURNS + 1)
    return np.concatenate(
        [generate_uniforms(seed, stream, turn, rows=1, count=count) for turn in turns]
    )
