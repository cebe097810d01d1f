"""A problem to plot, with the facts that titles name: its settings and the turns left."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.problem import Problem
from dmplay.core.text import format_count
from dmplay.core.uniforms import NATURE_STREAM, generate_uniforms
from dmplay.draw.panels import Plot
from dmplay.draw.plot_text import MAX_COLUMNS, draw_plot
from dmplay.errors import BadParameter
from dmplay.evaluation.solutions.options import DEFAULT_TURNS
from dmplay.game.launch_requests import parse_settings
from dmplay.game.plot_kinds import Figure
from dmplay.registry.problem_module_exports import locate_export
from dmplay.registry.problems import resolve_problem

VALUE_LABEL = "expected return"
FIGURE_SEED = 11  # of the random starts that figures show


class PlottedProblem(NamedTuple):
    """A problem with its name, its settings and the number of turns that is asked for."""

    problem: Problem
    name: str
    settings: Sequence[str] = ()  # NAME=VALUE
    turns: int | None = None  # None: those of the game

    @property
    def title(self) -> str:
        """The name and the settings that differ from the default."""
        return f"{self.name} ({', '.join(self.settings)})" if self.settings else self.name

    @property
    def horizon(self) -> int | None:
        """The number of turns left; None for an infinite horizon.

        It is the number asked for. By default it is infinite if there is a discount, or else the
        number of turns of a game, as in `dmplay solve`.
        """
        if self.turns or self.problem.discount < 1.0:
            return self.turns
        return self.problem.horizon or DEFAULT_TURNS

    @property
    def horizon_text(self) -> str:
        """The number of turns left as text."""
        return describe_horizon(self.horizon)

    @property
    def horizon_notes(self) -> list[str]:
        """A note that a game is shorter, if the horizon is infinite but the game's own is not."""
        turns = self.problem.horizon
        if self.horizon is not None or turns is None:
            return []
        return [f"a game has at most {format_count(turns, 'turn')}; --turns {turns} plots those"]

    def make_error(self, what: str, reason: str) -> BadParameter:
        """Return the error for a plot that does not fit this problem."""
        return BadParameter(f"{what} does not fit {self.name}: {reason}")

    def check_no_turns(self, what: str, reason: str) -> None:
        """Raise BadParameter if a number of turns was asked for."""
        if self.turns is not None:
            raise BadParameter(f"--turns: has no effect on {what} of {self.name}; {reason}")


def call_figure_function(subject: PlottedProblem, name: str, figure: Figure) -> Plot:
    """Return a figure; raise BadParameter if its function returns no plot that can be drawn."""
    plot = figure.draw(subject)
    try:
        if isinstance(plot, Plot):
            draw_plot(plot, MAX_COLUMNS)
            return plot
        fault = f"got {plot!r}, expected a Plot"
    except Exception as error:
        got = f"got a Plot that cannot be drawn ({type(error).__name__}: {error})"
        fault = f"{got}, expected panels as in dmplay guide plotting"
    raise BadParameter(f"{locate_export(subject.problem, 'FIGURES')}: {name}: {fault}")


def sample_start(problem: Problem) -> Array:
    """Return the initial state of the game with the seed FIGURE_SEED."""
    count = problem.uniform_counts.start
    u = generate_uniforms(FIGURE_SEED, NATURE_STREAM, 0, rows=1, count=count)
    return problem.sample_initial_states(u)[0]  # type: ignore[no-any-return]


def describe_horizon(turns: int | None) -> str:
    """Return a number of turns as text; None stands for an infinite horizon."""
    return "infinite horizon" if turns is None else f"{format_count(turns, 'turn')} left"


def load_plotted_problem(
    name: str, settings: Sequence[str] = (), turns: int | None = None
) -> PlottedProblem:
    """Return the problem of a name or file, with these parameters."""
    loaded = resolve_problem(name, parse_settings(settings, "--set"))
    shown_settings = [f"{key}={_format_setting(value)}" for key, value in loaded.parameters.items()]
    return PlottedProblem(loaded.problem, loaded.name, shown_settings, turns)


def _format_setting(value: object) -> str:
    """Return the value of a parameter for a title; long ones are shortened."""
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 20 else "..."


def format_actions(problem: Problem, marked_actions: Bools, seat: int = 0) -> str:
    """Return the names of the marked actions, joined by "or"."""
    labels = problem.actions[seat].labels
    return " or ".join(labels[a] for a in np.flatnonzero(marked_actions))


def mask_illegal_actions(problem: Problem, q: Reals) -> Reals:
    """Return Q `[S, A]` of every state, with -inf for illegal actions.

    A state without a legal action is terminal and keeps its values.
    """
    legal = problem.legal_actions_mask(problem.enumerate_states())
    if legal is None:
        return q
    return np.where(legal[:, 0] | ~legal[:, 0].any(axis=1, keepdims=True), q, -np.inf)
