"""What a problem makes of a row does not depend on the rows beside it."""

from dataclasses import replace
from functools import cache

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from dmplay.chance import Array, sample
from dmplay.core import Problem
from tests.support.cases import (
    ROWS,
    every_problem,
    frozen,
    load,
    same,
)
from tests.support.pools import WALK, Pool, parts, pool

SIZES = (1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17, 31, 33, 64, 100, 257, 1000, 4099, ROWS)
few_examples = settings(max_examples=15)


def strided(array: Array) -> Array:
    """The same values with gaps between them."""
    wide = np.zeros((*array.shape, 2), array.dtype)
    wide[..., 0] = array
    return frozen(wide)[0][..., 0]


def everything(problem: Problem, found: Pool) -> tuple[Array, ...]:
    """All that a problem computes from a batch, each with the row as its first axis."""
    starts = problem.start(found.opening)
    outcome = problem.step(found.s, found.a, found.u)
    legal = problem.legal(found.s)
    known = () if legal is None else (legal,)
    if isinstance(problem.states, int):
        known = (*known, np.asarray(problem.index(found.s)))
    return (starts, *outcome, problem.terminal(found.s), *known)


@cache
def whole(name: str) -> tuple[Array, ...]:
    return everything(load(name), pool(name))


@every_problem
@few_examples
@given(first=st.integers(0, ROWS - 1), size=st.sampled_from(SIZES), gaps=st.booleans())
def test_a_row_has_the_same_bits_in_any_batch(name: str, first: int, size: int, gaps: bool) -> None:
    rows = slice(min(first, ROWS - size), min(first, ROWS - size) + size)
    found = Pool(*(strided(part[rows]) if gaps else part[rows] for part in pool(name)))
    assert same(everything(load(name), found), parts(whole(name), rows))


@every_problem
def test_each_of_the_first_rows_alone_has_the_same_bits(name: str) -> None:
    for row in range(3 * WALK):
        alone = slice(row, row + 1)
        found = Pool(*parts(pool(name), alone))
        assert same(everything(load(name), found), parts(whole(name), alone))


@every_problem
def test_the_same_draws_give_the_same_outcome(name: str) -> None:
    found = Pool(*(part.copy() for part in pool(name)))
    assert same(everything(load(name), found), whole(name))
    assert same(found, pool(name))  # and nothing was written into
    assert same(everything(replace(load(name)), found), whole(name))


@every_problem
def test_a_step_is_the_move_of_the_sampled_events(name: str) -> None:
    problem, (opening, s, a, u) = load(name), pool(name)
    events = sample(problem.opening(ROWS), opening)
    assert same(problem.place(ROWS, events), problem.start(opening))
    moved = problem.move(s, a, sample(problem.chance(s, a), u))
    assert same(tuple(moved), tuple(problem.step(s, a, u)))


@every_problem
def test_outcomes_have_the_shapes_and_ranges_that_the_problem_states(name: str) -> None:
    problem, (_, s, a, u) = load(name), pool(name)
    agents = len(problem.agents)
    outcome = problem.step(s, a, u)
    assert sum(chance.draws for chance in problem.chance(s, a)) == problem.draws.step
    assert outcome.state.shape == s.shape
    assert outcome.state.dtype == s.dtype
    assert outcome.rewards.shape == (ROWS, agents)
    assert outcome.rewards.dtype == float
    assert np.isfinite(outcome.rewards).all()
    if problem.shared_reward:
        assert (outcome.rewards == outcome.rewards[:, :1]).all()
    if not problem.hidden:
        assert same(outcome.observations, outcome.state)
        return
    assert outcome.observations.shape == (ROWS, agents)
    for seat, labels in enumerate(problem.observations):
        seen = outcome.observations[:, seat]
        assert ((seen >= 0) & (seen < len(labels))).all()
