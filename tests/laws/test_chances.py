"""What is sampled comes up as often as what is listed says."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from dmplay.chance import Array, Chance, Normal, Reals, Uniform
from dmplay.core import enumerate_outcomes, initial_state_distribution
from dmplay.laws.samples import WALK_LENGTH, has_finite_outcomes
from tests.support.cases import draws, every_problem, load
from tests.support.pools import pool

MANY = 5003  # turns from one state, to count what comes of them


def keys(*arrays: Array) -> list[bytes]:
    """Each row as bytes, -0.0 as 0.0."""
    flat = [np.ascontiguousarray(part + 0).reshape(len(part), -1) for part in arrays]
    return [row.tobytes() for row in np.hstack([part.view(np.uint8) for part in flat])]


def odd(counts: Sequence[float], expected: Sequence[float]) -> float:
    """How many standard deviations Pearson's statistic is too large (Wilson and Hilferty)."""
    order = np.argsort(expected)
    met, due = np.array(counts, float)[order], np.array(expected)[order]
    rare = int(np.searchsorted(np.cumsum(due), 10.0)) + 1  # pooled into one cell
    met = np.append(met[rare:], met[:rare].sum())
    due = np.append(due[rare:], due[:rare].sum())
    freedom = len(due) - 1
    if freedom == 0:
        return 0.0
    spread = 2 / (9 * freedom)
    statistic = ((met - due) ** 2 / due).sum()
    return float(((statistic / freedom) ** (1 / 3) - (1 - spread)) / math.sqrt(spread))


def follows(met: list[bytes], p: Reals, listed: list[bytes]) -> None:
    """Sampled keys occur as often as the listed probabilities say, and no others do."""
    expected: dict[bytes, float] = {}
    for weight, key in zip(p, listed, strict=True):
        if weight > 0:
            expected[key] = expected.get(key, 0.0) + weight * len(met)
    counts = dict.fromkeys(expected, 0)
    for key in met:
        assert key in counts, "an outcome of probability 0 came up"
        counts[key] += 1
    assert odd(list(counts.values()), list(expected.values())) < 4.5


def cumulative(chance: Uniform | Normal, x: Array) -> Reals:
    if isinstance(chance, Uniform):
        return np.asarray((x - chance.low[0]) / (chance.high[0] - chance.low[0]))
    scaled = (x - chance.mean[0]) / (chance.standard_deviation[0] * math.sqrt(2))
    return np.array([(1 + math.erf(one)) / 2 for one in scaled])


def spreads(chance: Chance, u: Reals) -> None:
    """The events of one chance, the same in every row, have its distribution."""
    events = np.sort(np.asarray(chance.sample_events(u)))
    if not isinstance(chance, Uniform | Normal):
        p = chance.probabilities()[0]
        assert odd(np.bincount(events, minlength=len(p)).tolist(), (p * len(u)).tolist()) < 4.5
        return
    width = chance.high - chance.low if isinstance(chance, Uniform) else chance.standard_deviation
    if width[0] == 0:
        assert (events == events[0]).all()
        return
    # Kolmogorov and Smirnov: 2.2 is passed by one in eight thousand.
    rank = np.arange(len(u) + 1) / len(u)
    under = cumulative(chance, events)
    gap = np.maximum(under - rank[:-1], rank[1:] - under).max()
    assert gap * math.sqrt(len(u)) < 2.2


def each_spreads(chances: tuple[Chance, ...], u: Reals) -> None:
    at = 0
    for chance in chances:
        spreads(chance, u[:, at : at + chance.uniform_count])
        at += chance.uniform_count
    assert at == u.shape[1]


@every_problem
def test_starts_come_up_as_often_as_they_should(name: str) -> None:
    problem = load(name)
    u = draws(problem.uniform_counts.start, turn=1000, rows=MANY)
    if not has_finite_outcomes(problem.initial_chance(1)):
        each_spreads(problem.initial_chance(MANY), u)
        return
    p, states = initial_state_distribution(problem)
    assert p.sum() == pytest.approx(1, abs=1e-12)
    follows(keys(problem.sample_initial_states(u)), p, keys(states))


@every_problem
@pytest.mark.parametrize("row", [WALK_LENGTH - 1, WALK_LENGTH, 2 * WALK_LENGTH + 5])
def test_outcomes_come_up_as_often_as_they_should(name: str, row: int) -> None:
    problem, found = load(name), pool(name)
    s, a = found.s[row : row + 1], found.a[row : row + 1]
    u = draws(problem.uniform_counts.step, turn=1000 + row, rows=MANY)
    many, acts = np.repeat(s, MANY, axis=0), np.repeat(a, MANY, axis=0)
    if not has_finite_outcomes(problem.chance(s, a)):
        each_spreads(problem.chance(many, acts), u)
        return
    listed = enumerate_outcomes(problem, s, a)
    follows(
        keys(*problem.step(many, acts, u)),
        listed.probabilities[0],
        keys(*(part[0] for part in listed.outcomes)),
    )
