"""Tests that the turns of a session are what the problem computes."""

import numpy as np
import pytest

import dmplay
from dmplay import Outcome
from dmplay.agents.random_agent import Random
from dmplay.core.arrays import Array
from dmplay.core.chance import Chance, Normal
from dmplay.core.problem import Problem
from dmplay.core.uniforms import SeededUniforms
from dmplay.problems.hexworld.rules import HexWorld
from tests.support.user_problems import Heap, Key


class RandomRewardHeap(Heap):
    """A heap of few states whose rewards are random real numbers."""

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        return (Normal(np.zeros(len(s)), np.ones(1)),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        return Outcome(s, events[0][:, None], s)


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
            turn[2:5], (outcome.state, observations, outcome.rewards), strict=True
        ):
            assert actual.dtype == expected.dtype
            assert np.array_equal(actual, expected[0])
        state = turn.state


@pytest.mark.parametrize(
    "name",
    ["hexworld", "crying-baby", "catch", "prisoners-dilemma", "2048", "cart-pole", "predator-prey"],
)
def test_turns_equal_those_of_the_problem(name: str) -> None:
    assert_turns_match_problem(play_random_game(dmplay.load_problem(name), 60))


@pytest.mark.parametrize("problem", [Heap(), Key(), RandomRewardHeap()])
def test_turns_of_a_user_defined_problem_equal_those_of_the_problem(problem: Problem) -> None:
    for seed in range(4):
        game = play_random_game(problem, 20, seed)
        assert_turns_match_problem(game)
        assert game.end_reason == ("turn limit" if len(game.turns) == 20 else "terminal")


def test_a_game_whose_state_never_changes_ends_at_its_limit() -> None:
    game = dmplay.Session(HexWorld(hexes=((0, 0),), rewards=()), SeededUniforms(1), turn_limit=2)
    game.advance([0])
    assert not game.over
    game.advance([0])
    assert game.turns[0].state == game.turns[1].state
    assert game.end_reason == "turn limit"
    game.undo()
    assert not game.over
