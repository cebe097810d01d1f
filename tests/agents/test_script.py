"""Tests of scripts: long ones cost no more a turn than short ones."""

import tracemalloc

import numpy as np

import dmplay
from dmplay.agents.script import Script


def test_a_turn_of_a_long_script_copies_nothing() -> None:
    problem = dmplay.load_problem("hexworld")
    script = Script(problem, 0, (0.0,) * 1_000_000)
    session = dmplay.Session(problem, dmplay.SeededUniforms(7), [script])
    session.advance()  # makes the array of actions
    tracemalloc.start()
    for _ in range(5):
        session.advance()
    peak_bytes = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak_bytes < 100_000


def test_an_empty_script_is_over_at_once() -> None:
    script = Script(dmplay.load_problem("hexworld"), 0, ())
    (positions,) = script.initial_memory(np.zeros(2))
    assert positions.tolist() == [0, 0]
    assert script._get_actions_at(positions).tolist() == [0, 0]
