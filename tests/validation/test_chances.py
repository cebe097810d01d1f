"""Sampled initial states and outcomes have the listed probabilities."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from dmplay.core.arrays import Array, Reals
from dmplay.core.chance import Chance, Normal, Uniform
from dmplay.core.problem import enumerate_outcomes, initial_state_distribution
from dmplay.simulation.random_play import WALK_LENGTH, has_finite_outcomes
from tests.support.problem_cases import draw_uniforms, every_problem, load_problem
from tests.support.sampled_turns import make_turn_pool

SAMPLE_COUNT = 5003  # number of turns that are sampled from one state


def encode_rows(*arrays: Array) -> list[bytes]:
    """Return each row as bytes, with -0.0 as 0.0."""
    flat = [np.ascontiguousarray(part + 0).reshape(len(part), -1) for part in arrays]
    return [row.tobytes() for row in np.hstack([part.view(np.uint8) for part in flat])]


def normalize_pearson(counts: Sequence[float], expected: Sequence[float]) -> float:
    """Return Pearson's statistic as a standard normal variable (Wilson and Hilferty)."""
    order = np.argsort(expected)
    observed, predicted = np.array(counts, float)[order], np.array(expected)[order]
    rare = int(np.searchsorted(np.cumsum(predicted), 10.0)) + 1  # pooled into one cell
    observed = np.append(observed[rare:], observed[:rare].sum())
    predicted = np.append(predicted[rare:], predicted[:rare].sum())
    degrees_of_freedom = len(predicted) - 1
    if degrees_of_freedom == 0:
        return 0.0
    spread = 2 / (9 * degrees_of_freedom)
    statistic = ((observed - predicted) ** 2 / predicted).sum()
    return float(((statistic / degrees_of_freedom) ** (1 / 3) - (1 - spread)) / math.sqrt(spread))


def assert_frequencies(sampled: list[bytes], p: Reals, listed: list[bytes]) -> None:
    """Assert that the sampled keys have the listed probabilities, and that no other keys occur."""
    expected: dict[bytes, float] = {}
    for weight, key in zip(p, listed, strict=True):
        if weight > 0:
            expected[key] = expected.get(key, 0.0) + weight * len(sampled)
    counts = dict.fromkeys(expected, 0)
    for key in sampled:
        assert key in counts, "an outcome of probability 0 came up"
        counts[key] += 1
    assert normalize_pearson(list(counts.values()), list(expected.values())) < 4.5


def evaluate_cdf(chance: Uniform | Normal, x: Array) -> Reals:
    if isinstance(chance, Uniform):
        return np.asarray((x - chance.low[0]) / (chance.high[0] - chance.low[0]))
    scaled = (x - chance.mean[0]) / (chance.standard_deviation[0] * math.sqrt(2))
    return np.array([(1 + math.erf(value)) / 2 for value in scaled])


def assert_distribution(chance: Chance, u: Reals) -> None:
    """Assert that the events of a chance that is the same in every row have its distribution."""
    events = np.sort(np.asarray(chance.sample_events(u)))
    if not isinstance(chance, Uniform | Normal):
        p = chance.probabilities()[0]
        assert (
            normalize_pearson(np.bincount(events, minlength=len(p)).tolist(), (p * len(u)).tolist())
            < 4.5
        )
        return
    width = chance.high - chance.low if isinstance(chance, Uniform) else chance.standard_deviation
    if width[0] == 0:
        assert (events == events[0]).all()
        return
    # Kolmogorov and Smirnov: one sample in eight thousand exceeds 2.2.
    rank = np.arange(len(u) + 1) / len(u)
    under = evaluate_cdf(chance, events)
    gap = np.maximum(under - rank[:-1], rank[1:] - under).max()
    assert gap * math.sqrt(len(u)) < 2.2


def assert_distributions(chances: tuple[Chance, ...], u: Reals) -> None:
    column = 0
    for chance in chances:
        assert_distribution(chance, u[:, column : column + chance.uniform_count])
        column += chance.uniform_count
    assert column == u.shape[1]


@every_problem
def test_initial_states_have_the_listed_probabilities(name: str) -> None:
    problem = load_problem(name)
    u = draw_uniforms(problem.uniform_counts.start, turn=1000, rows=SAMPLE_COUNT)
    if not has_finite_outcomes(problem.initial_chance(1)):
        assert_distributions(problem.initial_chance(SAMPLE_COUNT), u)
        return
    p, states = initial_state_distribution(problem)
    assert p.sum() == pytest.approx(1, abs=1e-12)
    assert_frequencies(encode_rows(problem.sample_initial_states(u)), p, encode_rows(states))


@every_problem
@pytest.mark.parametrize("row", [WALK_LENGTH - 1, WALK_LENGTH, 2 * WALK_LENGTH + 5])
def test_outcomes_have_the_listed_probabilities(name: str, row: int) -> None:
    problem, turns = load_problem(name), make_turn_pool(name)
    s, a = turns.s[row : row + 1], turns.a[row : row + 1]
    u = draw_uniforms(problem.uniform_counts.step, turn=1000 + row, rows=SAMPLE_COUNT)
    states, actions = np.repeat(s, SAMPLE_COUNT, axis=0), np.repeat(a, SAMPLE_COUNT, axis=0)
    if not has_finite_outcomes(problem.chance(s, a)):
        assert_distributions(problem.chance(states, actions), u)
        return
    listed = enumerate_outcomes(problem, s, a)
    assert_frequencies(
        encode_rows(*problem.step(states, actions, u)),
        listed.probabilities[0],
        encode_rows(*(part[0] for part in listed.outcomes)),
    )
