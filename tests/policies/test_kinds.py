"""Policies that choose by the state alone."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import dmplay
from dmplay.chance import Array, Bools
from dmplay.policies.kinds import FEW, Settled

NOTHING = np.zeros((40, 0))


@dataclass(frozen=True)
class Thinking(Settled):
    """Notes of how many states it thinks; its action is their number, as far as there are six."""

    thought: ClassVar[list[int]] = []

    def chosen(self, s: Array, legal: Bools | None) -> Array:
        self.thought.append(len(s))
        return s.reshape(len(s), -1)[:, 0] % 6


def test_where_states_are_few_a_choice_is_made_once_in_each_of_them() -> None:
    problem = dmplay.load("hexworld")
    Thinking.thought.clear()
    policy = Thinking(problem, 0)
    for s in (np.arange(20), np.arange(3, 20), np.array([7])):
        assert policy.choose((s,), None, NOTHING[: len(s)]).tolist() == (s % 6).tolist()
    assert Thinking.thought == [problem.states]
    policy.choose((s,), np.ones((1, 6), bool), NOTHING[:1])  # where not all can be done
    assert Thinking.thought == [problem.states, 1]


def test_where_they_are_many_it_is_made_in_those_that_come_up() -> None:
    problem = dmplay.load("predator-prey:circle", predators=3)
    assert problem.states == 6**4 > FEW
    Thinking.thought.clear()
    s = np.zeros((40, 4), np.int64)
    Thinking(problem, 0).choose((s,), None, NOTHING)
    assert Thinking.thought == [40]
