"""Tests of the policy base classes: policies of the state, and the percept fields they require."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import dmplay
from dmplay.agents.base import MAX_TABULAR_STATES, ConstantPolicy, StationaryPolicy
from dmplay.core.arrays import Array, Bools
from dmplay.core.policy import Memory, Percept, requires_fields

NO_UNIFORMS = np.zeros((40, 0))


@dataclass(frozen=True)
class CountingPolicy(StationaryPolicy):
    """A policy that records how many states it evaluates; its action is the state modulo 6."""

    thought: ClassVar[list[int]] = []

    def choose_from_states(self, s: Array, legal: Bools | None) -> Array:
        self.thought.append(len(s))
        return s.reshape(len(s), -1)[:, 0] % 6


def test_a_policy_is_evaluated_once_for_all_states_of_a_small_problem() -> None:
    problem = dmplay.load_problem("hexworld")
    CountingPolicy.thought.clear()
    policy = CountingPolicy(problem, 0)
    for s in (np.arange(20), np.arange(3, 20), np.array([7])):
        assert policy.choose((s,), None, NO_UNIFORMS[: len(s)]).tolist() == (s % 6).tolist()
    assert CountingPolicy.thought == [problem.state_count]
    policy.choose((s,), np.ones((1, 6), bool), NO_UNIFORMS[:1])  # with a legal actions mask
    assert CountingPolicy.thought == [problem.state_count, 1]


def test_a_policy_is_evaluated_only_in_visited_states_of_a_large_problem() -> None:
    problem = dmplay.load_problem("predator-prey:circle", predators=3)
    assert problem.state_count == 6**4 > MAX_TABULAR_STATES
    CountingPolicy.thought.clear()
    s = np.zeros((40, 4), np.int64)
    CountingPolicy(problem, 0).choose((s,), None, NO_UNIFORMS)
    assert CountingPolicy.thought == [40]


@dataclass(frozen=True)
class RecordingPolicy(ConstantPolicy):
    """A policy that records the number of rows in each field of its percepts."""

    taught: ClassVar[list[list[int]]] = []

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        self.taught.append([0 if part is None else len(part) for part in percept])
        return memory


@dataclass(frozen=True)
class RewardOnlyPolicy(RecordingPolicy):
    """A recording policy that requires only the reward."""

    @requires_fields("reward")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        return super().update_memory(memory, percept)


def test_rollouts_omit_the_percept_fields_that_a_policy_does_not_require() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    RecordingPolicy.taught.clear()
    dmplay.rollout(
        problem,
        [RecordingPolicy(problem, 0), RewardOnlyPolicy(problem, 1)],
        episodes=5,
        turn_limit=1,
    )
    assert RecordingPolicy.taught == [[5, 5, 5, 5], [0, 0, 0, 5]]


def test_sessions_pass_all_percept_fields() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    RecordingPolicy.taught.clear()
    game = dmplay.Session(
        problem,
        dmplay.SeededUniforms(1),
        [RecordingPolicy(problem, 0), RewardOnlyPolicy(problem, 1)],
    )
    game.advance()
    game.choose_policy_actions()
    assert RecordingPolicy.taught == [[1, 1, 1, 1], [1, 1, 1, 1]]
