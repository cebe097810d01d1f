"""Figures F.11 and F.12 and table F.2 of the book: policies and the model."""

import numpy as np

from dmplay.core.spaces import Labels
from dmplay.core.tabular import tabulate
from dmplay.draw.panels import Plot, TablePanel
from dmplay.game.plot_kinds import Figure
from dmplay.plots import belief_values
from dmplay.plots.plotted_problem import PlottedProblem, describe_horizon
from dmplay.solvers.pomdp import exact_pomdp

POLICY_TURNS = 14  # of figure F.11
PLOTTED_TURNS = range(1, 21)  # of figure F.12


def _draw_machine_policy(subject: PlottedProblem) -> Plot:
    """Return figure F.11: the best first action of fourteen turns, over the belief triangle."""
    return belief_values.plot_belief_values(
        subject._replace(turns=subject.turns or POLICY_TURNS), "policy"
    )


def _draw_machine_policies(subject: PlottedProblem) -> Plot:
    """Return figure F.12: the best first action with one to twenty turns left."""
    problem = subject.problem
    last = subject.turns or PLOTTED_TURNS[-1]
    stages = exact_pomdp.solve_stages(problem, last)
    panels = []
    for turns, stage in enumerate(stages, 1):
        vectors, title = belief_values.name_first_actions(problem, stage), describe_horizon(turns)
        panels.append(belief_values.build_triangle_panel(problem, vectors, title))
    title = f"{subject.title}: best first action of each belief"
    return Plot(title, panels, columns=4, actions=problem.actions[0].labels)


def _draw_machine_tables(subject: PlottedProblem) -> Plot:
    """Return table F.2: transitions, observations and rewards of machine replacement."""
    problem, tables = subject.problem, tabulate(subject.problem)
    states = [problem.format_state(s) for s in problem.enumerate_states()]
    observations = problem.observations[0]
    assert isinstance(observations, Labels)
    columns = [*(f"T to {state}" for state in states), *(f"O {label}" for label in observations)]
    panels = []
    for a in range(tables.transition.shape[1]):
        model = [tables.transition[:, a], tables.observation_model[a], tables.rewards[:, a]]
        cells = [[f"{number:.4g}" for number in row] for row in np.hstack(model)]
        name = problem.format_action(0, a)
        panels.append(TablePanel(name, "state", "", states, [*columns, "R"], cells))
    notes = ["T: probability of the next state; R: expected reward in the state of the row"]
    notes += ["O: probability of the observation if the row is the next state"]
    return Plot(f"{subject.title}: the model", panels, notes=notes)


FIGURES = {
    "F.11": Figure("14-turn policy of machine replacement", _draw_machine_policy, has_turns=True),
    "F.12": Figure(
        "policies of machine replacement for 1 to 20 turns", _draw_machine_policies, has_turns=True
    ),
    "T.2": Figure("table F.2: the model of machine replacement", _draw_machine_tables),
}
