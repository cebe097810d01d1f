"""Two prisoners choose at once to stay silent or to blame the other, round after round.

Source: appendix F.10; PrisonersDilemma.jl. Decision: the silent one who is blamed serves four
years, as the text has it. `--set discount=0.9` is the book's infinite repetition.
"""

from dataclasses import dataclass

import numpy as np

from dmplay.core.spaces import Labels
from dmplay.problems.shared.matrix_game import MatrixGame

PRISON_YEARS = np.array([[1.0, 4.0], [0.0, 3.0]])  # served by the row player


@dataclass(frozen=True)
class PrisonersDilemma(MatrixGame):
    """Both silent: one year each; both blaming: three each; one blamed alone: four."""

    actions = (Labels(("cooperate", "defect")),) * 2
    payoffs = np.stack([0.0 - PRISON_YEARS, 0.0 - PRISON_YEARS.T], axis=2)
