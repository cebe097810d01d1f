"""The value and the best action of the simple regulator over its states."""

import numpy as np

from dmplay.game.plot_kinds import Figure
from dmplay.plots.plot_data import LinePanel, Plot, Series, make_value_axis
from dmplay.plots.plotted_problem import VALUE_LABEL, PlottedProblem
from dmplay.views.toolkit.plots import Axis

from . import linear_policy_evaluation
from .rules import SimpleRegulator

STATES = np.linspace(-2.0, 2.0, 81)


def _plot_values(subject: PlottedProblem) -> Plot:
    """Return the curve of the value function of the simple regulator."""
    problem, policy = subject.problem, linear_policy_evaluation.OPTIMAL_POLICY
    assert isinstance(problem, SimpleRegulator)
    value = (
        linear_policy_evaluation.evaluate_infinite_horizon(problem, policy)
        if subject.horizon is None
        else linear_policy_evaluation.evaluate_finite_horizon(problem, policy, subject.horizon)
    )
    returns = np.array([value.evaluate_at(float(s)) for s in STATES])
    panel = LinePanel(
        "",
        Axis("state s", float(STATES[0]), float(STATES[-1])),
        make_value_axis(VALUE_LABEL, returns),
        [Series("", STATES, returns)],
    )
    notes = [f"U(s) = -({value.curvature:.4g} s^2 + {value.constant:.4g})", *subject.horizon_notes]
    return Plot(f"{subject.title}: value, {subject.horizon_text}", [panel], notes=notes)


def _plot_policy(subject: PlottedProblem) -> Plot:
    """Return the line of the best action of the simple regulator, which cancels the state."""
    subject.refuse_turns("policy", "the best action is the same for every number of turns left")
    gain = linear_policy_evaluation.OPTIMAL_POLICY.theta1
    low, high = float(STATES[0]), float(STATES[-1])
    panel = LinePanel(
        "",
        Axis("state s", low, high),
        Axis("best action a", low, high),
        [Series("", STATES, gain * STATES)],
    )
    return Plot(f"{subject.title}: best action, any horizon", [panel], notes=["a = -s"])


FIGURES = {
    "values": Figure("value of each state", _plot_values),
    "policy": Figure("best action of each state", _plot_policy),
}
