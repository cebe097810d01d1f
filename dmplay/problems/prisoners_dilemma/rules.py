"""Two prisoners choose at the same time to stay silent or to blame the other, in each round.

Source: appendix F.10; PrisonersDilemma.jl. Decision: A silent prisoner whom the other blames serves
four years, as in the book's text. `--set discount=0.9` sets the discount of the book's infinite
repetition.
"""

from dataclasses import dataclass

import numpy as np

from dmplay.core.matrix_game import MatrixGame
from dmplay.core.spaces import Labels

PRISON_YEARS = np.array([[1.0, 4.0], [0.0, 3.0]])  # served by the row player


@dataclass(frozen=True)
class PrisonersDilemma(MatrixGame):
    """Two prisoners: both silent, 1 year each; both blame, 3 each; one blames, 0 and 4 years."""

    actions = (Labels(("cooperate", "defect")),) * 2
    payoffs = np.stack([0.0 - PRISON_YEARS, 0.0 - PRISON_YEARS.T], axis=2)
