"""Two travelers claim the value of a lost suitcase; both get the lower claim, which earns a bonus.

Source: appendix F.12; TravelersDilemma.jl. Decision: The traveler with the higher claim gets the
lower claim minus 2, as in equation F.11 (minus 1 in the package). `--set discount=0.9` sets the
discount of the book's infinite repetition.
"""

from dataclasses import dataclass

import numpy as np

from dmplay.core.matrix_game import MatrixGame
from dmplay.core.spaces import Labels

MIN_CLAIM, MAX_CLAIM = 2, 100  # dollars
BONUS_DOLLARS = 2  # dollars from the higher claim to the lower
CLAIMS = np.arange(MIN_CLAIM, MAX_CLAIM + 1.0)
LOWER_CLAIMS = np.minimum(CLAIMS[:, None], CLAIMS)
# dollars paid to the row player
ROW_PAYOFFS = LOWER_CLAIMS + BONUS_DOLLARS * np.sign(CLAIMS - CLAIMS[:, None])


@dataclass(frozen=True)
class TravelersDilemma(MatrixGame):
    """Both get the lower claim: plus 2 for the lower claimant, minus 2 for the higher."""

    actions = (Labels(f"{claim:.0f}" for claim in CLAIMS),) * 2
    payoffs = np.stack([ROW_PAYOFFS, ROW_PAYOFFS.T], axis=2)
