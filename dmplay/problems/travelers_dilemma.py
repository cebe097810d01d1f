"""Two travelers claim the value of a lost suitcase; the lower claim is paid, with a bonus.

Source: appendix F.12; TravelersDilemma.jl. Decision: the higher claim is paid the lower one less 2,
as in equation F.11 (the package: less 1). `--set discount=0.9` is an infinite repetition.
"""

from dataclasses import dataclass

import numpy as np

from dmplay.core.spaces import Labels
from dmplay.problems.shared.matrix_game import MatrixGame

MIN_CLAIM, MAX_CLAIM = 2, 100  # dollars
BONUS_DOLLARS = 2  # dollars from the higher claim to the lower
CLAIMS = np.arange(MIN_CLAIM, MAX_CLAIM + 1.0)
LOWER_CLAIMS = np.minimum(CLAIMS[:, None], CLAIMS)
# dollars paid to the row player
ROW_PAYOFFS = LOWER_CLAIMS + BONUS_DOLLARS * np.sign(CLAIMS - CLAIMS[:, None])


@dataclass(frozen=True)
class TravelersDilemma(MatrixGame):
    """Both are paid the lower claim, its author 2 more and the other 2 less."""

    actions = (Labels(f"{claim:.0f}" for claim in CLAIMS),) * 2
    payoffs = np.stack([ROW_PAYOFFS, ROW_PAYOFFS.T], axis=2)
