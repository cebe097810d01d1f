"""Checks of walkers' moves, for the cases of both hunts."""

from typing import Any

import numpy as np

from dmplay.core.chance import Categorical, DiscreteUniform
from dmplay.problems._shared.hex_hunt import HexHunt
from tests.truth_cases.case import Case, sum_probabilities


def compute_marginals(problem: HexHunt, s: np.ndarray, a: np.ndarray) -> list[dict[Any, float]]:
    """Return the distribution of each walker's next hex.

    Each walker has one chance, independent of all others, whose events may be arbitrary.
    """
    distributions = []
    chances = problem.chance(s, a)
    for walker, chance in enumerate(chances):
        assert isinstance(chance, Categorical | DiscreteUniform)
        p = chance.probabilities()[0]
        events = [np.zeros(len(p), np.int64)] * len(chances)
        events[walker] = np.where(p > 0, np.arange(len(p)), 0)
        rows = np.repeat(s, len(p), axis=0), np.repeat(a, len(p), axis=0)
        after = problem.resolve_events(*rows, tuple(events)).state
        distributions.append(sum_probabilities(p, [problem.hexes[h] for h in after[:, walker]]))
        for other in set(range(len(chances))) - {walker}:
            assert (after[:, other] == after[0, other]).all()  # independent
    return distributions


def check_moves(case: Case, problem: HexHunt, s: np.ndarray) -> None:
    """Check the marginals of a case, and the joint probabilities as their products."""
    distributions = compute_marginals(problem, s, np.array([case.inputs["actions"]]) - 1)
    for expected, marginal in zip(case.expect["marginals"], distributions, strict=True):
        case.equal({tuple(hex_): p for hex_, p in expected}, marginal)
    for expected in case.expect["joint"]:
        hexes = [tuple(hex_) for hex_ in expected["next"]]
        factors = [
            distribution.get(hex_, 0.0)
            for distribution, hex_ in zip(distributions, hexes, strict=True)
        ]
        case.equal(expected["probability"], np.prod(factors))
