"""Turns that random play leads to, under a fixed seed, on which invariants are checked."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Array, Reals
from dmplay.core.chance import Chance, Normal, Uniform
from dmplay.core.problem import Outcome, Problem
from dmplay.core.uniforms import NATURE_STREAM, generate_uniforms

SEED = 7
WALK_LENGTH = 12  # turns of random play before the turns that are checked
MAX_UNIFORM = 0.999999999  # the greatest uniform
MAX_ENUMERATED_STATES = 300  # maximum number of states that are all checked


class SampledTurns(NamedTuple):
    """Turns that random play leads to, as read-only arrays."""

    start_uniforms: Reals  # [B, uniform_counts.start]
    s: Array  # [B, ...]
    a: Array  # [B, n]
    u: Reals  # [B, uniform_counts.step], some rows with the least and the greatest uniforms


def sample_random_turns(problem: Problem, rows: int) -> SampledTurns:
    """Return turns of random play: row r is game r after r % WALK_LENGTH turns, with an action."""
    start_uniforms = generate_turn_uniforms(problem.uniform_counts.start, 0, rows)
    start_uniforms[0], start_uniforms[1] = 0.0, MAX_UNIFORM
    s = problem.sample_initial_states(start_uniforms)
    states = s.copy()
    for turn in range(1, WALK_LENGTH):
        s = step_turn(problem, s, random_joint_actions(problem, s, turn, rows), turn).state
        is_reached = np.arange(rows) % WALK_LENGTH == turn
        states[is_reached] = s[is_reached]
    a = random_joint_actions(problem, states, WALK_LENGTH, rows)
    u = generate_turn_uniforms(count_uniforms(problem, states, a), WALK_LENGTH, rows)
    u[::100], u[1::100] = 0.0, MAX_UNIFORM
    return SampledTurns(*make_arrays_readonly(start_uniforms, states, a, u))


def count_uniforms(problem: Problem, s: Array, a: Array) -> int:
    """Return the number of uniforms that a row of these turns consumes."""
    return sum(chance.uniform_count for chance in problem.chance(s, a))


def step_turn(problem: Problem, s: Array, a: Array, turn: int) -> Outcome:
    """Return the outcome of these actions under the uniforms of a turn."""
    return problem.step(s, a, generate_turn_uniforms(count_uniforms(problem, s, a), turn, len(s)))


def random_joint_actions(problem: Problem, s: Array | None, turn: int, rows: int) -> Array:
    """Return random joint actions `[B, n]`: legal ones in states `s`, or any if `s` is None."""
    legal = None if s is None else problem.legal_actions_mask(s)
    columns = [
        action_space.sample_actions(
            generate_turn_uniforms(1, turn, rows, 1 + seat)[:, 0],
            None if legal is None else legal[:, seat],
        )
        for seat, action_space in enumerate(problem.actions)
    ]
    return np.stack(columns, axis=1)


def make_arrays_readonly(*arrays: Array) -> tuple[Array, ...]:
    """Make arrays read-only, and return them."""
    for array in arrays:
        array.setflags(write=False)
    return arrays


def slice_rows(values: Iterable[Array], rows: slice) -> tuple[Array, ...]:
    """Return some rows of several arrays."""
    return tuple(value[rows] for value in values)


def has_finite_outcomes(chances: Iterable[Chance]) -> bool:
    """Return whether the outcomes of these distributions can be listed."""
    return not any(isinstance(chance, Uniform | Normal) for chance in chances)


def generate_turn_uniforms(count: int, turn: int, rows: int, stream: int = NATURE_STREAM) -> Reals:
    """Return the uniforms `[B, count]` of a turn."""
    return generate_uniforms(SEED, stream, turn, rows=rows, count=count)


def is_bitwise_equal(first: Array, second: Array) -> bool:
    """Return whether two arrays are equal to the last bit.

    Text arrays, whose width depends on their batch, and arrays of objects are compared by value.
    """
    if first.dtype.kind in "UO":
        return np.array_equal(first, second)
    has_same_type = first.dtype == second.dtype and first.shape == second.shape
    return has_same_type and first.tobytes() == second.tobytes()


def sample_final_states(problem: Problem, games: int, max_turns: int) -> Array:
    """Return the states after random games of `max_turns` turns, and all states if they are few."""
    s = problem.sample_initial_states(
        generate_turn_uniforms(problem.uniform_counts.start, 0, games)
    )
    for turn in range(1, max_turns + 1):
        active = ~problem.terminal(s)
        if not active.any():
            break
        actions = random_joint_actions(problem, s, turn, games)
        next_states = step_turn(problem, s, actions, turn).state
        s = np.where(active.reshape(-1, *[1] * (s.ndim - 1)), next_states, s)
    if isinstance(problem.state_count, int) and problem.state_count <= MAX_ENUMERATED_STATES:
        return np.concatenate([s, problem.enumerate_states()])
    return s
