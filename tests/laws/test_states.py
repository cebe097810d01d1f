"""States are written and numbered without loss, and the last ones absorb."""

from functools import cache

import numpy as np
import pytest

from dmplay.chance import Array
from dmplay.core import Problem
from dmplay.errors import BadParameter
from dmplay.rollouts import rollout
from tests.support.cases import (
    SEED,
    SOME,
    anything,
    draws,
    every_problem,
    frozen,
    load,
    random_play,
    same,
)
from tests.support.pools import pool
from tests.support.seats import seated

pytestmark = pytest.mark.usefixtures("coarse")


@cache
def final_states(name: str) -> Array:
    """States at the end of long games: of random play or, where none ends, of the other agents."""
    problem = load(name)
    found = []
    for policies in (random_play(problem), *(policies for _, policies in seated(name))):
        played = rollout(problem, policies, episodes=30, turns=300, seed=SEED)
        found.append(played.state)
        if played.over.any() or type(problem).terminal is Problem.terminal:
            break
    return np.concatenate(found)


@every_problem
def test_notation_and_parse_are_inverse(name: str) -> None:
    problem = load(name)
    for s in (*pool(name).s[:100], *final_states(name)[:50]):
        text = problem.notation(s)
        assert text == text.strip()
        assert len(text.splitlines()) == 1
        again = problem.parse(text)
        assert again.shape == s.shape
        assert np.array_equal(again, s)
        assert problem.notation(again) == text


@every_problem
def test_index_and_enumerated_are_inverse(name: str) -> None:
    problem, s = load(name), pool(name).s
    if not isinstance(problem.states, int):
        with pytest.raises(BadParameter):
            problem.enumerated()
        return
    states = problem.enumerated()
    assert np.array_equal(problem.index(states), np.arange(problem.states))
    assert np.array_equal(states[problem.index(s)], s)


@every_problem
def test_a_terminal_state_absorbs_and_pays_nothing(name: str) -> None:
    problem = load(name)
    known = final_states(name)
    if isinstance(problem.states, int):
        known = np.concatenate([known, problem.enumerated()])
    ends = frozen(known[problem.terminal(known)])[0]
    if type(problem).terminal is not Problem.terminal:
        assert len(ends), "no agent came to a terminal state"
    for turn in range(SOME):
        a = anything(problem, None, turn, len(ends))
        moved, rewards, _ = problem.step(ends, a, draws(problem.draws.step, turn, len(ends)))
        assert same(moved, ends)
        assert (rewards == 0).all()
        assert problem.terminal(moved).all()
