"""Figure F.14 of the book: the rewards of the prisoner's dilemma."""

from dmplay.game.plot_kinds import Figure
from dmplay.plots.payoffs import plot_payoffs

FIGURES = {"F.14": Figure("rewards of the prisoner's dilemma", plot_payoffs)}
