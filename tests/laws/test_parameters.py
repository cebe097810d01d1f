"""Whatever a parameter is given ends in one line of our own, or in a game that can be played."""

from collections.abc import Callable
from dataclasses import fields, replace
from functools import partial
from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay.advice.adviser import HintProvider
from dmplay.core import Problem
from dmplay.dice import SeededUniforms
from dmplay.errors import DmplayError
from dmplay.finding import agents, problems
from dmplay.session import Session
from tests.support.cases import CASES, SOME, every_problem, random_play, small
from tests.support.quick import quickly
from tests.support.seats import BRIEF, FOREIGN

ABSURD = ("1e400", "-1", "nan", f"1{'0' * 30}", f"1{'0' * 400}", "", "word", "[]", "[1]", "{}")
KINDS: tuple[object, ...] = (None, "word", [], [[0]], {}, True, float("nan"), 10**400, object())

pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of numbers beyond all bounds


def ends(done: Callable[[], object]) -> None:
    """Does it, or is told in one line why not."""
    told = "done"
    try:
        quickly(done)
    except DmplayError as error:
        told = str(error)
    assert told
    assert "\n" not in told


def played(problem: Problem) -> None:
    """Two turns of a game, and what the adviser would do in each seat."""
    session = Session(problem, SeededUniforms(7, 0), random_play(problem))
    session.advance()
    session.view(0)
    if not session.over:
        session.advance()


def loaded(name: str, given: dict[str, Any]) -> None:
    played(dmplay.load_problem(name, **given))


def constructed(made: type[Problem], given: dict[str, Any]) -> None:
    played(made(**given))


def seated(problem: Problem, seat: int, name: str) -> None:
    """One choice of an agent."""
    made = agents.load_agent(problem, seat, name)
    s = problem.sample_initial_states(np.full((1, problem.uniform_counts.start), 0.3))
    memory = made.initial_memory(problem.initial_observation(s, seat))
    legal = problem.legal_actions_mask(s)
    made.choose(
        memory, None if legal is None else legal[:, seat], np.full((1, made.uniform_count), 0.5)
    )


@every_problem
def test_a_problem_takes_no_parameter_that_it_cannot_be_played_with(name: str) -> None:
    for parameter in problems.parameter_values(small(name)):
        for value in ABSURD:
            ends(partial(loaded, name, {parameter: value}))


@every_problem
def test_a_problem_refuses_another_kind_of_parameter(name: str) -> None:
    made = type(small(name))
    for one in fields(made):
        for value in KINDS:
            ends(partial(constructed, made, {one.name: value}))


@pytest.mark.usefixtures("coarse")
@every_problem
def test_an_agent_takes_no_parameter_that_it_cannot_play_with(name: str) -> None:
    problem = small(name)
    for agent, make in agents.load_roster(problem).agents.items():
        if agent in FOREIGN:
            continue
        for parameter in agents.default_parameters(make):
            brief = BRIEF.get(agent, "")
            others = f"{brief.partition(':')[2]}," if brief and parameter not in brief else ""
            for value in ABSURD:
                ends(partial(seated, problem, 0, f"{agent}:{others}{parameter}={value}"))


@pytest.mark.usefixtures("coarse")
@every_problem
def test_a_hint_is_had_at_any_discount_or_one_line_says_why_not(name: str) -> None:
    for discount in (0.0, 0.99999999, 1.0):
        problem = replace(small(name), discount=discount)
        session = Session(
            problem, SeededUniforms(7, 0), turn_limit=SOME if problem.horizon else None
        )
        ends(HintProvider(session, 0).create_hint)


def test_every_number_has_bounds() -> None:
    for name in CASES:
        problem = small(name)
        parts: list[Any] = [type(problem), *agents.load_roster(problem).agents.values()]
        for made in parts:
            for one in fields(made):
                if isinstance(one.default, int | float):
                    assert one.metadata["low"] > -1e9, (made, one.name)
                    assert one.metadata["high"] < 1e9, (made, one.name)
