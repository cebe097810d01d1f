"""The command that trains an agent."""

from pathlib import Path
from typing import Annotated

import typer

from dmplay.cli import options
from dmplay.cli.evaluation import CsvFlag, output_format
from dmplay.errors import BadParameter
from dmplay.game.completion import name_lists
from dmplay.terminal.capabilities import TerminalOptions, current_terminal


@options.with_terminal_options("json", "motion", "ascii", motion=options.ProgressMotion)
def train(
    algorithm: Annotated[
        str,
        options.argument(
            "ALGORITHM",
            "algorithm, or ALGORITHM:PARAMETER=VALUE,... (default: list them)",
            name_lists.list_learners,
        ),
    ] = "",
    problem: Annotated[
        str,
        options.argument(
            "PROBLEM", "problem: NAME, NAME:VARIANT, FILE or FOLDER/", name_lists.complete_problems
        ),
    ] = "",
    variant: options.VariantName = "",
    set_: options.ParameterSettings = [],  # noqa: B006 - typer reads it once
    seeds: Annotated[int, options.number_option(int, "number of training runs", min=1)] = 10,
    seed: Annotated[int, options.number_option(int, "seed of the first run", min=0)] = 0,
    steps: Annotated[
        int | None, options.number_option(int, "turns of each run (default: 300000)", min=1)
    ] = None,
    episodes: Annotated[
        int | None, options.number_option(int, "games of each run, instead of turns", min=1)
    ] = None,
    eval_every: Annotated[
        int | None,
        options.number_option(
            int, "turns or games between evaluations (default: a tenth of the run)", min=1
        ),
    ] = None,
    eval_games: Annotated[
        int,
        options.number_option(
            int, "games of an evaluation, if it cannot be computed exactly", min=1
        ),
    ] = 1000,
    continued: Annotated[
        Path | None,
        typer.Option("--continue", metavar="FILE", help="file of a learned agent to train further"),
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="learn from turns of 'dmplay data', or from transcripts"),
    ] = None,
    csv: CsvFlag = False,
    output: options.OutputPath = None,
    force: options.Force = False,
    *,
    terminal_options: TerminalOptions,
) -> object:
    """Train an agent, and show how it improves.

    Each run begins with another seed. At each evaluation, dmplay shows the interquartile
    mean of the runs: the mean of the middle half. Its interval comes from a bootstrap,
    as in the library rliable. If the states of the problem can be listed, the expected
    return is exact. Otherwise it is the mean of games, which are the same for all runs.

    The option -o writes the best agent to a file. It plays as learned:FILE. Ctrl-C ends
    the training and keeps the results.

    With --data, the agent learns from recorded turns and plays no games.

    \b
      dmplay train
      dmplay train q-learning hexworld --seeds 3 --steps 20000
      dmplay train cross-entropy cart-pole:gym --seeds 1 --csv
      dmplay train sarsa:alpha=0.1 hexworld --set slip=0.1 --seeds 1 --steps 5000
    """
    from dmplay.game.command_line_results import Printout
    from dmplay.game.launch_requests import format_variant_name
    from dmplay.output.training_report import TrainingRequest, report_learners, report_training

    if not algorithm and continued is None:
        return Printout(report_learners(json=terminal_options.json))
    if bool(problem) == (continued is not None):
        raise BadParameter("train: expected an algorithm and a problem, or --continue FILE")
    return report_training(
        TrainingRequest(
            algorithm,
            format_variant_name(problem, variant),
            set_,
            seeds,
            seed,
            steps,
            episodes,
            eval_every,
            eval_games,
            continued,
            data,
            output,
            force,
            output_format(json=terminal_options.json, csv=csv),
            terminal_options.motion,
            current_terminal(terminal_options).ascii,
        )
    )


def data(
    problem: options.ProblemName,
    variant: options.VariantName = "",
    set_: options.ParameterSettings = [],  # noqa: B006 - typer reads it once
    agent: options.BatchAgent = "random",
    rows: Annotated[
        int, options.number_option(int, "number of turns", min=1, max=2_000_000)
    ] = 1000,
    seed: Annotated[int, options.number_option(int, "random seed of all games", min=0)] = 0,
    output: options.OutputPath = None,
    force: options.Force = False,
) -> object:
    """Write turns of an agent as training data.

    The file is for 'dmplay train --data'. A row has the game, the state s, the action a,
    the reward r, the next state s', and 1 if the game is done. If the state is hidden,
    o and o' are observations instead.

    \b
      dmplay data hexworld --rows 500
      dmplay data crying-baby --agent feed-when-crying --rows 100
    """
    from dmplay.game.launch_requests import format_variant_name
    from dmplay.output.training_report import report_turn_data

    name = format_variant_name(problem, variant)
    return report_turn_data(name, set_, agent, rows, seed, output, force=force)
