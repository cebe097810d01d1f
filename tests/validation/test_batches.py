"""The result of a row does not depend on the other rows of its batch."""

from dataclasses import replace
from functools import cache

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from dmplay.core.arrays import Array
from dmplay.simulation.random_play import WALK_LENGTH, SampledTurns, slice_rows
from dmplay.validation import invariants
from tests.support.problem_cases import (
    ROW_COUNT,
    every_problem,
    is_identical,
    load_problem,
    make_readonly,
)
from tests.support.sampled_turns import list_violations, make_turn_pool

BATCH_SIZES = (1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17, 31, 33, 64, 100, 257, 1000, 4099, ROW_COUNT)
few_examples = settings(max_examples=15)


def add_gaps(turns: SampledTurns) -> SampledTurns:
    """Return the same turns with gaps between the values in memory."""
    buffers = [np.zeros((*part.shape, 2), part.dtype) for part in turns]
    for array, part in zip(buffers, turns, strict=True):
        array[..., 0] = part
    return SampledTurns(*(array[..., 0] for array in make_readonly(*buffers)))


@cache
def evaluate_pool(name: str) -> tuple[Array, ...]:
    return invariants.compute_batch_results(load_problem(name), make_turn_pool(name))


def assert_rows_independent(name: str, turns: SampledTurns, rows: slice) -> None:
    """Assert that these rows give the same results as in the whole pool."""
    problem = load_problem(name)
    assert not list_violations(
        problem,
        lambda: invariants.check_row_independence(
            problem, turns, slice_rows(evaluate_pool(name), rows)
        ),
    )


@every_problem
@few_examples
@given(first=st.integers(0, ROW_COUNT - 1), size=st.sampled_from(BATCH_SIZES), gaps=st.booleans())
def test_a_row_has_the_same_bits_in_any_batch(name: str, first: int, size: int, gaps: bool) -> None:
    rows = slice(min(first, ROW_COUNT - size), min(first, ROW_COUNT - size) + size)
    selected = SampledTurns(*slice_rows(make_turn_pool(name), rows))
    assert_rows_independent(name, add_gaps(selected) if gaps else selected, rows)


@every_problem
def test_each_of_the_first_rows_alone_has_the_same_bits(name: str) -> None:
    for row in range(3 * WALK_LENGTH):
        row_slice = slice(row, row + 1)
        assert_rows_independent(
            name, SampledTurns(*slice_rows(make_turn_pool(name), row_slice)), row_slice
        )


@every_problem
def test_the_same_uniforms_give_the_same_outcome(name: str) -> None:
    problem = load_problem(name)
    turns = SampledTurns(*(part.copy() for part in make_turn_pool(name)))
    assert not list_violations(
        problem, lambda: invariants.check_determinism(problem, turns, evaluate_pool(name))
    )
    assert is_identical(turns, make_turn_pool(name))  # the inputs are unchanged
    assert not list_violations(
        problem, lambda: invariants.check_determinism(replace(problem), turns, evaluate_pool(name))
    )
