"""The command `dmplay plot`: the plot that is asked for, in the terminal or in a file."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dmplay.core.safe_files import write_bytes
from dmplay.core.text import align_columns, escape_newlines
from dmplay.core.work_budget import report_progress_to
from dmplay.draw.panels import Plot
from dmplay.errors import BadParameter, UnknownName
from dmplay.game.command_line_results import Printout
from dmplay.game.launch_requests import ReplayRequest, format_variant_name
from dmplay.game.plot_kinds import (
    PICTURE_FORMATS,
    PLOT_KINDS,
    find_figure_name,
    list_book_figures,
    load_figures,
)
from dmplay.output.evaluation_request import EvaluationRequest
from dmplay.output.provenance import add_to_picture
from dmplay.registry.problems import is_problem_name
from dmplay.terminal.capabilities import Terminal
from dmplay.terminal.progress import ProgressBar

if TYPE_CHECKING:
    from dmplay.plots.plotted_problem import PlottedProblem

DEFAULT_EPISODES = 1000
OPTION_NAMES = ("turns", "methods", "agent", "compare", "vs", "seat", "episodes", "seed")


@dataclass(frozen=True)
class PlotRequest:
    """A plot that is asked for: its name, its problem or file, and its options."""

    what: str
    subject: str = ""  # a problem or a file
    variant: str = ""
    settings: Sequence[str] = ()
    # the options that only some plots have; None or empty: not given
    turns: int | None = None
    methods: str = ""
    agent: str = ""
    compare: str = ""
    vs: str = ""
    seat: Sequence[str] = ()
    episodes: int | None = None
    seed: int | None = None
    trusted: bool = False
    peek: bool = False
    motion: bool = True


def report_plot(
    request: PlotRequest, output: Path | None, terminal: Terminal, *, force: bool = False
) -> Printout:
    """Return the plot as text, or write it to a picture; raise BadParameter for other files."""
    if output is None:
        from dmplay.draw.plot_text import draw_plot

        return Printout(draw_plot(build_plot(request), terminal.columns), paged=True)
    from dmplay.plots.picture_files import check_matplotlib, render_picture

    extension = output.suffix[1:].lower()
    if extension not in PICTURE_FORMATS:
        expected = ", ".join(f".{name}" for name in PICTURE_FORMATS)
        raise BadParameter(f"-o {output}: expected a file name that ends in one of {expected}")
    check_matplotlib(extension)  # before a plot that may take long to compute
    picture = add_to_picture(render_picture(build_plot(request), extension), extension)
    write_bytes(output, [picture], force=force)
    return Printout(escape_newlines(f"wrote {output}"))


def build_plot(request: PlotRequest) -> Plot:
    """Return the plot of a request; raise an error for an unknown plot or a useless option."""
    task = f"plotting {request.what} {request.subject}".rstrip()
    with ProgressBar(task, motion=request.motion) as bar, report_progress_to(bar):
        kind = PLOT_KINDS.get(request.what)
        if kind is None:
            return _build_figure(request)
        if not request.subject:
            raise BadParameter(
                f"plot {request.what}: expected a {kind.argument}, "
                f"such as dmplay plot {kind.example}"
            )
        _check_options(request, kind.options)
        if kind.argument == "FILE":
            return _build_game_plot(request)
        if request.what == "returns":
            return _build_returns_plot(request, bar)
        return _build_problem_plot(request)


def _check_options(request: PlotRequest, used: frozenset[str]) -> None:
    """Raise BadParameter for an option that is given but has no effect."""
    for name in OPTION_NAMES:
        if name not in used and getattr(request, name) not in (None, "", [], ()):
            raise BadParameter(f"--{name}: has no effect on plot {request.what}")


def _build_figure(request: PlotRequest) -> Plot:
    """Return a figure that a problem's code defines; that of a figure of the book is known."""
    from dmplay.plots.plotted_problem import call_figure_function

    book_figures = list_book_figures()
    book_name = find_figure_name(request.what, book_figures)
    problem_name = request.subject or (book_figures[book_name].problem if book_name else "")
    if not problem_name:
        raise _make_unknown_plot_error(request.what, [*book_figures])
    subject = _load_requested_problem(request, problem_name)
    figures = load_figures(subject.problem)
    name = find_figure_name(request.what, figures)
    if name is None and book_name:
        book_problem = book_figures[book_name].problem
        raise BadParameter(
            f"plot {book_name}: got {request.subject}; the figure is about {book_problem}"
        )
    if name is None:
        raise _make_unknown_plot_error(request.what, [*book_figures, *figures])
    _check_options(request, frozenset({"turns"}) if figures[name].has_turns else frozenset())
    return call_figure_function(subject, name, figures[name])


def _make_unknown_plot_error(name: str, figures: Sequence[str]) -> BadParameter | UnknownName:
    """Return the error for a name that is no plot, and may be that of a problem."""
    if is_problem_name(name):
        return BadParameter(f"plot: {name} is a problem; try dmplay plot values {name}")
    return UnknownName("plot", name, [*PLOT_KINDS, *figures])


def _load_requested_problem(request: PlotRequest, name: str) -> "PlottedProblem":
    """Return the problem of a request with its variant, its settings and its turns."""
    from dmplay.plots.plotted_problem import load_plotted_problem

    problem_name = format_variant_name(name, request.variant)
    return load_plotted_problem(problem_name, request.settings, request.turns)


def _build_game_plot(request: PlotRequest) -> Plot:
    """Return the plot of a recorded game; raise BadParameter if parameters are set."""
    from dmplay.plots.played_games import plot_belief_path, plot_regret

    if request.settings or request.variant:
        raise BadParameter(f"--set and --variant: have no effect on {request.what} of a game")
    recording = ReplayRequest(Path(request.subject), request.trusted, request.peek)
    return plot_belief_path(recording) if request.what == "belief" else plot_regret(recording)


def _build_problem_plot(request: PlotRequest) -> Plot:
    """Return the plot of a problem's values, policy, alpha vectors or payoffs."""
    from dmplay.plots import belief_values, payoffs, state_values
    from dmplay.plots.plotted_problem import call_figure_function

    subject = _load_requested_problem(request, request.subject)
    figure = load_figures(subject.problem).get(request.what)
    if figure:
        return call_figure_function(subject, request.what, figure)
    if request.what == "payoffs":
        return payoffs.plot_payoffs(subject)
    if request.what == "alpha-vectors":
        methods = (request.methods or "optimal").split(",")
        return belief_values.plot_alpha_vectors(subject, methods)
    if subject.problem.partially_observable:
        return belief_values.plot_belief_values(subject, request.what)
    return state_values.plot_states(subject, request.what)


def _build_returns_plot(request: PlotRequest, bar: ProgressBar) -> Plot:
    """Return the histograms of the returns of many games."""
    from dmplay.plots.returns import plot_returns

    evaluation_request = EvaluationRequest(
        format_variant_name(request.subject, request.variant),
        request.settings,
        request.agent,
        other_agent=request.vs,
        seats=request.seat,
        turn_limit=request.turns,
        seed=request.seed or 0,
    )
    compared = [name for name in request.compare.split(",") if name]
    episodes = request.episodes or DEFAULT_EPISODES
    return plot_returns(evaluation_request, compared, episodes, bar.subtask)


def format_plot_list() -> str:
    """Return every kind of plot and every figure, one per line."""
    kinds = [[f"{name} {kind.argument}", kind.help] for name, kind in PLOT_KINDS.items()]
    figures = [[name, figure.title] for name, figure in list_book_figures().items()]
    rows = align_columns([*kinds, *figures])
    return "\n".join(
        [
            "Plots, with dmplay plot NAME:",
            *(f"  {row}" for row in rows[: len(kinds)]),
            "",
            "Figures of the book's appendix F:",
            *(f"  {row}" for row in rows[len(kinds) :]),
            "",
            "-o FILE.svg, FILE.png or FILE.pdf writes a picture.",
        ]
    )
