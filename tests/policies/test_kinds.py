"""Policies that choose by the state alone, and what they are taught."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import dmplay
from dmplay.chance import Array, Bools
from dmplay.core import Memory, Percept, requires_fields
from dmplay.policies.kinds import MAX_TABULAR_STATES, ConstantPolicy, StationaryPolicy

NOTHING = np.zeros((40, 0))


@dataclass(frozen=True)
class Thinking(StationaryPolicy):
    """Notes of how many states it thinks; its action is their number, as far as there are six."""

    thought: ClassVar[list[int]] = []

    def choose_from_states(self, s: Array, legal: Bools | None) -> Array:
        self.thought.append(len(s))
        return s.reshape(len(s), -1)[:, 0] % 6


def test_where_states_are_few_a_choice_is_made_once_in_each_of_them() -> None:
    problem = dmplay.load_problem("hexworld")
    Thinking.thought.clear()
    policy = Thinking(problem, 0)
    for s in (np.arange(20), np.arange(3, 20), np.array([7])):
        assert policy.choose((s,), None, NOTHING[: len(s)]).tolist() == (s % 6).tolist()
    assert Thinking.thought == [problem.state_count]
    policy.choose((s,), np.ones((1, 6), bool), NOTHING[:1])  # where not all can be done
    assert Thinking.thought == [problem.state_count, 1]


def test_where_they_are_many_it_is_made_in_those_that_come_up() -> None:
    problem = dmplay.load_problem("predator-prey:circle", predators=3)
    assert problem.state_count == 6**4 > MAX_TABULAR_STATES
    Thinking.thought.clear()
    s = np.zeros((40, 4), np.int64)
    Thinking(problem, 0).choose((s,), None, NOTHING)
    assert Thinking.thought == [40]


@dataclass(frozen=True)
class Curious(ConstantPolicy):
    """Notes how many rows there are in each part of what it is taught."""

    taught: ClassVar[list[list[int]]] = []

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        self.taught.append([0 if part is None else len(part) for part in percept])
        return memory


@dataclass(frozen=True)
class Greedy(Curious):
    """Looks at what it is paid alone."""

    @requires_fields("reward")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        return super().update_memory(memory, percept)


def test_what_an_agent_does_not_look_at_is_not_copied_for_many_games() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    Curious.taught.clear()
    dmplay.rollout(problem, [Curious(problem, 0), Greedy(problem, 1)], episodes=5, turn_limit=1)
    assert Curious.taught == [[5, 5, 5, 5], [0, 0, 0, 5]]


def test_a_game_at_a_table_teaches_all() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    Curious.taught.clear()
    game = dmplay.Session(
        problem, dmplay.SeededUniforms(1), [Curious(problem, 0), Greedy(problem, 1)]
    )
    game.advance()
    game.choose_policy_actions()
    assert Curious.taught == [[1, 1, 1, 1], [1, 1, 1, 1]]
