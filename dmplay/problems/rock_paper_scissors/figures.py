"""Figure F.15 of the book: the rewards of rock-paper-scissors."""

from dmplay.game.plot_kinds import Figure
from dmplay.plots.payoffs import plot_payoffs

FIGURES = {"F.15": Figure("rewards of rock-paper-scissors", plot_payoffs)}
