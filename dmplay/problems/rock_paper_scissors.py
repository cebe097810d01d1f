"""Two players show rock, paper or scissors at once; each beats one other and loses to the third.

Source: appendix F.11; RockPaperScissors.jl. Decision: the discount is 1, as in table F.1;
`--set discount=0.9` is the book's infinite repetition.
"""

from dataclasses import dataclass

import numpy as np

from dmplay.core.spaces import Labels
from dmplay.problems.shared.matrix_game import MatrixGame

# payoffs of the row player
ROW_PAYOFFS = np.array([[0.0, -1.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 1.0, 0.0]])


@dataclass(frozen=True)
class RockPaperScissors(MatrixGame):
    """One for the winner, minus one for the loser, nothing for a draw."""

    actions = (Labels(("rock", "paper", "scissors")),) * 2
    payoffs = np.stack([ROW_PAYOFFS, ROW_PAYOFFS.T], axis=2)
