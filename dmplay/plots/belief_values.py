"""Plots of value functions and policies over the beliefs of one agent.

A belief holds the probability of each hidden state. Two states give curves over one probability,
three give a triangle.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.belief import initial_belief
from dmplay.core.problem import Problem
from dmplay.core.tabular import tabulate
from dmplay.core.text import format_count, format_score, format_upper_bound
from dmplay.draw.axes import Axis
from dmplay.draw.panels import LinePanel, Plot, Region, Series, TrianglePanel, make_value_axis
from dmplay.errors import BadParameter, UnknownName
from dmplay.plots.plotted_problem import VALUE_LABEL, PlottedProblem, format_actions
from dmplay.solvers.mdp import mdp_values
from dmplay.solvers.pomdp import exact_pomdp, fast_informed_bound
from dmplay.solvers.pomdp.exact_pomdp import AlphaVectorStage
from dmplay.solvers.pomdp.upper_envelope import compute_upper_envelope

METHODS = ("optimal", "qmdp", "fib")
METHOD_NOTES = {
    "optimal": "optimal is exact",
    "qmdp": "qmdp is an upper bound, as if the state were seen after this turn",
    "fib": "fib (fast informed bound) is an upper bound, never above qmdp",
}
VECTOR_NOTE = "thin lines: alpha vectors, the values of plans; thick line: their maximum"
ENDS_OF_LINE = np.array([0.0, 1.0])


class AlphaVectors(NamedTuple):
    """Alpha vectors: the value of a plan, or a bound on it, from each state."""

    vectors: Reals  # [N, S]
    actions: Sequence[str]  # [N], the first actions
    gap: float = 0.0  # upper bound on the error


def plot_alpha_vectors(subject: PlottedProblem, methods: Sequence[str] = METHODS[:1]) -> Plot:
    """Return the alpha vectors of one or more methods as lines over the belief.

    The upper surface of each method, which is its value of a belief, is the thick line.
    """
    _check_beliefs(subject, "alpha-vectors", (2,))
    check_methods(methods)
    results = {method: compute_alpha_vectors(subject, method) for method in methods}
    title = f"{subject.title}: alpha vectors, {subject.horizon_text}"
    start = initial_belief(subject.problem)
    start_values = [float((result.vectors @ start).max()) for result in results.values()]
    notes = [
        f"value {format_score(value)} at the start; {METHOD_NOTES[method]}"
        for method, value in zip(methods, start_values, strict=True)
    ]
    notes += _describe_gaps(results) + subject.horizon_notes
    panel = build_vector_panel(subject.problem, results)
    actions = subject.problem.actions[0].labels
    return Plot(title, [panel], notes=[VECTOR_NOTE, *notes], actions=actions)


def check_methods(methods: Sequence[str]) -> None:
    """Raise UnknownName for an unknown method, and BadParameter for one that is given twice."""
    for method in methods:
        if method not in METHODS:
            raise UnknownName("method", method, METHODS)
    if len(set(methods)) < len(methods):
        raise BadParameter(f"--methods: got {','.join(methods)}, expected each method once")


def compute_alpha_vectors(subject: PlottedProblem, method: str = "optimal") -> AlphaVectors:
    """Return the alpha vectors of a method for the turns left."""
    problem, horizon = subject.problem, subject.horizon
    if method == "optimal":
        return name_first_actions(problem, solve_stage(problem, horizon))
    compute_q = {"qmdp": compute_qmdp_bound, "fib": compute_informed_bound}[method]
    return AlphaVectors(compute_q(problem, horizon).T, problem.actions[0].labels)


def compute_qmdp_bound(problem: Problem, horizon: int | None) -> Reals:
    """Return Q `[S, A]` as if the state were seen after this turn; None: an infinite horizon."""
    tables, discount = tabulate(problem), problem.discount
    if horizon is None:
        return mdp_values.compute_optimal_q(tables, discount)
    values = mdp_values.compute_finite_horizon_values(tables, discount, horizon - 1)
    return mdp_values.compute_action_values(tables, discount, values)


def compute_informed_bound(problem: Problem, horizon: int | None) -> Reals:
    """Return the fast informed bound `[S, A]` for turns left; None: an infinite horizon."""
    if horizon is None:
        return fast_informed_bound.compute_fast_informed_bound(problem)
    return fast_informed_bound.compute_finite_horizon_bounds(problem, horizon)[-1]


def solve_stage(problem: Problem, horizon: int | None) -> AlphaVectorStage:
    """Return the exact alpha vectors for a number of turns left; None: an infinite horizon."""
    if horizon is None:
        return exact_pomdp.solve_infinite_horizon(tabulate(problem), problem.discount)
    return exact_pomdp.solve_stages(problem, horizon)[-1]


def name_first_actions(problem: Problem, stage: AlphaVectorStage) -> AlphaVectors:
    """Return the alpha vectors of a stage with the names of their first actions."""
    actions = [format_actions(problem, mask) for mask in stage.first_action_mask]
    return AlphaVectors(stage.alpha_vectors, actions, stage.gap)


def build_vector_panel(
    problem: Problem, results: dict[str, AlphaVectors], title: str = ""
) -> LinePanel:
    """Return a panel with the alpha vectors of each method, and with their upper surfaces."""
    series, shown_values = [], []
    for style, (method, result) in enumerate(results.items()):
        series += [
            Series("", ENDS_OF_LINE, vector, style=style, is_thin=True) for vector in result.vectors
        ]
        beliefs, values = find_upper_surface(result.vectors)
        series.append(Series(method, beliefs, values, style=style))
        # Of several methods, the surfaces are compared, and low vectors may leave the panel.
        shown_values.append(values if len(results) > 1 else result.vectors)
    regions = find_action_regions(next(iter(results.values())))
    first_method = next(iter(results))
    regions_title = f"regions: best first action of {first_method}" if len(results) > 1 else ""
    return LinePanel(
        title or regions_title,
        _make_belief_axis(problem),
        make_value_axis(VALUE_LABEL, *shown_values),
        series,
        regions,
    )


def find_upper_surface(vectors: Reals) -> tuple[Reals, Reals]:
    """Return the corners of the maximum of vectors `[N, 2]`: probabilities and values."""
    envelope = compute_upper_envelope(vectors)
    order = np.argsort(envelope.corner_beliefs[:, 1])
    return envelope.corner_beliefs[order, 1], envelope.corner_values[order]


def find_action_regions(result: AlphaVectors) -> list[Region]:
    """Return the intervals of the second state's probability, each with its best first action."""
    corners, _ = find_upper_surface(result.vectors)
    regions: list[Region] = []
    for low, high in zip(corners[:-1].tolist(), corners[1:].tolist(), strict=True):
        middle = (low + high) / 2
        best = int(np.argmax(result.vectors @ [1.0 - middle, middle]))
        if regions and regions[-1].label == result.actions[best]:
            regions[-1] = Region(regions[-1].label, regions[-1].low, high)
        else:
            regions.append(Region(result.actions[best], low, high))
    return regions


def plot_belief_values(subject: PlottedProblem, what: str) -> Plot:
    """Return the optimal value, or the best first action, of each belief over 2 or 3 states."""
    _check_beliefs(subject, what, (2, 3))
    result, problem = compute_alpha_vectors(subject), subject.problem
    noun = "value of each belief" if what == "values" else "best first action of each belief"
    title, notes = f"{subject.title}: {noun}, {subject.horizon_text}", _describe_gaps({"": result})
    notes += subject.horizon_notes
    actions = problem.actions[0].labels
    if problem.state_count == 3:
        panel = build_triangle_panel(problem, result, value_label=VALUE_LABEL * (what == "values"))
        return Plot(title, [panel], notes=notes, actions=actions)
    beliefs, values = find_upper_surface(result.vectors)
    line = LinePanel(
        "",
        _make_belief_axis(problem),
        make_value_axis(VALUE_LABEL, values),
        [Series("", beliefs, values)],
        find_action_regions(result),
    )
    return Plot(title, [line], notes=notes, actions=actions)


def build_triangle_panel(
    problem: Problem, result: AlphaVectors, title: str = "", value_label: str = ""
) -> TrianglePanel:
    """Return the triangle of the beliefs over three states, with the best first actions."""
    corners = [problem.format_state(s) for s in problem.enumerate_states()]
    return TrianglePanel(title, corners, result.vectors, result.actions, value_label)


def _make_belief_axis(problem: Problem) -> Axis:
    """Return the axis of the probability of the second of two states."""
    return Axis(f"P({problem.format_state(problem.enumerate_states()[1])})", 0.0, 1.0)


def _describe_gaps(results: dict[str, AlphaVectors]) -> list[str]:
    """Return a note with the error of the values, if they are not exact."""
    gaps = [result.gap for result in results.values() if result.gap]
    return [f"error of the values: at most {format_upper_bound(max(gaps))}"] if gaps else []


def _check_beliefs(subject: PlottedProblem, what: str, state_counts: tuple[int, ...]) -> None:
    """Raise BadParameter unless one agent has so many hidden states, and all actions are legal."""
    problem = subject.problem
    if len(problem.agents) > 1:
        raise subject.make_error(what, f"it has {len(problem.agents)} agents, expected 1")
    if not problem.partially_observable:
        raise subject.make_error(
            what, f"its agent sees the state; try dmplay plot values {subject.name}"
        )
    count = problem.state_count
    if not isinstance(count, int) or count not in state_counts or not problem.action_counts[0]:
        states = format_count(count, "hidden state") if isinstance(count, int) else "real numbers"
        expected = " or ".join(map(str, state_counts))
        raise subject.make_error(what, f"it has {states}, expected {expected}; try dmplay solve")
    legal = problem.legal_actions_mask(problem.enumerate_states())
    if legal is not None and not legal.all():
        raise subject.make_error(what, "its legal actions depend on the state; try dmplay solve")
