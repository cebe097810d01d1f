"""Tests of states that are whole histories: they are replayed to reach the environment's state,
which policies cannot access.
"""

import math
import pickle
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

import dmplay
from dmplay.core.session import Session
from dmplay.core.spaces import Labels, TextLine
from dmplay.errors import BadPolicy, IllegalAction
from dmplay.external.history_problem import (
    ExternalEnvironment,
    ExternalProblem,
    GameHistory,
    TimeStep,
    parse_history,
)
from dmplay.validation.conformance import check
from tests.support.games import ScriptedUniforms


class CountingEnvironment(ExternalEnvironment):
    """A number that grows by the action and the uniform; the class records the uniforms of all
    steps.
    """

    acted: ClassVar[list[float]] = []

    def __init__(self) -> None:
        self.total = 0.0

    def reset(self, uniform: float) -> TimeStep:
        self.total = uniform
        return self._make_time_step(0.0)

    def step(self, actions: tuple[float, ...], draw: float) -> TimeStep:
        self.acted.append(draw)
        self.total += actions[0] + draw
        return self._make_time_step(actions[0])

    def clone(self) -> None:
        """Return None: the environment cannot be copied."""

    def _make_time_step(self, reward: float) -> TimeStep:
        over = self.total > 5000
        legal_actions = None if over else ((0, 1),)
        return TimeStep(
            (reward,), over, legal_actions, (f"about {math.floor(self.total)}",), f"{self.total}"
        )


@dataclass(frozen=True)
class CountingProblem(ExternalProblem):
    """A problem that shows only the integer part of the number."""

    actions = (Labels(("stay", "add", "leap")),)
    observations = (TextLine(),)
    is_stochastic = True

    def make_environment(self) -> ExternalEnvironment:
        return CountingEnvironment()


COUNTING_PROBLEM = CountingProblem(name="counter")


def play_alternating_game(turns: int) -> Session:
    """Play a game in which every second action is `add`."""
    CountingEnvironment.acted.clear()
    session = Session(COUNTING_PROBLEM, dmplay.SeededUniforms(5))
    for turn in range(turns):
        session.advance([turn % 2])
    return session


def test_a_turn_is_computed_once_and_replayed_after_an_undo() -> None:
    session = play_alternating_game(40)
    assert len(CountingEnvironment.acted) == 40
    observations = [turn.observations.tolist() for turn in session.turns]
    session.undo(3)
    assert len(CountingEnvironment.acted) == 40
    for turn in range(37, 40):
        session.advance([turn % 2])
    # the environment was ahead of this turn and cannot be copied
    assert len(CountingEnvironment.acted) == 40 + 40
    assert [turn.observations.tolist() for turn in session.turns] == observations


def test_equal_histories_of_any_length_are_the_same_object() -> None:
    first, second = play_alternating_game(600).state, play_alternating_game(600).state
    assert first[0] is second[0]
    assert first[0] != play_alternating_game(599).state[0]
    assert pickle.loads(pickle.dumps(first))[0] is first[0]
    assert parse_history("counter", str(first[0])) is first[0]
    assert COUNTING_PROBLEM.parse_state(COUNTING_PROBLEM.format_state(first))[0] is first[0]


def test_a_problem_of_histories_satisfies_every_invariant() -> None:
    assert check(COUNTING_PROBLEM) == []


def test_each_line_of_a_transcript_has_one_turn_and_no_earlier_turns(tmp_path: Path) -> None:
    session = play_alternating_game(30)
    lines = [COUNTING_PROBLEM.format_transcript_state(turn.state) for turn in session.turns]
    assert max(map(len, lines)) < 30 < len(COUNTING_PROBLEM.format_state(session.state))


def test_an_illegal_action_is_not_passed_to_the_environment() -> None:
    start = COUNTING_PROBLEM.sample_initial_states(np.array([[0.5]]))
    with pytest.raises(
        IllegalAction, match="counter: got action 2, which is not a legal action now"
    ):
        COUNTING_PROBLEM.step(start, np.array([[2]]), np.array([[0.5]]))
    with pytest.raises(IllegalAction, match="leap is not legal now"):
        play_alternating_game(1).advance([2])


def test_a_policy_cannot_access_the_environment() -> None:
    """The problem and the view contain no history, which would reveal the number."""
    session = Session(COUNTING_PROBLEM, ScriptedUniforms([0.25], [0.5]))
    session.advance([1])
    visited, pending = set[int](), [COUNTING_PROBLEM, session.view(0)]
    while pending:
        item: object = pending.pop()
        if id(item) in visited or isinstance(item, type | str | int | float):
            continue
        visited.add(id(item))
        assert not isinstance(item, GameHistory | CountingEnvironment)
        pending += [*vars(item).values()] if hasattr(item, "__dict__") else []
        pending += [*item.values()] if isinstance(item, dict) else []
        pending += [*item] if isinstance(item, list | tuple) else []
        pending += [*item.flat] if isinstance(item, np.ndarray) and item.dtype == object else []


def test_search_cannot_use_the_hidden_history() -> None:
    with pytest.raises(BadPolicy, match="search: cannot compute the belief over hidden states"):
        dmplay.load_agent(COUNTING_PROBLEM, 0, "search")
