"""The command `dmplay plot`: the plot that is asked for, in the terminal or in a file."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from dmplay.core.safe_files import write_bytes
from dmplay.core.text import align_columns, escape_newlines
from dmplay.core.work_budget import report_progress_to
from dmplay.errors import BadParameter, UnknownName
from dmplay.game.command_line_results import Printout
from dmplay.game.launch_requests import GameRequest, ReplayRequest
from dmplay.game.plot_kinds import FIGURES, PICTURE_FORMATS, PLOT_KINDS, find_figure_name
from dmplay.output.evaluation_request import EvaluationRequest
from dmplay.output.progress import ProgressBar
from dmplay.plots.plot_data import Plot
from dmplay.registry.problems import is_problem_name
from dmplay.terminal.capabilities import Terminal

DEFAULT_EPISODES = 1000
OPTION_NAMES = ("turns", "methods", "agent", "compare", "vs", "seat", "episodes", "seed")
EXAMPLE_SUBJECTS = {"alpha-vectors": "crying-baby", "payoffs": "prisoners-dilemma"}


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
    """Return the plot as text, or write it to a picture file."""
    if output is None:
        from dmplay.plots.terminal_drawing import draw_plot

        return Printout(draw_plot(build_plot(request), terminal.columns), paged=True)
    from dmplay.plots.picture_files import check_matplotlib, render_picture

    file_format = _choose_picture_format(output)
    check_matplotlib()  # before a plot that may take long to compute
    write_bytes(output, [render_picture(build_plot(request), file_format)], force=force)
    return Printout(escape_newlines(f"wrote {output}"))


def _choose_picture_format(output: Path) -> str:
    """Return the format of a picture file by its extension; raise BadParameter for others."""
    extension = output.suffix[1:].lower()
    if extension not in PICTURE_FORMATS:
        expected = ", ".join(f".{name}" for name in PICTURE_FORMATS)
        raise BadParameter(f"-o {output}: expected a file name that ends in one of {expected}")
    return extension


def build_plot(request: PlotRequest) -> Plot:
    """Return the plot of a request; raise an error for an unknown plot or a useless option."""
    task = f"plotting {request.what} {request.subject}".rstrip()
    with ProgressBar(task, motion=request.motion) as bar, report_progress_to(bar):
        figure = find_figure_name(request.what)
        if figure:
            return _build_figure(figure, request)
        if request.what not in PLOT_KINDS:
            if is_problem_name(request.what):
                example = f"dmplay plot values {request.what}"
                raise BadParameter(f"plot: {request.what} is a problem; try {example}")
            raise UnknownName("plot", request.what, [*PLOT_KINDS, *FIGURES])
        kind = PLOT_KINDS[request.what]
        if not request.subject:
            usual = "hexworld" if kind.argument == "PROBLEM" else "game.dmt"
            example = EXAMPLE_SUBJECTS.get(request.what, usual)
            raise BadParameter(
                f"plot {request.what}: expected a {kind.argument}, "
                f"such as dmplay plot {request.what} {example}"
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


def _build_figure(name: str, request: PlotRequest) -> Plot:
    """Return the plot of a figure of the book."""
    figure = FIGURES[name]
    if request.subject:
        raise BadParameter(
            f"plot {name}: got {request.subject}; the figure is about {figure.problem}"
        )
    _check_options(request, frozenset({"turns"}) if figure.has_turns else frozenset())
    from dmplay.plots.appendix_figures import draw_figure

    return draw_figure(name, request.settings, request.turns)


def _build_game_plot(request: PlotRequest) -> Plot:
    """Return the plot of a recorded game."""
    from dmplay.plots.played_games import plot_belief_path, plot_regret

    if request.settings or request.variant:
        raise BadParameter(f"--set and --variant: have no effect on {request.what} of a game")
    recording = ReplayRequest(Path(request.subject), request.trusted, request.peek)
    return plot_belief_path(recording) if request.what == "belief" else plot_regret(recording)


def _build_problem_plot(request: PlotRequest) -> Plot:
    """Return the plot of a problem's values, policy, alpha vectors or payoffs."""
    from dmplay.plots import belief_values, payoffs, state_values
    from dmplay.plots.plotted_problem import load_plotted_problem

    name = GameRequest(request.subject, request.variant).problem_name
    subject = load_plotted_problem(name, request.settings, request.turns)
    if request.what == "payoffs":
        return payoffs.plot_payoffs(subject)
    if request.what == "alpha-vectors":
        methods = (request.methods or "optimal").split(",")
        return belief_values.plot_alpha_vectors(subject, methods)
    if subject.problem.partially_observable:
        return belief_values.plot_belief_values(subject, request.what)
    plot_states = {"values": state_values.plot_values, "policy": state_values.plot_policy}
    return plot_states[request.what](subject)


def _build_returns_plot(request: PlotRequest, bar: ProgressBar) -> Plot:
    """Return the histograms of the returns of many games."""
    from dmplay.plots.returns import plot_returns

    evaluation_request = EvaluationRequest(
        GameRequest(request.subject, request.variant).problem_name,
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
    figures = [[name, figure.title] for name, figure in FIGURES.items()]
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
