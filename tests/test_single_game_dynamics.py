"""Tests of the dynamics of a game, which cache the answers of problems with few states."""

from collections import Counter
from typing import ClassVar

import numpy as np
import pytest

import dmplay
from dmplay import Outcome
from dmplay import single_game_dynamics as rules
from dmplay.agents.random_agent import Random
from dmplay.agents.script import Script
from dmplay.chance import Array, Bools, Chance, Normal
from dmplay.core import Memory, Percept, Problem
from dmplay.errors import BadPolicy
from dmplay.problems.hexworld import STRAIGHT_LINE_HEXES, HexWorld
from dmplay.uniforms import SeededUniforms
from tests.support.user_problems import Heap, Key

CACHED_PROBLEMS = (
    "hexworld",
    "crying-baby",
    "catch",
    "prisoners-dilemma",
    "multicaregiver-crying-baby",
)


class CountingHexWorld(HexWorld):
    """A line of hexes without exits that counts the calls of its methods."""

    times: ClassVar[Counter[str]] = Counter()

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        self.times["move"] += 1
        return super().resolve_events(s, a, events)

    def terminal(self, s: Array) -> Bools:
        self.times["terminal"] += 1
        return super().terminal(s)


class RandomRewardHeap(Heap):
    """A heap of few states whose rewards are random real numbers."""

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        return (Normal(np.zeros(len(s)), np.ones(1)),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        return Outcome(s, events[0][:, None], s)


class Unlocking(Script):
    """A policy that makes each observation it receives writable."""

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        percept.observation.flags.writeable = True
        return super().update_memory(memory, percept)


def play_random_game(problem: Problem, turns: int, seed: int = 3) -> dmplay.Session:
    """Play a game of random agents."""
    agents = [Random(problem, seat) for seat in range(len(problem.agents))]
    game = dmplay.Session(problem, SeededUniforms(seed), agents, turn_limit=turns)
    while not game.over:
        game.advance()
    return game


def assert_turns_match_problem(game: dmplay.Session) -> None:
    """Assert that each turn is what the problem computes from its state, actions and uniforms."""
    state = game.initial_state
    for turn in game.turns:
        outcome = game.problem.step(state[None], turn.actions[None], turn.uniforms[None])
        observations = outcome.observations if game.problem.partially_observable else outcome.state
        for actual, expected in zip(
            turn[2:], (outcome.state, observations, outcome.rewards), strict=True
        ):
            assert actual.dtype == expected.dtype
            assert np.array_equal(actual, expected[0])
        state = turn.state


@pytest.mark.parametrize("name", [*CACHED_PROBLEMS, "2048", "cart-pole", "predator-prey"])
def test_cached_and_uncached_turns_equal_those_of_the_problem(name: str) -> None:
    problem = dmplay.load_problem(name)
    game = play_random_game(problem, 60)
    assert_turns_match_problem(game)
    dynamics = rules.make_dynamics(problem, game.initial_state)
    assert isinstance(dynamics, rules.CachedDynamics) == (name in CACHED_PROBLEMS)


@pytest.mark.parametrize("problem", [Heap(), Key(), RandomRewardHeap()])
def test_turns_of_a_user_defined_problem_equal_those_of_the_problem(problem: Problem) -> None:
    for seed in range(4):
        game = play_random_game(problem, 20, seed)
        assert_turns_match_problem(game)
        assert game.end_reason == ("turn limit" if len(game.turns) == 20 else "terminal")


def test_repeated_turns_are_answered_from_the_cache() -> None:
    CountingHexWorld.times.clear()
    game = play_random_game(CountingHexWorld(hexes=STRAIGHT_LINE_HEXES, rewards=()), 900)
    assert_turns_match_problem(game)
    # assert_turns_match_problem called it once per turn
    uncached_calls = CountingHexWorld.times["move"] - len(game.turns)
    assert CountingHexWorld.times["terminal"] == len(STRAIGHT_LINE_HEXES)
    assert uncached_calls <= 3 * 6 * len(STRAIGHT_LINE_HEXES)


def test_a_policy_that_writes_into_a_cached_observation_is_named() -> None:
    problem = dmplay.load_problem("crying-baby")
    game = dmplay.Session(problem, SeededUniforms(1), [Unlocking(problem, 0, (0, 0))])
    game.advance()
    with pytest.raises(
        BadPolicy, match=r"turn 2, agent: Unlocking\.update_memory writes into what it"
    ):
        game.advance()


def test_evicted_answers_are_computed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = dmplay.load_problem("crying-baby")
    monkeypatch.setattr(rules, "MAX_CACHED_ANSWERS", 6)
    assert isinstance(rules.make_dynamics(problem, np.array(0)), rules.CachedDynamics)
    assert_turns_match_problem(play_random_game(problem, 60))


def test_a_game_whose_state_never_changes_ends_at_its_limit() -> None:
    game = dmplay.Session(HexWorld(hexes=((0, 0),), rewards=()), SeededUniforms(1), turn_limit=2)
    game.advance([0])
    assert not game.over
    game.advance([0])
    assert game.turns[0].state == game.turns[1].state
    assert game.end_reason == "turn limit"
    game.undo()
    assert not game.over
