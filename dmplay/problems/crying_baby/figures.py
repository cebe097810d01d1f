"""Figure F.10 of the book: the value function of the crying baby."""

from dmplay.draw.panels import Plot
from dmplay.game.plot_kinds import Figure
from dmplay.plots import belief_values
from dmplay.plots.plotted_problem import PlottedProblem, describe_horizon

VALUE_FUNCTION_TURNS = 10  # as the figure is drawn in the book


def _draw_baby_values(subject: PlottedProblem) -> Plot:
    """Return figure F.10: the value functions for ten turns and for an infinite horizon.

    The book draws the ten-turn function, but describes it as the one for the infinite horizon.
    """
    problem, panels = subject.problem, []
    for turns in [subject.turns] if subject.turns else [VALUE_FUNCTION_TURNS, None]:
        stage = belief_values.solve_stage(problem, turns)
        vectors = {"": belief_values.name_first_actions(problem, stage)}
        panels.append(belief_values.build_vector_panel(problem, vectors, describe_horizon(turns)))
    title, notes = f"{subject.title}: alpha vectors", [belief_values.VECTOR_NOTE]
    return Plot(title, panels, notes=notes, actions=problem.actions[0].labels)


FIGURES = {"F.10": Figure("value function of the crying baby", _draw_baby_values, has_turns=True)}
