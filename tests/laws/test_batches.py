"""What a problem makes of a row does not depend on the rows beside it."""

from dataclasses import replace
from functools import cache

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from dmplay.chance import Array
from dmplay.laws import play
from dmplay.laws.samples import WALK_LENGTH, SampledTurns, slice_rows
from tests.support.cases import ROWS, every_problem, frozen, load, same
from tests.support.pools import broken, pool

SIZES = (1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17, 31, 33, 64, 100, 257, 1000, 4099, ROWS)
few_examples = settings(max_examples=15)


def strided(found: SampledTurns) -> SampledTurns:
    """The same turns with gaps between their values."""
    wide = [np.zeros((*part.shape, 2), part.dtype) for part in found]
    for array, part in zip(wide, found, strict=True):
        array[..., 0] = part
    return SampledTurns(*(array[..., 0] for array in frozen(*wide)))


@cache
def whole(name: str) -> tuple[Array, ...]:
    return play.evaluate_batch(load(name), pool(name))


def alone(name: str, found: SampledTurns, rows: slice) -> None:
    """Some turns come out as they do among all."""
    problem = load(name)
    assert not broken(
        problem, lambda: play.check_row_independence(problem, found, slice_rows(whole(name), rows))
    )


@every_problem
@few_examples
@given(first=st.integers(0, ROWS - 1), size=st.sampled_from(SIZES), gaps=st.booleans())
def test_a_row_has_the_same_bits_in_any_batch(name: str, first: int, size: int, gaps: bool) -> None:
    rows = slice(min(first, ROWS - size), min(first, ROWS - size) + size)
    some = SampledTurns(*slice_rows(pool(name), rows))
    alone(name, strided(some) if gaps else some, rows)


@every_problem
def test_each_of_the_first_rows_alone_has_the_same_bits(name: str) -> None:
    for row in range(3 * WALK_LENGTH):
        one = slice(row, row + 1)
        alone(name, SampledTurns(*slice_rows(pool(name), one)), one)


@every_problem
def test_the_same_draws_give_the_same_outcome(name: str) -> None:
    problem, found = load(name), SampledTurns(*(part.copy() for part in pool(name)))
    assert not broken(problem, lambda: play.check_determinism(problem, found, whole(name)))
    assert same(found, pool(name))  # and nothing was written into
    assert not broken(problem, lambda: play.check_determinism(replace(problem), found, whole(name)))
