"""Every built-in problem and variant, with random play in them. New problems are included."""

from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay.agents.random_agent import Random
from dmplay.core.arrays import Array, Reals
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.core.seat_history import HistorySnapshot
from dmplay.core.uniforms import NATURE_STREAM, generate_uniforms
from dmplay.registry import problems
from dmplay.registry.builtin_names import problem_names
from dmplay.simulation import random_play

SEED = random_play.SEED
SHORT_GAME_TURNS = 3  # number of turns of a short game
ROW_COUNT = (
    9_001  # a prime, so that no vector width divides it, and larger than NumPy's buffer of 8,192
)
CASE_NAMES = [
    f"{name}:{variant}" if variant else name
    for name in problem_names()
    for variant in problems.load_variants(name)
]
every_problem = pytest.mark.parametrize("name", CASE_NAMES)


# enough hexes for one walker to be out of another's sight
SMALL_MAP_HEXES = ((0, 0), (1, 0), (2, 0), (3, 0), (1, 1))
LARGE_MAP_PROBLEMS = (
    "predator-prey",
    "collaborative-predator-prey",
    "collaborative-predator-prey:sighted",
)


@cache
def load_problem(name: str) -> Problem:
    return dmplay.load_problem(name)


@cache
def load_small_problem(name: str) -> Problem:
    """Load a problem, with a small map in place of a large one so that its agents plan quickly."""
    if name in LARGE_MAP_PROBLEMS:
        return dmplay.load_problem(name, hexes=SMALL_MAP_HEXES)
    return load_problem(name)


def draw_uniforms(
    count: int, turn: int, rows: int = ROW_COUNT, stream: int = NATURE_STREAM
) -> Reals:
    return generate_uniforms(SEED, stream, turn, rows=rows, count=count)


def sample_actions(problem: Problem, s: Array | None, turn: int, rows: int = ROW_COUNT) -> Array:
    """Sample random joint actions `[B, n]`: legal ones in states `s`, or any if `s` is None."""
    return random_play.random_joint_actions(problem, s, turn, rows)


def make_readonly(*arrays: Array) -> tuple[Array, ...]:
    """Make the arrays read-only and return them; writing to them raises an error."""
    return random_play.make_arrays_readonly(*arrays)


def is_identical(first: Any, second: Any) -> bool:
    """True if two values are equal to the last bit, nested values included."""
    if isinstance(first, np.ndarray):
        same_type = isinstance(second, np.ndarray) and first.dtype == second.dtype
        return same_type and first.shape == second.shape and first.tobytes() == second.tobytes()
    if isinstance(first, tuple | list | HistorySnapshot):
        pairs = isinstance(second, tuple | list | HistorySnapshot) and len(first) == len(second)
        return pairs and all(is_identical(*pair) for pair in zip(first, second, strict=True))
    if is_dataclass(first) and not isinstance(first, Problem):
        return type(first) is type(second) and all(
            is_identical(getattr(first, item.name), getattr(second, item.name))
            for item in fields(first)
        )
    return bool(first == second)


def make_random_policies(problem: Problem) -> list[Policy]:
    return [Random(problem, seat) for seat in range(len(problem.agents))]
