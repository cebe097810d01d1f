"""A seat and its policy are given nothing that the seat may not know."""

import gc
from dataclasses import fields
from types import ModuleType, NoneType
from typing import Any

import numpy as np
import pytest

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Percept, Policy, Problem
from dmplay.dice import SeededUniforms
from dmplay.laws.samples import has_finite_outcomes
from dmplay.session import Session, Turn, View
from tests.support.cases import anything, every_problem, same, small
from tests.support.pools import pool
from tests.support.seats import seated
from tests.support.twins import Told, Twins, twins

pytestmark = pytest.mark.usefixtures("coarse")


class Watched:
    """A policy that writes down all that it is given."""

    def __init__(self, policy: Policy) -> None:
        self.policy, self.uniform_count = policy, policy.uniform_count
        self.given: list[Any] = []

    def initial_memory(self, observation: Array) -> Memory:
        self.given.append(observation)
        return self.policy.initial_memory(observation)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        self.given.append(percept)
        return self.policy.update_memory(memory, percept)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        chosen = self.policy.choose(memory, legal, u)
        self.given.append((memory, legal, u, chosen))
        return chosen

    def action_values(self, memory: Memory) -> Reals | None:
        return self.policy.action_values(memory)


@every_problem
def test_a_seat_is_shown_nothing_that_it_may_not_know(name: str) -> None:
    problem = small(name)
    for seat, policies in seated(name):
        assert twins(name, seat)
        for pair in twins(name, seat):
            alike(problem, seat, policies, pair)


def alike(problem: Problem, seat: int, policies: list[Policy], pair: Twins) -> None:
    """A seat's views, and all that its policy is given and chooses, are equal in both games."""
    watched = [Watched(policies[seat]) for _ in pair]
    sessions = []
    for watcher, game, others in zip(watched, pair, (11, 12), strict=True):
        players: list[Policy] = [*policies]
        players[seat] = watcher
        sessions.append(Session(problem, Told(game, seat, 10, others), players, turn_limit=99))
    for turn in range(len(pair.one.actions) + 1):
        views = [session.view(seat) for session in sessions]
        for each in fields(View):
            shown = [getattr(view, each.name) for view in views]
            assert same(*shown), f"{each.name} of the view differs"
        if sessions[0].over:
            break
        for session in sessions:
            session.choose_policy_actions()
        assert same(watched[0].given, watched[1].given)
        if turn < len(pair.one.actions):
            for session, game in zip(sessions, pair, strict=True):
                session.advance(list(game.actions[turn]))


@every_problem
def test_the_twins_of_the_privacy_law_differ_where_they_can(name: str) -> None:
    problem = small(name)
    listed = has_finite_outcomes(problem.chance(pool(name).s[:1], pool(name).a[:1]))
    for seat in range(len(problem.agents)):
        for one, other in twins(name, seat):
            if problem.partially_observable:
                assert not same(
                    (one.initial_chance, one.uniform_counts),
                    (other.initial_chance, other.uniform_counts),
                )
                assert len(problem.agents) == 1 or not same(one.actions, other.actions)
            elif problem.uniform_counts.step and listed:
                assert not same(one.uniform_counts, other.uniform_counts)


@every_problem
def test_nothing_leads_from_a_view_to_the_game(name: str) -> None:
    problem = small(name)
    for seat in range(len(problem.agents)):
        session = Session(problem, SeededUniforms(7))
        for turn in range(2):
            if not session.over:
                session.advance(anything(problem, session.state[None], turn, 1)[0].tolist())
        view = session.view(seat)
        met: set[int] = {id(problem)}
        ahead: list[Any] = [view]
        while ahead:
            one = ahead.pop()
            assert not isinstance(one, Session | Turn)
            assert not isinstance(one, np.ndarray) or type(one.base) in {NoneType, bytes}
            for inner in gc.get_referents(one):
                if id(inner) not in met and not isinstance(inner, type | ModuleType):
                    met.add(id(inner))
                    ahead.append(inner)
