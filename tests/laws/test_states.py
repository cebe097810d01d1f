"""States are written and numbered without loss, and the last ones absorb."""

from functools import cache, partial

import numpy as np
import pytest

from dmplay.chance import Array
from dmplay.core import Problem
from dmplay.errors import BadParameter
from dmplay.laws import play
from dmplay.rollouts import rollout
from tests.support.cases import SEED, every_problem, load, random_play
from tests.support.pools import broken, keeps, pool
from tests.support.seats import seated

pytestmark = pytest.mark.usefixtures("coarse")


@cache
def final_states(name: str) -> Array:
    """States at the end of long games: of random play or, where none ends, of the other agents."""
    problem = load(name)
    ends = type(problem).terminal is not Problem.terminal
    found = []
    for policies in (random_play(problem), *(policies for _, policies in seated(name))):
        played = rollout(problem, policies, episodes=20, turn_limit=300 if ends else 9, seed=SEED)
        found.append(played.final_states)
        if played.terminated.any() or not ends:
            break
    return np.concatenate(found)


@every_problem
def test_notation_and_parse_are_inverse(name: str) -> None:
    problem = load(name)
    for states in (pool(name).s[:100], final_states(name)[:50]):
        assert not broken(problem, partial(play.check_state_text, problem, states))


@every_problem
def test_index_and_enumerated_are_inverse(name: str) -> None:
    problem = load(name)
    if not isinstance(problem.state_count, int):
        with pytest.raises(BadParameter):
            problem.enumerate_states()
    keeps(name, play.check_state_index)


@every_problem
def test_a_terminal_state_absorbs_and_pays_nothing(name: str) -> None:
    problem = load(name)
    known = final_states(name)
    if isinstance(problem.state_count, int):
        known = np.concatenate([known, problem.enumerate_states()])
    if type(problem).terminal is not Problem.terminal:
        assert problem.terminal(known).any(), "no agent came to a terminal state"
    assert not broken(problem, partial(play.check_terminal_states, problem, known))
