"""A seat and its policy receive nothing that the seat may not know."""

import gc
from dataclasses import fields
from types import ModuleType, NoneType
from typing import Any

import numpy as np
import pytest

from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.policy import Memory, Percept, Policy
from dmplay.core.problem import Problem
from dmplay.core.session import Session, Turn, View
from dmplay.core.uniforms import SeededUniforms
from dmplay.simulation.random_play import has_finite_outcomes
from tests.support.indistinguishable_games import TwinGames, TwinUniforms, find_twin_games
from tests.support.problem_cases import (
    every_problem,
    is_identical,
    load_small_problem,
    sample_actions,
)
from tests.support.sampled_turns import make_turn_pool
from tests.support.seated_agents import seat_agents

pytestmark = pytest.mark.usefixtures("coarse")


class RecordingPolicy:
    """A policy that records everything that it receives."""

    def __init__(self, policy: Policy) -> None:
        self.policy, self.uniform_count = policy, policy.uniform_count
        self.received: list[Any] = []

    def initial_memory(self, observation: Array) -> Memory:
        self.received.append(observation)
        return self.policy.initial_memory(observation)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        self.received.append(percept)
        return self.policy.update_memory(memory, percept)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        chosen = self.policy.choose(memory, legal, u)
        self.received.append((memory, legal, u, chosen))
        return chosen

    def action_values(self, memory: Memory) -> Reals | None:
        return self.policy.action_values(memory)


@every_problem
def test_a_seat_receives_nothing_that_it_may_not_know(name: str) -> None:
    problem = load_small_problem(name)
    for seat, policies in seat_agents(name):
        assert find_twin_games(name, seat)
        for pair in find_twin_games(name, seat):
            assert_indistinguishable(problem, seat, policies, pair)


def assert_indistinguishable(
    problem: Problem, seat: int, policies: list[Policy], pair: TwinGames
) -> None:
    """Assert that a seat's views, and all inputs and choices of its policy, are equal in both
    games.
    """
    recorders = [RecordingPolicy(policies[seat]) for _ in pair]
    sessions = []
    for recorder, game, others in zip(recorders, pair, (11, 12), strict=True):
        players: list[Policy] = [*policies]
        players[seat] = recorder
        sessions.append(
            Session(problem, TwinUniforms(game, seat, 10, others), players, turn_limit=99)
        )
    for turn in range(len(pair.first.actions) + 1):
        views = [session.view(seat) for session in sessions]
        for field in fields(View):
            values = [getattr(view, field.name) for view in views]
            assert is_identical(*values), f"{field.name} of the view differs"
        if sessions[0].over:
            break
        for session in sessions:
            session.choose_policy_actions()
        assert is_identical(recorders[0].received, recorders[1].received)
        if turn < len(pair.first.actions):
            for session, game in zip(sessions, pair, strict=True):
                session.advance(list(game.actions[turn]))


@every_problem
def test_twin_games_differ_wherever_they_can(name: str) -> None:
    problem = load_small_problem(name)
    listed = has_finite_outcomes(
        problem.chance(make_turn_pool(name).s[:1], make_turn_pool(name).a[:1])
    )
    for seat in range(len(problem.agents)):
        for first, second in find_twin_games(name, seat):
            if problem.partially_observable:
                assert not is_identical(
                    (first.initial_chance, first.uniform_counts),
                    (second.initial_chance, second.uniform_counts),
                )
                assert len(problem.agents) == 1 or not is_identical(first.actions, second.actions)
            elif problem.uniform_counts.step and listed:
                assert not is_identical(first.uniform_counts, second.uniform_counts)


@every_problem
def test_a_view_holds_no_reference_to_the_game(name: str) -> None:
    problem = load_small_problem(name)
    for seat in range(len(problem.agents)):
        session = Session(problem, SeededUniforms(7))
        for turn in range(2):
            if not session.over:
                session.advance(sample_actions(problem, session.state[None], turn, 1)[0].tolist())
        view = session.view(seat)
        visited: set[int] = {id(problem)}
        queue: list[Any] = [view]
        while queue:
            item = queue.pop()
            assert not isinstance(item, Session | Turn)
            assert not isinstance(item, np.ndarray) or type(item.base) in {NoneType, bytes}
            for inner in gc.get_referents(item):
                if id(inner) not in visited and not isinstance(inner, type | ModuleType):
                    visited.add(id(inner))
                    queue.append(inner)
