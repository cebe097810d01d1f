"""Commands on what people hand in: games that all are to play, and a table of those played."""

from pathlib import Path
from typing import Annotated

import typer

from dmplay.cli import options
from dmplay.cli.measuring import Csv, form_of
from dmplay.errors import BadParameter
from dmplay.terminal import Wishes


def assign(
    problem: options.Name,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="a file")],
    variant: options.Variant = "",
    set_: options.Set = [],  # noqa: B006 - typer reads it once
    seeds: Annotated[
        str, typer.Option("--seeds", metavar="N,N", help="the dice; new ones if not given")
    ] = "",
    games: Annotated[int, typer.Option("--games", metavar="N", min=1, help="of new dice")] = 1,
    agent: options.Agent = "human",
    vs: options.Others = "",
    seat: options.Seats = [],  # noqa: B006
    turns: options.Turns = None,
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
    from dmplay.dice import fresh
    from dmplay.game.request import Request
    from dmplay.measure.assignment import assigned

    if seeds and not all(one.strip().isdecimal() for one in seeds.split(",")):
        raise BadParameter(f"--seeds: got {seeds!r}, expected whole numbers, such as 7,8")
    dice = tuple(map(int, seeds.split(","))) if seeds else tuple(fresh() for _ in range(games))
    if games not in {1, len(dice)}:
        raise BadParameter(f"--games: got {games}, but --seeds says how many; leave out one")
    how = "hints" if strict_hints else strict
    request = Request(
        problem, variant, set_, agent=agent, others=vs, seats=seat, turns=turns, strict=how
    )
    return assigned(request, dice, output, force=force)


@options.wishes("json", "motion")
def grade(
    paths: options.Paths,
    assignment: options.Assignment = None,
    csv: Csv = False,
    trust: options.Trust = False,
    *,
    wishes: Wishes,
) -> object:
    """Make a table of games that were handed in: who, how well, with what help, how honest.

    What does not verify, is not as assigned, was taken back, thrown again, helped,
    looked into or played twice is told. The guide says what that cannot prove.

    \b
      dmplay grade transcripts
      dmplay grade game.dmt --csv
    """
    from dmplay.reports import grading

    form = form_of(json=wishes.json, csv=csv)
    return grading.graded(paths, assignment, trusted=trust, form=form, motion=wishes.motion)
