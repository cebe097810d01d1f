"""The value and the best action of the simple regulator over its states."""

from dataclasses import replace

import numpy as np

from dmplay.draw.axes import Axis
from dmplay.draw.panels import LinePanel, Plot, Series, make_value_axis
from dmplay.game.plot_kinds import Figure
from dmplay.plots.plotted_problem import VALUE_LABEL, PlottedProblem

from .linear_policy_evaluation import OPTIMAL_POLICY, evaluate_policy
from .rules import SimpleRegulator

STATES = np.linspace(-2.0, 2.0, 81)
STATE_AXIS = Axis("state s", -2.0, 2.0)


def _plot_values(subject: PlottedProblem) -> Plot:
    """Return the curve of the value function of the simple regulator."""
    problem = subject.problem
    assert isinstance(problem, SimpleRegulator)
    value = evaluate_policy(problem, OPTIMAL_POLICY, subject.horizon)
    returns = np.array([value.evaluate_at(float(s)) for s in STATES])
    values = make_value_axis(VALUE_LABEL, returns)
    panel = LinePanel("", STATE_AXIS, values, [Series("", STATES, returns)])
    notes = [f"U(s) = -({value.curvature:.4g} s^2 + {value.constant:.4g})", *subject.horizon_notes]
    return Plot(f"{subject.title}: value, {subject.horizon_text}", [panel], notes=notes)


def _plot_policy(subject: PlottedProblem) -> Plot:
    """Return the line of the best action of the simple regulator, which cancels the state."""
    subject.check_no_turns("policy", "the best action is the same for every number of turns left")
    gain = OPTIMAL_POLICY.theta1
    actions = replace(STATE_AXIS, label="best action a")
    panel = LinePanel("", STATE_AXIS, actions, [Series("", STATES, gain * STATES)])
    return Plot(f"{subject.title}: best action, any horizon", [panel], notes=["a = -s"])


FIGURES = {
    "values": Figure("value of each state", _plot_values),
    "policy": Figure("best action of each state", _plot_policy),
}
