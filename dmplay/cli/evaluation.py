"""Commands that play many games: evaluate agents, compare them, and run tournaments."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from dmplay.cli import options
from dmplay.errors import BadParameter
from dmplay.terminal.capabilities import TerminalOptions, current_terminal

EpisodeCount = Annotated[int, typer.Option("--episodes", metavar="N", min=1, help="games")]
CsvFlag = Annotated[bool, typer.Option("--csv", help="as comma-separated values")]
BatchSeed = Annotated[int, typer.Option("--seed", metavar="N", min=0, help="the dice of all games")]
ExecutorName = Annotated[
    str,
    typer.Option(
        "--executor",
        metavar="ENGINE",
        help="dask, dask:tcp://HOST:PORT, MODULE:FACTORY, ./FILE.py:FACTORY",
    ),
]
BATCH_OPTIONS: Mapping[str, tuple[Any, object]] = {
    "variant": (options.VariantName, ""),
    "set_": (options.ParameterSettings, []),
    "vs": (options.OtherAgents, ""),
    "seat": (options.SeatAgents, []),
    "turns": (options.UnattendedTurnLimit, None),
    "seed": (BatchSeed, 0),
    "workers": (options.WorkerCount, "auto"),
    "executor": (ExecutorName, ""),
    "csv": (CsvFlag, False),
}
OutputFormat = Literal["", "json", "csv"]


def _with_batch_options(*without: str) -> Callable[[options.Command], options.Command]:
    """Return a decorator that replaces a command's batch parameter with the batch options.

    Options named in `without` are left out.
    """
    selected = {name: option for name, option in BATCH_OPTIONS.items() if name not in without}
    return options.expand_option_group("batch_options", selected, lambda values: values)


def _make_request(
    problem: str,
    batch_options: Mapping[str, Any],
    terminal_options: TerminalOptions,
    agent: str = "",
) -> Any:
    """Return the evaluation request for a problem and the values of the batch options."""
    from dmplay.game.launch_requests import GameRequest
    from dmplay.output.evaluation_request import EvaluationRequest

    return EvaluationRequest(
        GameRequest(problem, batch_options["variant"]).problem_name,
        batch_options["set_"],
        agent,
        other_agent=batch_options.get("vs", ""),
        seats=batch_options.get("seat", ()),
        turn_limit=batch_options["turns"],
        seed=batch_options["seed"],
        workers=options.parse_workers(batch_options["workers"]),
        engine=batch_options["executor"],
        output_format=output_format(json=terminal_options.json, csv=batch_options["csv"]),
        motion=terminal_options.motion,
    )


@_with_batch_options()
@options.with_terminal_options("json", "motion", "ascii")
def run(
    problem: options.ProblemName,
    agent: options.FirstSeatAgent = "",
    episodes: Annotated[
        int | None,
        typer.Option("--episodes", metavar="N", min=1, help="games; 10000 unless it is said"),
    ] = None,
    until_se: Annotated[
        float | None, typer.Option("--until-se", metavar="X", help="until errors are so small")
    ] = None,
    record: Annotated[
        Path | None, typer.Option("--record", metavar="DIR", help="keeps some as transcripts")
    ] = None,
    every: Annotated[
        int, typer.Option("--every", metavar="N", min=0, help="of them, each Nth")
    ] = 0,
    worst: Annotated[int, typer.Option("--worst", metavar="N", min=0, help="the N worst")] = 0,
    best: Annotated[int, typer.Option("--best", metavar="N", min=0, help="the N best")] = 0,
    *,
    batch_options: Mapping[str, Any],
    terminal_options: TerminalOptions,
) -> object:
    """Play many games: what each seat earns, how sure that is, and how it is spread.

    A list of numbers for a parameter is a sweep. The dice are those of --seed, 0 if
    not given: the same games on every machine, whatever the workers.

    \b
      dmplay run hexworld --agent optimal
      dmplay run hexworld --set slip=0.1,0.2,0.3 --until-se 0.01
      dmplay run 2048 --agent corner --episodes 200 --record games --worst 2 --best 2
      dmplay run prisoners-dilemma --agent grim --vs tit-for-tat --turns 20 --json
    """
    from dmplay.output import evaluation_report
    from dmplay.output.selected_episode_recording import TranscriptSelection

    request = _make_request(problem, batch_options, terminal_options, agent)
    selection = TranscriptSelection(record, every, worst, best)
    return evaluation_report.report_run(
        request,
        episodes=episodes,
        max_standard_error=until_se,
        selection=selection,
        ascii_=current_terminal(terminal_options).ascii,
    )


@_with_batch_options()
@options.with_terminal_options("json", "motion")
def compare(
    problem: options.ProblemName,
    agents: Annotated[list[str], typer.Argument(metavar="AGENT...", help="two or more agents")],
    episodes: EpisodeCount = 10_000,
    decide: Annotated[
        float | None,
        typer.Option("--decide", metavar="P", help="stop when it is clear, wrong in at most P"),
    ] = None,
    *,
    batch_options: Mapping[str, Any],
    terminal_options: TerminalOptions,
) -> object:
    """Compare agents in the first seat on the same dice: who earns more, and how sure that is.

    \b
      dmplay compare hexworld optimal search --episodes 1000
      dmplay compare crying-baby optimal feed-when-crying --decide 0.05
    """
    from dmplay.output import evaluation_report

    request = _make_request(problem, batch_options, terminal_options)
    return evaluation_report.report_comparison(request, agents, episodes=episodes, decide=decide)


@_with_batch_options("vs", "seat")
@options.with_terminal_options("json", "motion")
def tournament(
    problem: options.ProblemName,
    entrants: Annotated[list[str], typer.Argument(metavar="AGENT...", help="two or more agents")],
    episodes: EpisodeCount = 1000,
    seats: Annotated[
        str, typer.Option("--seats", metavar="ORDER", help="all, or given: as they are named")
    ] = "all",
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="keeps what is played, to go on with"),
    ] = None,
    *,
    batch_options: Mapping[str, Any],
    terminal_options: TerminalOptions,
) -> object:
    """Seat everybody against everybody, in every order, on the same dice.

    The cross table, who replies best to whom, the equilibrium of the game in which
    an action is an entrant, and what each loses in it: of --seats given, where nobody
    sits behind whoever is named later, only the first.

    \b
      dmplay tournament prisoners-dilemma grim tit-for-tat always-defect --turns 50
      dmplay tournament rock-paper-scissors nash random beat-last --json
    """
    from dmplay.output import tournament_report

    request = _make_request(problem, batch_options, terminal_options)
    return tournament_report.report_tournament(
        request, entrants, episodes=episodes, orders=seats, results_file=output
    )


def output_format(*, json: bool, csv: bool) -> OutputFormat:
    """Return the output format: "json", "csv", or "" for text; raise BadParameter for both
    flags.
    """
    if json and csv:
        raise BadParameter("--json and --csv: expected one of them")
    return "json" if json else "csv" if csv else ""
