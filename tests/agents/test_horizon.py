"""Tests of policies that count the turns of a game, for hidden and for visible states."""

import numpy as np
import pytest

from dmplay import Percept, load_problem
from dmplay.agents.base import AdviceQuestion
from dmplay.agents.horizon import HorizonPolicy
from dmplay.agents.single_agent_planning import MdpOptimalPolicy, PomdpOptimalPolicy

POLICIES = {"hexworld": MdpOptimalPolicy, "crying-baby": PomdpOptimalPolicy}
FIRST_OBSERVATIONS = {"hexworld": np.array([0]), "crying-baby": np.array([-1])}


def make_policy(problem_name: str, horizon: int) -> HorizonPolicy:
    """Return the optimal policy of a problem for a horizon, 0 for an infinite one."""
    return POLICIES[problem_name](load_problem(problem_name), 0, horizon=horizon)


@pytest.mark.parametrize("problem_name", POLICIES)
def test_a_memory_counts_the_turns_done_and_begins_again(problem_name: str) -> None:
    policy = make_policy(problem_name, 2)
    memory = policy.initial_memory(FIRST_OBSERVATIONS[problem_name])
    for turns_left in (2, 1, 2, 1):
        assert policy.turns_left(memory).tolist() == [turns_left]
        percept = Percept(np.zeros(1, np.int64), np.ones(1, np.int64), None, None)
        memory = policy.update_memory(memory, percept)


@pytest.mark.parametrize("problem_name", POLICIES)
def test_an_infinite_horizon_counts_no_turns(problem_name: str) -> None:
    observation = FIRST_OBSERVATIONS[problem_name]
    endless, finite = (make_policy(problem_name, horizon) for horizon in (0, 2))
    assert len(endless.memory_at_turn(observation, 1)) == 1
    assert [part.tolist() for part in finite.memory_at_turn(observation, 3)[1:]] == [[1]]


@pytest.mark.parametrize("problem_name", POLICIES)
def test_rows_with_different_turns_left_have_the_values_of_each_alone(problem_name: str) -> None:
    policy = make_policy(problem_name, 3)
    observation = FIRST_OBSERVATIONS[problem_name]
    memories = [policy.memory_at_turn(observation, turn) for turn in range(3)]
    mixed = tuple(np.concatenate(parts) for parts in zip(*memories, strict=True))
    expected = np.concatenate([policy.action_values(memory) for memory in memories])
    np.testing.assert_array_equal(policy.action_values(mixed), expected)
    assert policy.action_values(tuple(part[:0] for part in mixed)).shape == (0, expected.shape[1])


def test_the_horizon_is_that_of_the_game_if_it_can_be_planned() -> None:
    policy = make_policy("crying-baby", 0)
    horizons = [
        policy.adapt_to_game(AdviceQuestion(0, turns)).horizon for turns in (None, 7, 100, 101)
    ]
    assert horizons == [0, 7, 100, 0]
    bases = [policy.values_basis(AdviceQuestion(0, turns)) for turns in (None, 101)]
    assert [basis.scope for basis in bases] == ["", "turn limit ignored"]
