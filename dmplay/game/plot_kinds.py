"""The plots that dmplay draws, and the figures of the book's appendix F among them."""

from typing import NamedTuple


class PlotKind(NamedTuple):
    """A kind of plot: its help, its argument, and the options that change it."""

    help: str
    argument: str = "PROBLEM"  # or FILE
    options: frozenset[str] = frozenset()


class Figure(NamedTuple):
    """A figure of the book: its title, its problem, and whether `--turns` changes it."""

    title: str
    problem: str
    has_turns: bool = False


PLOT_KINDS = {
    "values": PlotKind(
        "value and best action of each state; value of each belief", options=frozenset({"turns"})
    ),
    "policy": PlotKind("best action of each state or belief", options=frozenset({"turns"})),
    "alpha-vectors": PlotKind(
        "alpha vectors of a problem with two hidden states",
        options=frozenset({"turns", "methods"}),
    ),
    "payoffs": PlotKind("rewards of a game of two agents, with its equilibria"),
    "returns": PlotKind(
        "returns of many games, a histogram for each agent",
        options=frozenset({"turns", "agent", "compare", "vs", "seat", "episodes", "seed"}),
    ),
    "belief": PlotKind("belief by turn, in a recorded game", "FILE"),
    "regret": PlotKind("regret of each choice, in a recorded game", "FILE"),
}
FIGURES = {
    "F.1": Figure("results of a move in hex world", "hexworld"),
    "F.2": Figure("optimal values and actions of both hex worlds", "hexworld", True),
    "F.3": Figure("a random starting state of 2048", "2048"),
    "F.4": Figure("a slide in 2048, and its new tile", "2048"),
    "F.5": Figure("a slide in 2048 that merges two tiles, with its reward", "2048"),
    "F.6": Figure("state, pushes and limits of the cart-pole", "cart-pole"),
    "F.7": Figure("valley and goal of the mountain car", "mountain-car"),
    "F.8": Figure("state variables of collision avoidance", "collision-avoidance"),
    "F.9": Figure("optimal values and advisories of collision avoidance", "collision-avoidance"),
    "F.10": Figure("value function of the crying baby", "crying-baby", True),
    "F.11": Figure("14-turn policy of machine replacement", "machine-replacement", True),
    "F.12": Figure(
        "policies of machine replacement for 1 to 20 turns", "machine-replacement", True
    ),
    "F.13": Figure("probability of a catch by distance", "catch"),
    "F.14": Figure("rewards of the prisoner's dilemma", "prisoners-dilemma"),
    "F.15": Figure("rewards of rock-paper-scissors", "rock-paper-scissors"),
    "F.16": Figure("initial state of predator-prey", "predator-prey"),
    "T.2": Figure("table F.2: the model of machine replacement", "machine-replacement"),
}
PICTURE_FORMATS = ("svg", "png", "pdf")


def find_figure_name(text: str) -> str | None:
    """Return the name of a figure from a spelling such as `f10` or `figure F.10`; else None."""
    spelled = "".join(text.split()[-1:]).replace(".", "").lower()  # '' for a blank name
    return next((name for name in FIGURES if name.replace(".", "").lower() == spelled), None)
