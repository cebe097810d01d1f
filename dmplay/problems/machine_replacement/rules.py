"""Examine, repair or replace a machine of two components, whose failures are hidden.

Source: appendix F.8, table F.2; MachineReplacement.jl. Decisions: The reward is R(s, a) of table
F.2, which is an expectation over the product. Only `examine` can observe a defective product, as
the book's text says. The machine starts with no failed component, because the book gives no start.
A replaced component has no salvage value.
"""

from dataclasses import dataclass

import numpy as np

from dmplay.core.spaces import Labels
from dmplay.core.tabular import Tables, Tabular

WEAR_PROBABILITIES = [[0.81, 0.18, 0.01], [0.0, 0.9, 0.1], [0.0, 0.0, 1.0]]
REPAIR_PROBABILITIES = [[1.0, 0.0, 0.0]] * 3
UNEXAMINED_OBSERVATION = [[1.0, 0.0]] * 3
EXAMINED_OBSERVATION = [[1.0, 0.0], [0.5, 0.5], [0.25, 0.75]]
REWARDS = [[0.9025, 0.475, 0.25], [0.6525, 0.225, 0.0], [-0.5, -1.5, -2.5], [-2.0] * 3]


@dataclass(frozen=True)
class MachineReplacement(Tabular):
    """Production by a machine with none, one or two of its components failed."""

    actions = (Labels(("manufacture", "examine", "interrupt", "replace")),)
    observations = (Labels(("nondefective", "defective")),)
    state_count = 3  # 0, 1 or 2 failed components
    state_names = ("0", "1", "2")
    horizon, is_finite_horizon = 20, True
    initial_belief = np.array([1.0, 0.0, 0.0])
    tables = Tables(
        np.array([WEAR_PROBABILITIES] * 2 + [REPAIR_PROBABILITIES] * 2).transpose(1, 0, 2),
        np.array(REWARDS).T[:, :, None],
        np.array([UNEXAMINED_OBSERVATION, EXAMINED_OBSERVATION, *[UNEXAMINED_OBSERVATION] * 2]),
    )
