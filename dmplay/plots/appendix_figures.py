"""The figures of the book's appendix F, and table F.2.

Each is drawn by the functions that plot any problem. Settings, such as a discount, apply to all
panels of a figure.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.hexgrid import DIRECTIONS, hex_neighbours
from dmplay.core.problem import initial_state_distribution
from dmplay.core.spaces import Labels
from dmplay.core.tabular import tabulate
from dmplay.game.plot_kinds import FIGURES
from dmplay.plots import belief_values, illustrations, payoffs, state_values
from dmplay.plots.plot_data import (
    HexPanel,
    LinePanel,
    Plot,
    PlottedHex,
    Series,
    TablePanel,
)
from dmplay.plots.plotted_problem import PlottedProblem, describe_horizon, load_plotted_problem
from dmplay.problems.catch.rules import DISTANCES
from dmplay.problems.hexworld.rules import HexWorld
from dmplay.problems.predator_prey.rules import PredatorPrey
from dmplay.solvers.pomdp import exact_pomdp
from dmplay.views.toolkit.plots import Axis

CHOSEN_DIRECTION = DIRECTIONS.index("e")  # the example in figure F.1
VALUE_FUNCTION_TURNS = 10  # of figure F.10 as it is drawn in the book
POLICY_TURNS = 14  # of figure F.11
PLOTTED_TURNS = range(1, 21)  # of figure F.12


def draw_figure(name: str, settings: Sequence[str] = (), turns: int | None = None) -> Plot:
    """Return the plot of a figure, with these parameters and turns left."""
    figure = FIGURES[name]
    subject = load_plotted_problem(figure.problem, settings, turns)
    return DRAW_FUNCTIONS[name](subject)


def _draw_move_chances(subject: PlottedProblem) -> Plot:
    """Return figure F.1: the probability of each result of one move of hex world."""
    problem = subject.problem
    assert isinstance(problem, HexWorld)
    hexes = ((0, 0), *hex_neighbours((0, 0)))
    tables = tabulate(replace(problem, hexes=hexes, rewards=()))
    chances = tables.transition[0, CHOSEN_DIRECTION, : len(hexes)]
    cells = [PlottedHex((0, 0), text="start", directions=(CHOSEN_DIRECTION,))]
    cells += [
        PlottedHex(hex_, float(p), text=f"{p:.3g}")
        for hex_, p in zip(hexes[1:], chances[1:], strict=True)
    ]
    chosen = DIRECTIONS[CHOSEN_DIRECTION].upper()
    return Plot(
        f"{subject.title}: where a move to {chosen} ends",
        [HexPanel("", cells, "probability")],
        notes=["a move against the border ends where it began"],
    )


def _draw_hex_world_policies(subject: PlottedProblem) -> Plot:
    """Return figure F.2: both maps with the optimal actions and the value of every hex."""
    line = load_plotted_problem("hexworld:straight-line", subject.settings, subject.turns)
    panels = [
        state_values.build_hex_value_panel(subject, "standard map"),
        state_values.build_hex_value_panel(line, "straight line"),
    ]
    title = f"{subject.title}: values and best actions, {subject.horizon_text}"
    return Plot(title, panels)


def _draw_collision_slices(subject: PlottedProblem) -> Plot:
    """Return figure F.9: values above, advisories below, at two climb rates."""
    return state_values.plot_collision_avoidance(subject, ["values", "policy"])


def _draw_baby_values(subject: PlottedProblem) -> Plot:
    """Return figure F.10: the value functions for ten turns and for an infinite horizon.

    The book draws the ten-turn function, but describes it as the one for the infinite horizon.
    """
    panels = []
    for turns in [subject.turns] if subject.turns else [VALUE_FUNCTION_TURNS, None]:
        stage = belief_values.solve_stage(subject.problem, turns)
        vectors = {"": belief_values.name_first_actions(subject.problem, stage)}
        panels.append(
            belief_values.build_vector_panel(subject.problem, vectors, describe_horizon(turns))
        )
    return Plot(
        f"{subject.title}: alpha vectors",
        panels,
        notes=[belief_values.VECTOR_NOTE],
        actions=subject.problem.actions[0].labels,
    )


def _draw_machine_policy(subject: PlottedProblem) -> Plot:
    """Return figure F.11: the best first action of fourteen turns, over the belief triangle."""
    return belief_values.plot_belief_values(
        subject._replace(turns=subject.turns or POLICY_TURNS), "policy"
    )


def _draw_machine_policies(subject: PlottedProblem) -> Plot:
    """Return figure F.12: the best first action with one to twenty turns left."""
    problem = subject.problem
    last = subject.turns or PLOTTED_TURNS[-1]
    stages = exact_pomdp.solve_finite_horizon(tabulate(problem), problem.discount, last)
    panels = [
        belief_values.build_triangle_panel(
            problem, belief_values.name_first_actions(problem, stage), describe_horizon(turns)
        )
        for turns, stage in enumerate(stages, 1)
    ]
    title = f"{subject.title}: best first action of each belief"
    return Plot(title, panels, columns=4, actions=problem.actions[0].labels)


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


def _draw_hunt_start(subject: PlottedProblem) -> Plot:
    """Return figure F.16: the initial state of predator-prey on the standard map."""
    problem = subject.problem
    assert isinstance(problem, PredatorPrey)
    p, states = initial_state_distribution(problem)
    hunters = [problem.hexes[int(s)] for s in states[int(np.argmax(p))]]
    hunter, prey = hunters[0], hunters[1]
    cells = [
        PlottedHex(hex_, text="predator", kind="hunter")
        if hex_ == hunter
        else PlottedHex(hex_, text="prey", kind="prey")
        if hex_ == prey
        else PlottedHex(hex_)
        for hex_ in problem.hexes
    ]
    return Plot(f"{subject.title}: initial state", [HexPanel("", cells)])


def _draw_machine_tables(subject: PlottedProblem) -> Plot:
    """Return table F.2: transitions, observations and rewards of machine replacement."""
    problem, tables = subject.problem, tabulate(subject.problem)
    states = [problem.format_state(s) for s in problem.enumerate_states()]
    observations = problem.observations[0]
    assert isinstance(observations, Labels)
    columns = [
        *(f"T to {state}" for state in states),
        *(f"O {label}" for label in observations),
        "R",
    ]
    panels = [
        TablePanel(
            problem.format_action(0, a),
            "state",
            "",
            states,
            columns,
            [
                _format_numbers(
                    tables.transition[s, a], tables.observation_model[a, s], tables.rewards[s, a]
                )
                for s in range(len(states))
            ],
        )
        for a in range(tables.transition.shape[1])
    ]
    notes = ["T: probability of the next state; R: expected reward in the state of the row"]
    notes += ["O: probability of the observation if the row is the next state"]
    return Plot(f"{subject.title}: the model", panels, notes=notes)


def _format_numbers(*parts: Reals) -> list[str]:
    """Return all numbers of some rows as texts."""
    return [f"{number:.4g}" for part in parts for number in part]


DRAW_FUNCTIONS: dict[str, Callable[[PlottedProblem], Plot]] = {
    "F.1": _draw_move_chances,
    "F.2": _draw_hex_world_policies,
    "F.3": illustrations.draw_start_of_2048,
    "F.4": illustrations.draw_slide,
    "F.5": illustrations.draw_merge,
    "F.6": illustrations.draw_cart_pole,
    "F.7": illustrations.draw_valley,
    "F.8": illustrations.draw_encounter,
    "F.9": _draw_collision_slices,
    "F.10": _draw_baby_values,
    "F.11": _draw_machine_policy,
    "F.12": _draw_machine_policies,
    "F.13": _draw_catch_curves,
    "F.14": payoffs.plot_payoffs,
    "F.15": payoffs.plot_payoffs,
    "F.16": _draw_hunt_start,
    "T.2": _draw_machine_tables,
}
