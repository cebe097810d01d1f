"""Every parameter value gives either a one-line error of dmplay or a problem that can be played."""

from collections.abc import Callable
from dataclasses import fields, replace
from functools import partial
from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay.agents.base import AdviceQuestion
from dmplay.core.problem import Problem, make_initial_observation
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import DmplayError
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.registry import agents, problems
from tests.support.interruption import run_with_call_limit
from tests.support.problem_cases import (
    CASE_NAMES,
    SHORT_GAME_TURNS,
    every_problem,
    load_small_problem,
    make_random_policies,
)
from tests.support.seated_agents import EXTERNAL_AGENTS, FAST_AGENTS

ABSURD_TEXTS = (
    "1e400",
    "-1",
    "nan",
    f"1{'0' * 30}",
    f"1{'0' * 400}",
    "",
    "word",
    "[]",
    "[1]",
    "{}",
)
ABSURD_VALUES: tuple[object, ...] = (
    None,
    "word",
    [],
    [[0]],
    {},
    True,
    float("nan"),
    10**400,
    object(),
)

pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")  # absurd numbers overflow


def assert_completes_or_explains(call: Callable[[], object]) -> None:
    """Assert that a call completes or raises an error of one line."""
    message = "done"
    try:
        run_with_call_limit(call)
    except DmplayError as error:
        message = str(error)
    assert message
    assert "\n" not in message


def play_two_turns(problem: Problem) -> None:
    """Play two turns of a game at random."""
    session = Session(problem, SeededUniforms(7, 0), make_random_policies(problem))
    session.advance()
    session.view(0)
    if not session.over:
        session.advance()


def load_and_play(name: str, parameters: dict[str, Any]) -> None:
    play_two_turns(dmplay.load_problem(name, **parameters))


def construct_and_play(problem_class: type[Problem], parameters: dict[str, Any]) -> None:
    play_two_turns(problem_class(**parameters))


def choose_once(problem: Problem, seat: int, name: str) -> None:
    """Let an agent choose once."""
    policy = agents.load_agent(problem, seat, name)
    s = problem.sample_initial_states(np.full((1, problem.uniform_counts.start), 0.3))
    memory = policy.initial_memory(make_initial_observation(problem, s, seat))
    legal = problem.legal_actions_mask(s)
    policy.choose(
        memory, None if legal is None else legal[:, seat], np.full((1, policy.uniform_count), 0.5)
    )


@every_problem
def test_a_problem_refuses_parameters_with_which_it_cannot_be_played(name: str) -> None:
    for parameter in problems.parameter_values(load_small_problem(name)):
        for value in ABSURD_TEXTS:
            assert_completes_or_explains(partial(load_and_play, name, {parameter: value}))


@every_problem
def test_a_problem_refuses_parameters_of_another_type(name: str) -> None:
    problem_class = type(load_small_problem(name))
    for field in fields(problem_class):
        for value in ABSURD_VALUES:
            assert_completes_or_explains(
                partial(construct_and_play, problem_class, {field.name: value})
            )


@pytest.mark.usefixtures("coarse")
@every_problem
def test_an_agent_refuses_parameters_with_which_it_cannot_play(name: str) -> None:
    problem = load_small_problem(name)
    for agent, make in agents.load_roster(problem).agents.items():
        if agent in EXTERNAL_AGENTS:
            continue
        for parameter in agents.default_parameters(make):
            brief = FAST_AGENTS.get(agent, "")
            others = f"{brief.partition(':')[2]}," if brief and parameter not in brief else ""
            for value in ABSURD_TEXTS:
                assert_completes_or_explains(
                    partial(choose_once, problem, 0, f"{agent}:{others}{parameter}={value}")
                )


@pytest.mark.usefixtures("coarse")
@every_problem
def test_a_hint_works_at_any_discount_or_gives_a_one_line_error(name: str) -> None:
    for discount in (0.0, 0.99999999, 1.0):
        problem = replace(load_small_problem(name), discount=discount)
        session = Session(
            problem, SeededUniforms(7, 0), turn_limit=SHORT_GAME_TURNS if problem.horizon else None
        )
        assert_completes_or_explains(
            HintProvider(session, AdviceQuestion.of_session(session, 0)).create_hint
        )


def test_every_number_has_bounds() -> None:
    for name in CASE_NAMES:
        problem = load_small_problem(name)
        classes: list[Any] = [type(problem), *agents.load_roster(problem).agents.values()]
        for parameter_class in classes:
            for field in fields(parameter_class):
                if isinstance(field.default, int | float):
                    assert field.metadata["low"] > -1e9, (parameter_class, field.name)
                    assert field.metadata["high"] < 1e9, (parameter_class, field.name)
