"""Commands for assignments: define games that all people play, and grade their transcripts."""

from pathlib import Path
from typing import Annotated

import typer

from dmplay.cli import options
from dmplay.cli.evaluation import CsvFlag, output_format
from dmplay.errors import BadParameter
from dmplay.terminal.capabilities import TerminalOptions


def assign(
    problem: options.ProblemName,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="file to write")],
    variant: options.VariantName = "",
    set_: options.ParameterSettings = [],  # noqa: B006 - typer reads it once
    seeds: Annotated[
        str, typer.Option(metavar="N,N", help="random seeds, one per game (default: new)")
    ] = "",
    games: Annotated[int, options.number_option(int, "number of games with new seeds", min=1)] = 1,
    agent: options.FirstSeatAgent = "human",
    vs: options.OtherAgents = "",
    seat: options.SeatAgents = [],  # noqa: B006
    turns: options.TurnLimit = None,
    force: options.Force = False,
    strict: options.Strict = False,
    strict_hints: options.StrictHints = False,
) -> object:
    """Create an assignment: the games that all players have to play.

    The file contains the problem, parameters, agents, seeds, turn limit and --strict.
    Each player types 'dmplay play --assignment FILE --player NAME' once for each game.
    Then you grade the games with 'dmplay grade PATH... --assignment FILE'.

    \b
      dmplay assign hexworld --seeds 7,8,9 --strict=hints -o walks
      dmplay assign prisoners-dilemma --vs grim --turns 20 --games 2 -o dilemma
    """
    from dmplay.core.uniforms import new_seed
    from dmplay.evaluation.assignment import write_assignment
    from dmplay.game.launch_requests import GameRequest, format_variant_name

    if seeds and not all(number.strip().isdecimal() for number in seeds.split(",")):
        raise BadParameter(f"--seeds: got {seeds!r}, expected whole numbers, such as 7,8")
    typed_seeds = map(int, seeds.split(",")) if seeds else ()
    seed_values = tuple(typed_seeds) or tuple(new_seed() for _ in range(games))
    if games not in {1, len(seed_values)}:
        raise BadParameter(
            f"--games: got {games}, but --seeds has {len(seed_values)}; leave out one option"
        )
    request = GameRequest(
        format_variant_name(problem, variant), set_, agent=agent, other_agent=vs, seats=seat,
        turns=turns, strict="hints" if strict_hints else strict,
    )  # fmt: skip
    return write_assignment(request, seed_values, output, force=force)


@options.with_terminal_options("json", "motion", motion=options.ProgressMotion)
def grade(
    paths: options.TranscriptPaths,
    assignment: options.AssignmentFile = None,
    csv: CsvFlag = False,
    meta: options.MetaFile = None,
    trust: options.TrustAssignment = False,
    *,
    terminal_options: TerminalOptions,
) -> object:
    """Grade the transcripts of games that players hand in.

    The table has one row per game. It shows the player, the return, the regret, and the
    numbers of undone turns, rerolls and hints. The regret of an action is the value of
    the best action minus the value of the chosen action. The table also marks a game that

    \b
    - does not verify,
    - differs from the assignment,
    - has the same random numbers as another game of this player, or
    - was peeked: the player looked at hidden states early.

    'dmplay guide measuring' explains what a file cannot prove. The exit code is 3 if a
    file does not verify, or a path has no transcript; the other games are graded.

    \b
      dmplay grade transcripts
      dmplay grade game.dmt --csv
    """
    from dmplay.output import grading_report

    return grading_report.report_grades(
        paths, assignment, trusted=trust, motion=terminal_options.motion,
        output_format=output_format(json=terminal_options.json, csv=csv),
    )  # fmt: skip
