"""Figure F.13 of the book: the probability of a catch by distance."""

from dmplay.core.tabular import tabulate
from dmplay.draw.axes import Axis
from dmplay.draw.panels import LinePanel, Plot, Series
from dmplay.game.plot_kinds import Figure
from dmplay.plots.plotted_problem import PlottedProblem

from .rules import DISTANCES


def _draw_catch_curves(subject: PlottedProblem) -> Plot:
    """Return figure F.13: the probability of a catch by distance, for each proficiency."""
    problem = subject.problem
    expected_rewards = tabulate(problem).rewards[:, :, 0]  # the distance, if it is caught
    names = [problem.format_state(s) for s in problem.enumerate_states()]
    series = [
        Series(f"proficiency {name}", DISTANCES, rewards / DISTANCES, style=style)
        for style, (name, rewards) in enumerate(zip(names, expected_rewards, strict=True))
    ]
    x = Axis("distance of the throw (m)", float(DISTANCES[0]), float(DISTANCES[-1]))
    panel = LinePanel("", x, Axis("probability of a catch", 0.0, 1.0), series)
    notes = ["proficiency: the distance in m at which half of the throws are caught"]
    return Plot(f"{subject.title}: catches by distance", [panel], notes=notes)


FIGURES = {"F.13": Figure("probability of a catch by distance", _draw_catch_curves)}
