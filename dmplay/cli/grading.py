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
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="a file")],
    variant: options.VariantName = "",
    set_: options.ParameterSettings = [],  # noqa: B006 - typer reads it once
    seeds: Annotated[
        str, typer.Option("--seeds", metavar="N,N", help="the dice; new ones if not given")
    ] = "",
    games: Annotated[int, typer.Option("--games", metavar="N", min=1, help="of new dice")] = 1,
    agent: options.FirstSeatAgent = "human",
    vs: options.OtherAgents = "",
    seat: options.SeatAgents = [],  # noqa: B006
    turns: options.TurnLimit = None,
    force: options.Force = False,
    strict: options.Strict = False,
    strict_hints: options.StrictHints = False,
) -> object:
    """Write down which games people are to play: problem, parameters, dice, turns.

    They play one after another with dmplay play --assignment FILE --player NAME;
    dmplay grade --assignment FILE tells how it went.

    \b
      dmplay assign hexworld --seeds 7,8,9 --strict=hints -o walks
      dmplay assign prisoners-dilemma --vs grim --turns 20 --games 2 -o dilemma
    """
    from dmplay.core.uniforms import new_seed
    from dmplay.evaluation.assignment import write_assignment
    from dmplay.game.launch_requests import GameRequest

    if seeds and not all(number.strip().isdecimal() for number in seeds.split(",")):
        raise BadParameter(f"--seeds: got {seeds!r}, expected whole numbers, such as 7,8")
    seed_values = (
        tuple(map(int, seeds.split(","))) if seeds else tuple(new_seed() for _ in range(games))
    )
    if games not in {1, len(seed_values)}:
        raise BadParameter(f"--games: got {games}, but --seeds says how many; leave out one")
    strictness = "hints" if strict_hints else strict
    request = GameRequest(
        problem,
        variant,
        set_,
        agent=agent,
        other_agent=vs,
        seats=seat,
        turns=turns,
        strict=strictness,
    )
    return write_assignment(request, seed_values, output, force=force)


@options.with_terminal_options("json", "motion")
def grade(
    paths: options.TranscriptPaths,
    assignment: options.AssignmentFile = None,
    csv: CsvFlag = False,
    trust: options.TrustAssignment = False,
    *,
    terminal_options: TerminalOptions,
) -> object:
    """Make a table of games that were handed in: who, how well, with what help, how honest.

    What does not verify, is not as assigned, was taken back, thrown again, helped,
    looked into or played twice is told. The guide says what that cannot prove.

    \b
      dmplay grade transcripts
      dmplay grade game.dmt --csv
    """
    from dmplay.output import grading_report

    report_format = output_format(json=terminal_options.json, csv=csv)
    return grading_report.report_grades(
        paths,
        assignment,
        trusted=trust,
        output_format=report_format,
        motion=terminal_options.motion,
    )
