"""Every built-in problem and variant, those to come included, and play of any kind in them."""

from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay.chance import Array, Reals
from dmplay.core import Policy, Problem
from dmplay.dice import NATURE_STREAM, generate_uniforms
from dmplay.finding import problems
from dmplay.finding.names import problem_names
from dmplay.knowledge import HistorySnapshot
from dmplay.laws import samples
from dmplay.policies.general import Random

SEED = samples.SEED
SOME = 3  # turns of a game that is played on for a while
ROWS = 9_001  # a prime, so that no vector width divides it, and beyond NumPy's buffer of 8,192
CASES = [
    f"{name}:{variant}" if variant else name
    for name in problem_names()
    for variant in problems.load_variants(name)
]
every_problem = pytest.mark.parametrize("name", CASES)


MAP = ((0, 0), (1, 0), (2, 0), (3, 0), (1, 1))  # hexes enough for a walker to be out of sight
WIDE = ("predator-prey", "collaborative-predator-prey", "collaborative-predator-prey:sighted")


@cache
def load(name: str) -> Problem:
    return dmplay.load_problem(name)


@cache
def small(name: str) -> Problem:
    """The same, where it is wide on a map of few hexes: what its agents do there is soon found."""
    return dmplay.load_problem(name, hexes=MAP) if name in WIDE else load(name)


def draws(count: int, turn: int, rows: int = ROWS, stream: int = NATURE_STREAM) -> Reals:
    return generate_uniforms(SEED, stream, turn, rows=rows, count=count)


def anything(problem: Problem, s: Array | None, turn: int, rows: int = ROWS) -> Array:
    """Random joint actions `[B, n]`: legal ones in states `s`, or any."""
    return samples.random_joint_actions(problem, s, turn, rows)


def frozen(*arrays: Array) -> tuple[Array, ...]:
    """The same arrays, which raise an error where they are written to."""
    return samples.make_arrays_readonly(*arrays)


def same(one: Any, other: Any) -> bool:
    """Equal to the last bit, whatever is nested in it."""
    if isinstance(one, np.ndarray):
        kind = isinstance(other, np.ndarray) and one.dtype == other.dtype
        return kind and one.shape == other.shape and one.tobytes() == other.tobytes()
    if isinstance(one, tuple | list | HistorySnapshot):
        pairs = isinstance(other, tuple | list | HistorySnapshot) and len(one) == len(other)
        return pairs and all(same(*pair) for pair in zip(one, other, strict=True))
    if is_dataclass(one) and not isinstance(one, Problem):
        return type(one) is type(other) and all(
            same(getattr(one, each.name), getattr(other, each.name)) for each in fields(one)
        )
    return bool(one == other)


def random_play(problem: Problem) -> list[Policy]:
    return [Random(problem, seat) for seat in range(len(problem.agents))]
