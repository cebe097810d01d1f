"""What the cases of both hunts ask alike: where each walker goes."""

from typing import Any

import numpy as np

from dmplay.chance import Categorical, DiscreteUniform
from dmplay.problems._hunt import HexHunt
from tests.truth_kinds.case import Case, reached


def marginals(problem: HexHunt, s: np.ndarray, a: np.ndarray) -> list[dict[Any, float]]:
    """Where each walker goes: each has one chance of its own, so the others' may be any."""
    found = []
    chances = problem.chance(s, a)
    for walker, chance in enumerate(chances):
        assert isinstance(chance, Categorical | DiscreteUniform)
        p = chance.probabilities()[0]
        events = [np.zeros(len(p), np.int64)] * len(chances)
        events[walker] = np.where(p > 0, np.arange(len(p)), 0)
        rows = np.repeat(s, len(p), axis=0), np.repeat(a, len(p), axis=0)
        after = problem.resolve_events(*rows, tuple(events)).state
        found.append(reached(p, [problem.hexes[h] for h in after[:, walker]]))
        for other in set(range(len(chances))) - {walker}:
            assert (after[:, other] == after[0, other]).all()  # independent
    return found


def moves(case: Case, problem: HexHunt, s: np.ndarray) -> None:
    """The marginals of a case, and the joint probabilities that are their products."""
    found = marginals(problem, s, np.array([case.given["actions"]]) - 1)
    for told, got in zip(case.expect["marginals"], found, strict=True):
        case.equal({tuple(hex_): p for hex_, p in told}, got)
    for told in case.expect["joint"]:
        hexes = [tuple(hex_) for hex_ in told["next"]]
        each = [one.get(hex_, 0.0) for one, hex_ in zip(found, hexes, strict=True)]
        case.equal(told["probability"], np.prod(each))
