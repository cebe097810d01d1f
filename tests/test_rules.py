"""What a game asks of its problem: where little can happen, once, and always what it would be."""

from collections import Counter
from typing import ClassVar

import numpy as np
import pytest

import dmplay
from dmplay import Outcome, rules
from dmplay.chance import Array, Bools, Chance, Normal
from dmplay.core import Memory, Percept, Problem
from dmplay.dice import SeededUniforms
from dmplay.errors import BadPolicy
from dmplay.policies.general import Random
from dmplay.policies.script import Script
from dmplay.problems.hexworld import STRAIGHT_LINE_HEXES, HexWorld
from tests.support.brought import Heap, Key

PLAYED = ("hexworld", "crying-baby", "catch", "prisoners-dilemma", "multicaregiver-crying-baby")


class Asked(HexWorld):
    """A line of hexes without exits that counts what it is asked."""

    times: ClassVar[Counter[str]] = Counter()

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        self.times["move"] += 1
        return super().resolve_events(s, a, events)

    def terminal(self, s: Array) -> Bools:
        self.times["terminal"] += 1
        return super().terminal(s)


class Leaking(Heap):
    """A heap of few states from which real numbers are drawn."""

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        return (Normal(np.zeros(len(s)), np.ones(1)),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        return Outcome(s, events[0][:, None], s)


class Unlocking(Script):
    """Makes what it is told its own."""

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        percept.observation.flags.writeable = True
        return super().update_memory(memory, percept)


def played(problem: Problem, turns: int, seed: int = 3) -> dmplay.Session:
    """A game of agents who do anything."""
    agents = [Random(problem, seat) for seat in range(len(problem.agents))]
    game = dmplay.Session(problem, SeededUniforms(seed), agents, turn_limit=turns)
    while not game.over:
        game.advance()
    return game


def assert_as_the_problem_says(game: dmplay.Session) -> None:
    """Each turn is what the problem makes of its state, actions and draws."""
    state = game.initial_state
    for turn in game.turns:
        outcome = game.problem.step(state[None], turn.actions[None], turn.uniforms[None])
        seen = outcome.observations if game.problem.partially_observable else outcome.state
        for got, expected in zip(turn[2:], (outcome.state, seen, outcome.rewards), strict=True):
            assert got.dtype == expected.dtype
            assert np.array_equal(got, expected[0])
        state = turn.state


@pytest.mark.parametrize("name", [*PLAYED, "2048", "cart-pole", "predator-prey"])
def test_a_turn_is_what_the_problem_says_whether_it_is_remembered_or_not(name: str) -> None:
    problem = dmplay.load_problem(name)
    game = played(problem, 60)
    assert_as_the_problem_says(game)
    little = rules.make_dynamics(problem, game.initial_state)
    assert isinstance(little, rules.CachedDynamics) == (name in PLAYED)


@pytest.mark.parametrize("problem", [Heap(), Key(), Leaking()])
def test_so_is_one_of_a_problem_that_is_brought(problem: Problem) -> None:
    for seed in range(4):
        game = played(problem, 20, seed)
        assert_as_the_problem_says(game)
        assert game.end_reason == ("turn limit" if len(game.turns) == 20 else "terminal")


def test_what_comes_again_is_not_asked_again() -> None:
    Asked.times.clear()
    game = played(Asked(hexes=STRAIGHT_LINE_HEXES, rewards=()), 900)
    assert_as_the_problem_says(game)
    asked = Asked.times["move"] - len(game.turns)  # and once a turn just now
    assert Asked.times["terminal"] == len(STRAIGHT_LINE_HEXES)
    assert asked <= 3 * 6 * len(STRAIGHT_LINE_HEXES)


def test_a_policy_that_unlocks_what_it_is_told_again_is_named() -> None:
    problem = dmplay.load_problem("crying-baby")
    game = dmplay.Session(problem, SeededUniforms(1), [Unlocking(problem, 0, (0, 0))])
    game.advance()
    with pytest.raises(
        BadPolicy, match=r"turn 2, agent: Unlocking\.update_memory writes into what it"
    ):
        game.advance()


def test_what_is_forgotten_is_asked_again(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = dmplay.load_problem("crying-baby")
    monkeypatch.setattr(rules, "MAX_CACHED_ANSWERS", 6)
    assert isinstance(rules.make_dynamics(problem, np.array(0)), rules.CachedDynamics)
    assert_as_the_problem_says(played(problem, 60))


def test_a_game_that_stands_still_ends_at_its_limit() -> None:
    game = dmplay.Session(HexWorld(hexes=((0, 0),), rewards=()), SeededUniforms(1), turn_limit=2)
    game.advance([0])
    assert not game.over
    game.advance([0])
    assert game.turns[0].state == game.turns[1].state
    assert game.end_reason == "turn limit"
    game.undo()
    assert not game.over
