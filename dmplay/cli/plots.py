"""The CLI command that plots values, policies, games and the figures of the book."""

from pathlib import Path
from typing import Annotated

import typer

from dmplay.cli import options
from dmplay.errors import BadParameter
from dmplay.game.completion import name_lists
from dmplay.terminal.capabilities import TerminalOptions, current_terminal


def _complete_subjects(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return the transcripts, or else the problems, that the typed plot may be about."""
    if ctx.params.get("what") in ("belief", "regret"):
        return name_lists.complete_transcripts(incomplete)
    return name_lists.complete_problems(incomplete)


@options.with_terminal_options(
    "color", "ascii", "theme", "width", "motion", motion=options.ProgressMotion
)
def plot(
    what: Annotated[
        str,
        options.argument(
            "WHAT",
            "what to plot, such as values or F.11 (default: list all plots)",
            name_lists.list_plots,
        ),
    ] = "",
    problem: Annotated[
        str, options.argument("PROBLEM|FILE", "problem or transcript file", _complete_subjects)
    ] = "",
    variant: options.VariantName = "",
    set_: options.ParameterSettings = [],  # noqa: B006 - typer reads it once
    turns: Annotated[
        int | None,
        options.number_option(
            int, "number of turns left; with returns: maximum number of turns per game", min=1
        ),
    ] = None,
    methods: Annotated[
        str,
        typer.Option(
            metavar="NAME,...",
            help="with alpha-vectors: optimal, or the approximations qmdp and fib",
        ),
    ] = "",
    agent: options.BatchAgent = "",
    compare: Annotated[
        str, typer.Option(metavar="AGENT,...", help="with returns: more agents for the first seat")
    ] = "",
    vs: options.OtherAgents = "",
    seat: options.SeatAgents = [],  # noqa: B006 - typer reads it once
    episodes: Annotated[
        int | None, options.number_option(int, "number of games (default: 1000)", min=1)
    ] = None,
    seed: Annotated[
        int | None, options.number_option(int, "random seed of all games (default: 0)", min=0)
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FILE", help="picture to write: FILE.svg, .png or .pdf"
        ),
    ] = None,
    force: options.Force = False,
    trust: options.Trust = False,
    peek: options.Peek = False,
    *,
    terminal_options: TerminalOptions,
) -> object:
    """Plot values, policies, games and the figures of the book.

    dmplay draws the plot in the terminal. With -o FILE.svg, FILE.png or FILE.pdf, it
    writes a picture for slides instead. Pictures need the extra 'plot'.

    \b
    - An alpha vector lists the value of one plan for each hidden state.
    - A belief is the probability of each hidden state.
    - The regret of an action is the expected return of the best action minus the
      expected return of this action.

    \b
      dmplay plot                          list all plots and figures
      dmplay plot values hexworld --set slip=0.2 -o values.pdf
      dmplay plot policy mountain-car
      dmplay plot alpha-vectors crying-baby --methods optimal,qmdp,fib --turns 3
      dmplay plot payoffs prisoners-dilemma
      dmplay plot returns catch --agent optimal --compare random --episodes 200
      dmplay plot belief game.dmt
      dmplay plot F.11
    """
    from dmplay.plots.report import PlotRequest, format_plot_list, report_plot

    if not what:
        if output:
            raise BadParameter("plot: -o needs a plot, such as F.2; dmplay plot lists them")
        return format_plot_list()
    request = PlotRequest(
        what, problem, variant, set_, turns, methods, agent, compare, vs, seat, episodes, seed,
        trusted=trust, peek=peek, motion=terminal_options.motion,
    )  # fmt: skip
    terminal = current_terminal(terminal_options)
    return report_plot(request, output, terminal, force=force)._replace(
        terminal_options=terminal_options
    )
