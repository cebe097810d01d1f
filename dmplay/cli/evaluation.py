"""Commands that play many games: evaluate agents, compare them, and run tournaments."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from dmplay.cli import options
from dmplay.errors import BadParameter
from dmplay.terminal.capabilities import TerminalOptions, current_terminal

CsvFlag = Annotated[bool, typer.Option("--csv", help="print comma-separated values (CSV)")]
BatchSeed = Annotated[int, options.number_option(int, "random seed of all games", min=0)]
ExecutorName = Annotated[
    str,
    typer.Option(
        "--executor",
        metavar="ENGINE",
        help="run the games on several machines: dask, dask:tcp://HOST:PORT, or a Python "
        "function, as 'dmplay guide measuring' explains",
    ),
]
BATCH_OPTIONS: Mapping[str, tuple[Any, object]] = {
    "variant": (options.VariantName, ""),
    "set_": (options.ParameterSettings, []),
    "vs": (options.OtherAgents, ""),
    "seat": (options.SeatAgents, []),
    "turns": (options.TurnLimit, None),
    "seed": (BatchSeed, 0),
    "workers": (options.WorkerCount, "auto"),
    "executor": (ExecutorName, ""),
    "csv": (CsvFlag, False),
    "meta": (options.MetaFile, None),
}
OutputFormat = Literal["", "json", "csv"]


def _with_batch_options(*without: str) -> Callable[[options.Command], options.Command]:
    """Return a decorator that replaces a command's batch parameter with the batch options.

    Options named in `without` are left out.
    """
    selected = {name: option for name, option in BATCH_OPTIONS.items() if name not in without}
    return options.expand_option_group("batch_options", selected, dict)


def _make_evaluation_request(
    problem: str,
    batch_options: Mapping[str, Any],
    terminal_options: TerminalOptions,
    agent: str = "",
) -> Any:
    """Return the request for a problem, with the batch options by parameter; '' is no agent."""
    from dmplay.game.launch_requests import format_variant_name
    from dmplay.output.evaluation_request import EvaluationRequest

    return EvaluationRequest(
        format_variant_name(problem, batch_options["variant"]),
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
@options.with_terminal_options("json", "motion", "ascii", motion=options.ProgressMotion)
def run(
    problem: options.ProblemName,
    agent: options.BatchAgent = "",
    episodes: Annotated[
        int | None, options.number_option(int, "number of games (default: 10000)", min=1)
    ] = None,
    until_se: Annotated[
        float | None, options.number_option(float, "play until every standard error is at most X")
    ] = None,
    regret: Annotated[
        bool, typer.Option("--regret", help="report what the choices of each seat lost")
    ] = False,
    record: Annotated[
        Path | None, typer.Option(metavar="DIR", help="folder for transcripts of selected games")
    ] = None,
    every: Annotated[int, options.number_option(int, "record every Nth game; 0: none", min=0)] = 0,
    worst: Annotated[int, options.number_option(int, "record the N worst games", min=0)] = 0,
    best: Annotated[int, options.number_option(int, "record the N best games", min=0)] = 0,
    *,
    batch_options: Mapping[str, Any],
    terminal_options: TerminalOptions,
) -> object:
    """Play many games, and report the scores of each seat.

    The return of a game is the sum of its rewards. In a problem with a discount, later
    rewards count less. The report shows the mean return, its standard error, and the
    distribution of the returns. The same seed gives the same games on every machine,
    with any number of workers.

    A parameter can have several values: a list such as slip=0.1,0.2 or a range such as
    slip=0:0.5:0.1, which includes its end. In this case, dmplay plays the games once for
    each value. If several parameters have several values, dmplay plays the games for
    each combination. The name of an agent can contain ranges, too.

    \b
      dmplay run hexworld --agent optimal
      dmplay run hexworld --set slip=0.1,0.2,0.3 --until-se 0.01
      dmplay run crying-baby --agent feed-when-crying --regret
      dmplay run machine-replacement --agent threshold:repair=0.5:2:0.5
      dmplay run 2048 --agent corner --episodes 200 --record games --worst 2
      dmplay run prisoners-dilemma --agent grim --vs tit-for-tat --turns 20 --json
    """
    from dmplay.output import evaluation_report
    from dmplay.output.selected_episode_recording import TranscriptSelection

    return evaluation_report.report_run(
        _make_evaluation_request(problem, batch_options, terminal_options, agent),
        episodes=episodes,
        max_standard_error=until_se,
        regret=regret,
        selection=TranscriptSelection(record, every, worst, best),
        ascii_=current_terminal(terminal_options).ascii,
    )


@_with_batch_options("variant", "seat", "vs")
@options.with_terminal_options("json", "motion", "width", motion=options.ProgressMotion)
def evaluate(
    agent: Annotated[str, typer.Argument(metavar="AGENT", help="agent, or a transcript or folder")],
    problems: Annotated[
        list[str] | None, typer.Argument(metavar="PROBLEM...", help="or more transcripts")
    ] = None,
    episodes: Annotated[
        int, options.number_option(int, "number of games in each problem", min=1)
    ] = 100,
    seat: options.EvaluatedSeat = [],  # noqa: B006 - Typer copies it
    vs: options.AgentsOfOtherSeats = "",
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FOLDER", help="folder for the transcripts"),
    ] = None,
    games: Annotated[bool, typer.Option("--games", help="print a row for each game")] = False,
    trust: options.Trust = False,
    *,
    batch_options: Mapping[str, Any],
    terminal_options: TerminalOptions,
    ctx: typer.Context,
) -> object:
    """Show what seeing, choosing and luck cost a player.

    The agent plays one seat of each problem, by default the first. With transcripts
    instead, dmplay evaluates the recorded games of people, language models and programs.

    \b
    - start value: the expected return of best play
    - seeing: the loss of the best action for the belief that the player stated,
      which may differ from the belief that the observations give
    - choosing: the loss of the chosen action, compared with that action
    - luck: the rest; its mean is near 0 in many games

    The return is the start value, minus seeing, minus choosing, plus luck. Without a
    stated belief, the whole loss counts as choosing. 'dmplay guide measuring' explains
    the table. As in 'dmplay run', a parameter can have several values.

    \b
      dmplay evaluate feed-when-crying crying-baby --episodes 50
      dmplay evaluate random hexworld --set slip=0:0.4:0.2
      dmplay evaluate random predator-prey --seat prey --vs chase
      dmplay evaluate random crying-baby hexworld -o games
      dmplay evaluate transcripts --csv
    """
    from dmplay.output.player_evaluation_report import EvaluationCommand, report_evaluation

    seats = [item for item in seat if "=" in item]
    values = {**batch_options, "variant": "", "seat": seats, "vs": vs}
    names_of_games = ("episodes", "set_", "vs", "turns", "seed", "output", "executor")
    command = EvaluationCommand(
        _make_evaluation_request("", values, terminal_options, agent),
        (agent, *(problems or ())),
        tuple(item for item in seat if "=" not in item),
        episodes,
        output,
        trusted=trust,
        typed_options=tuple(
            name.strip("_")
            for name in names_of_games
            if options.option_source(ctx, name) == "COMMANDLINE"
        ),
    )
    return report_evaluation(command, current_terminal(terminal_options), lists_games=games)


@_with_batch_options()
@options.with_terminal_options("json", "motion", motion=options.ProgressMotion)
def compare(
    problem: options.ProblemName,
    agents: Annotated[list[str], typer.Argument(metavar="AGENT...", help="two or more agents")],
    episodes: Annotated[
        int, options.number_option(int, "number of games; with --decide, the maximum", min=1)
    ] = 10_000,
    decide: Annotated[
        float | None,
        options.number_option(
            float,
            "stop when it is clear which agent earns more; P: largest probability of an error",
            metavar="P",
        ),
    ] = None,
    bounds: Annotated[
        str,
        typer.Option(
            metavar="LOW,HIGH",
            help="smallest and largest possible return; needed if --decide cannot compute them",
        ),
    ] = "",
    asymptotic: Annotated[
        bool,
        typer.Option(
            "--asymptotic",
            help="let --decide work without --bounds; after few games, it may be wrong with a "
            "probability above P",
        ),
    ] = False,
    *,
    batch_options: Mapping[str, Any],
    terminal_options: TerminalOptions,
) -> object:
    """Compare agents on the same random numbers.

    Each agent plays the same games in the first seat. The report shows the mean return
    of each agent. For each pair of agents, it also shows the difference, with its
    standard error and confidence interval. If a parameter has several values, as in
    'dmplay run', the agents are compared for each value.

    \b
      dmplay compare hexworld optimal search --episodes 1000
      dmplay compare machine-replacement threshold:repair=0.5:2:0.5
      dmplay compare crying-baby optimal feed-when-crying --decide 0.05
    """
    from dmplay.output import evaluation_report

    request = _make_evaluation_request(problem, batch_options, terminal_options)
    rule = evaluation_report.DecisionOptions(decide, bounds, asymptotic)
    return evaluation_report.report_comparison(request, agents, rule, episodes=episodes)


@_with_batch_options("vs", "seat")
@options.with_terminal_options("json", "motion", motion=options.ProgressMotion)
def tournament(
    problem: options.ProblemName,
    entrants: Annotated[list[str], typer.Argument(metavar="AGENT...", help="two or more agents")],
    episodes: Annotated[
        int, options.number_option(int, "number of games per seating", min=1)
    ] = 1000,
    seats: Annotated[
        str,
        typer.Option(
            metavar="ORDER",
            help="all: play every order of the agents; given: only the order of the command line",
        ),
    ] = "all",
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="results file; if you stop, the same command continues from it",
        ),
    ] = None,
    *,
    batch_options: Mapping[str, Any],
    terminal_options: TerminalOptions,
) -> object:
    """Let every agent play every agent on the same random numbers.

    Every agent plays against every agent, also against itself, in every order of the
    seats. The report shows the mean returns and the best reply to each agent.

    The report also treats its table as a game: each player chooses an agent, and earns
    what this agent earns. It shows an equilibrium of this game, in which no player
    gains by changing only its own choice. The regret of an agent is the best possible
    return against that equilibrium, minus the return of this agent.

    With '--seats given', each combination is played in one order only, and the report
    shows only the mean returns.

    \b
      dmplay tournament prisoners-dilemma grim tit-for-tat always-defect --turns 5
      dmplay tournament rock-paper-scissors nash random beat-last --json
    """
    from dmplay.output import tournament_report

    request = _make_evaluation_request(problem, batch_options, terminal_options)
    return tournament_report.report_tournament(
        request, entrants, episodes=episodes, orders=seats, results_file=output
    )


def output_format(*, json: bool, csv: bool) -> OutputFormat:
    """Return the output format, "" for text; raise BadParameter for both flags."""
    if json and csv:
        raise BadParameter("--json and --csv: expected only one of them")
    return "json" if json else "csv" if csv else ""
