"""Tables of problems with illegal actions; nothing can write into them."""

from functools import partial

import numpy as np
import pytest

from dmplay.core.arrays import Bools
from dmplay.core.problem import Problem
from dmplay.core.tabular import Tables, Tabular, tabulate
from dmplay.validation import invariants
from tests.support.problem_cases import load_problem
from tests.support.sampled_turns import list_violations
from tests.support.user_problems import Heap, Key


@pytest.mark.parametrize("problem", [Key(), Heap()])
def test_the_tables_match_the_outcomes_of_legal_actions(problem: Problem) -> None:
    s, a = np.nonzero(list_legal_masks(problem)[:, 0])
    invariant = partial(
        invariants.check_table_rows, problem, problem.enumerate_states()[s], a[:, None]
    )
    assert not list_violations(problem, invariant)


@pytest.mark.parametrize("problem", [Key(), Heap()])
def test_an_illegal_action_equals_the_first_legal_one_in_the_tables(problem: Problem) -> None:
    transition, rewards, _ = tabulate(problem)
    closed = np.argwhere(~list_legal_masks(problem)[:, 0])
    assert len(closed)
    for s, a in closed:
        first = int(np.flatnonzero(list_legal_masks(problem)[s, 0])[0])
        assert transition[s, a].tolist() == transition[s, first].tolist()
        assert rewards[s, a] == rewards[s, first]


def list_legal_masks(problem: Problem) -> Bools:
    """Return the legal actions of every state `[S, n, A]`."""
    legal = problem.legal_actions_mask(problem.enumerate_states())
    assert legal is not None
    return legal


def test_the_tables_of_a_problem_are_read_only() -> None:
    for name in ("machine-replacement", "catch", "crying-baby"):
        problem = load_problem(name)
        assert isinstance(problem, Tabular)
        assert isinstance(problem.tables, Tables)
        for array in problem.tables:
            assert array is None or not array.flags.writeable


def test_tables_may_be_lists() -> None:
    halves, even = [[[1.0, 0.0], [0.0, 1.0]]] * 2, [[[0.5, 0.5]] * 2] * 2
    for array in Tables(halves, [[[0], [1]]] * 2, even):
        assert array is not None
        assert array.shape[:2] == (2, 2)
        assert not array.flags.writeable
    with pytest.raises(ValueError, match="inhomogeneous"):
        Tables([[[1.0, 0.0], [1.0]]], [[[0]]])
