"""Turns that random play comes to, under dice of their own, on which laws are tried."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from dmplay.chance import Array, Chance, Normal, Reals, Uniform
from dmplay.core import Outcome, Problem
from dmplay.dice import NATURE_STREAM, generate_uniforms

SEED = 7
WALK_LENGTH = 12  # turns of random play behind the turns that a law is asked of
MAX_UNIFORM = 0.999999999  # the greatest draw
MAX_ENUMERATED_STATES = 300  # states that are all looked at


class SampledTurns(NamedTuple):
    """Turns that random play comes to, write-protected."""

    start_uniforms: Reals  # [B, draws.start]
    s: Array  # [B, ...]
    a: Array  # [B, n]
    u: Reals  # [B, draws.step], the least and the greatest draws among them


def sample_turns(problem: Problem, rows: int) -> SampledTurns:
    """Row r is what the r-th game is at after r % WALK turns, and a legal action there."""
    opening = turn_uniforms(problem.uniform_counts.start, 0, rows)
    opening[0], opening[1] = 0.0, MAX_UNIFORM
    s = problem.sample_initial_states(opening)
    states = s.copy()
    for turn in range(1, WALK_LENGTH):
        s = step_turn(problem, s, random_joint_actions(problem, s, turn, rows), turn).state
        here = np.arange(rows) % WALK_LENGTH == turn
        states[here] = s[here]
    a = random_joint_actions(problem, states, WALK_LENGTH, rows)
    u = turn_uniforms(count_uniforms(problem, states, a), WALK_LENGTH, rows)
    u[::100], u[1::100] = 0.0, MAX_UNIFORM
    return SampledTurns(*make_arrays_readonly(opening, states, a, u))


def count_uniforms(problem: Problem, s: Array, a: Array) -> int:
    """How many draws a row of these turns takes."""
    return sum(chance.uniform_count for chance in problem.chance(s, a))


def step_turn(problem: Problem, s: Array, a: Array, turn: int) -> Outcome:
    """What comes of these actions under the dice of a turn."""
    return problem.step(s, a, turn_uniforms(count_uniforms(problem, s, a), turn, len(s)))


def random_joint_actions(problem: Problem, s: Array | None, turn: int, rows: int) -> Array:
    """Random joint actions `[B, n]`: legal ones in states `s`, or any."""
    legal = None if s is None else problem.legal_actions_mask(s)
    each = [
        known.sample_actions(
            turn_uniforms(1, turn, rows, 1 + seat)[:, 0], None if legal is None else legal[:, seat]
        )
        for seat, known in enumerate(problem.actions)
    ]
    return np.stack(each, axis=1)


def make_arrays_readonly(*arrays: Array) -> tuple[Array, ...]:
    """The same arrays, which raise an error where they are written to."""
    for one in arrays:
        one.setflags(write=False)
    return arrays


def slice_rows(values: Iterable[Array], rows: slice) -> tuple[Array, ...]:
    """Some rows of several arrays."""
    return tuple(value[rows] for value in values)


def has_finite_outcomes(chances: Iterable[Chance]) -> bool:
    """Whether the outcomes of these can be listed."""
    return not any(isinstance(chance, Uniform | Normal) for chance in chances)


def turn_uniforms(count: int, turn: int, rows: int, stream: int = NATURE_STREAM) -> Reals:
    """The uniforms `[B, count]` of a turn."""
    return generate_uniforms(SEED, stream, turn, rows=rows, count=count)


def is_bitwise_equal(first: Array, second: Array) -> bool:
    """Equal to the last bit; texts, which are as wide as their batch, and objects as such."""
    if first.dtype.kind in "UO":
        return np.array_equal(first, second)
    alike = first.dtype == second.dtype and first.shape == second.shape
    return alike and first.tobytes() == second.tobytes()


def final_states(problem: Problem, games: int, max_turns: int) -> Array:
    """The states in which random games of so many turns end, and all states of a finite problem."""
    s = problem.sample_initial_states(turn_uniforms(problem.uniform_counts.start, 0, games))
    for turn in range(1, max_turns + 1):
        going = ~problem.terminal(s)
        if not going.any():
            break
        moved = step_turn(problem, s, random_joint_actions(problem, s, turn, games), turn).state
        s = np.where(going.reshape(-1, *[1] * (s.ndim - 1)), moved, s)
    if isinstance(problem.state_count, int) and problem.state_count <= MAX_ENUMERATED_STATES:
        return np.concatenate([s, problem.enumerate_states()])
    return s
