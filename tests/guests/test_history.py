"""A state that is all that happened: it is led to again, and nothing leads from a view to it."""

import math
import pickle
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

import dmplay
from dmplay.conformance import check
from dmplay.core import Labels, TextLine
from dmplay.errors import BadPolicy, IllegalAction
from dmplay.guests.history import (
    ExternalEnvironment,
    ExternalProblem,
    GameHistory,
    TimeStep,
    parse_history,
)
from dmplay.session import Session
from tests.support.games import Scripted


class Counting(ExternalEnvironment):
    """A number that grows by what is chosen and drawn; worlds count what they do."""

    acted: ClassVar[list[float]] = []

    def __init__(self) -> None:
        self.total = 0.0

    def reset(self, uniform: float) -> TimeStep:
        self.total = uniform
        return self._known(0.0)

    def step(self, actions: tuple[float, ...], draw: float) -> TimeStep:
        self.acted.append(draw)
        self.total += actions[0] + draw
        return self._known(actions[0])

    def clone(self) -> None:
        """There is none."""

    def _known(self, reward: float) -> TimeStep:
        over = self.total > 5000
        able = None if over else ((0, 1),)
        return TimeStep(
            (reward,), over, able, (f"about {math.floor(self.total)}",), f"{self.total}"
        )


@dataclass(frozen=True)
class Counter(ExternalProblem):
    """Of the number its whole part is seen."""

    actions = (Labels(("stay", "add", "leap")),)
    observations = (TextLine(),)
    is_stochastic = True

    def make_environment(self) -> ExternalEnvironment:
        return Counting()


PROBLEM = Counter(name="counter")


def game(turns: int) -> Session:
    """A game in which every second turn adds."""
    Counting.acted.clear()
    played = Session(PROBLEM, dmplay.SeededUniforms(5))
    for turn in range(turns):
        played.advance([turn % 2])
    return played


def test_a_turn_is_played_once_and_one_taken_back_is_led_to_again() -> None:
    played = game(40)
    assert len(Counting.acted) == 40
    seen = [turn.observations.tolist() for turn in played.turns]
    played.undo(3)
    assert len(Counting.acted) == 40
    for turn in range(37, 40):
        played.advance([turn % 2])
    assert len(Counting.acted) == 40 + 40  # the world stood further on, and cannot be copied
    assert [turn.observations.tolist() for turn in played.turns] == seen


def test_there_is_one_history_for_all_that_happened_alike_however_long() -> None:
    one, other = game(600).state, game(600).state
    assert one[0] is other[0]
    assert one[0] != game(599).state[0]
    assert pickle.loads(pickle.dumps(one))[0] is one[0]
    assert parse_history("counter", str(one[0])) is one[0]
    assert PROBLEM.parse_state(PROBLEM.format_state(one))[0] is one[0]


def test_all_laws_are_kept() -> None:
    assert check(PROBLEM) == []


def test_a_transcript_tells_each_turn_and_not_what_came_before(tmp_path: Path) -> None:
    played = game(30)
    lines = [PROBLEM.format_transcript_state(turn.state) for turn in played.turns]
    assert max(map(len, lines)) < 30 < len(PROBLEM.format_state(played.state))


def test_an_illegal_action_reaches_no_world() -> None:
    start = PROBLEM.sample_initial_states(np.array([[0.5]]))
    with pytest.raises(IllegalAction, match="counter: got action 2, which is not legal here"):
        PROBLEM.step(start, np.array([[2]]), np.array([[0.5]]))
    with pytest.raises(IllegalAction, match="leap is not legal now"):
        game(1).advance([2])


def test_nothing_leads_from_what_a_policy_has_to_the_world() -> None:
    """The problem and the view hold no history, of which the number could be told."""
    played = Session(PROBLEM, Scripted([0.25], [0.5]))
    played.advance([1])
    found, left = set[int](), [PROBLEM, played.view(0)]
    while left:
        one: object = left.pop()
        if id(one) in found or isinstance(one, type | str | int | float):
            continue
        found.add(id(one))
        assert not isinstance(one, GameHistory | Counting)
        left += [*vars(one).values()] if hasattr(one, "__dict__") else []
        left += [*one.values()] if isinstance(one, dict) else []
        left += [*one] if isinstance(one, list | tuple) else []
        left += [*one.flat] if isinstance(one, np.ndarray) and one.dtype == object else []


def test_no_search_looks_through_it() -> None:
    with pytest.raises(BadPolicy, match="search needs a belief, as states are hidden"):
        dmplay.load_agent(PROBLEM, 0, "search")
