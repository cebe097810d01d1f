"""States are written and numbered without loss, and terminal states are absorbing."""

from functools import cache, partial

import numpy as np
import pytest

from dmplay.core.arrays import Array
from dmplay.core.problem import Problem
from dmplay.errors import BadParameter
from dmplay.evaluation.many_games import rollout
from dmplay.validation import invariants
from tests.support.problem_cases import SEED, every_problem, load_problem, make_random_policies
from tests.support.sampled_turns import assert_invariant_holds, list_violations, make_turn_pool
from tests.support.seated_agents import seat_agents

pytestmark = pytest.mark.usefixtures("coarse")


@cache
def collect_final_states(name: str) -> Array:
    """Return the states after long games: of random play or, if none ends, of the agents."""
    problem = load_problem(name)
    ends = type(problem).terminal is not Problem.terminal
    state_arrays = []
    for policies in (
        make_random_policies(problem),
        *(policies for _, policies in seat_agents(name)),
    ):
        result = rollout(problem, policies, episodes=20, turn_limit=300 if ends else 9, seed=SEED)
        state_arrays.append(result.final_states)
        if result.terminated.any() or not ends:
            break
    return np.concatenate(state_arrays)


@every_problem
def test_format_state_and_parse_state_are_inverse(name: str) -> None:
    problem = load_problem(name)
    for states in (make_turn_pool(name).s[:100], collect_final_states(name)[:50]):
        assert not list_violations(problem, partial(invariants.check_state_text, problem, states))


@every_problem
def test_state_indices_and_enumerate_states_are_inverse(name: str) -> None:
    problem = load_problem(name)
    if not isinstance(problem.state_count, int):
        with pytest.raises(BadParameter):
            problem.enumerate_states()
    assert_invariant_holds(name, invariants.check_state_index)


@every_problem
def test_a_terminal_state_absorbs_and_pays_nothing(name: str) -> None:
    problem = load_problem(name)
    states = collect_final_states(name)
    if isinstance(problem.state_count, int):
        states = np.concatenate([states, problem.enumerate_states()])
    if type(problem).terminal is not Problem.terminal:
        assert problem.terminal(states).any(), "no agent came to a terminal state"
    assert not list_violations(problem, partial(invariants.check_terminal_states, problem, states))
