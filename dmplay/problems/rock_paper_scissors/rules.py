"""Two players choose rock, paper or scissors at the same time; each beats one of the others.

Source: appendix F.11; RockPaperScissors.jl. Decision: The discount is 1, as in table F.1. `--set
discount=0.9` sets the discount of the book's infinite repetition.
"""

from dataclasses import dataclass

import numpy as np

from dmplay.core.matrix_game import MatrixGame
from dmplay.core.spaces import Labels

# payoffs of the row player
ROW_PAYOFFS = np.array([[0.0, -1.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 1.0, 0.0]])


@dataclass(frozen=True)
class RockPaperScissors(MatrixGame):
    """A game that pays the winner 1 and the loser -1, and 0 for a draw."""

    actions = (Labels(("rock", "paper", "scissors")),) * 2
    payoffs = np.stack([ROW_PAYOFFS, ROW_PAYOFFS.T], axis=2)
