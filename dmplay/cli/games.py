"""Commands that want a game: what was said of it, as data; whoever asked plays it."""

from pathlib import Path
from typing import Annotated

import typer

from dmplay.cli import options
from dmplay.errors import BadParameter
from dmplay.terminal import Wishes, here


@options.wishes()
def play(
    problem: options.MaybeName = "",
    variant: options.Variant = "",
    set_: options.Set = [],  # noqa: B006 - typer reads it once
    seed: options.Seed = None,
    episode: options.Episode = 0,
    agent: options.Agent = "human",
    vs: options.Others = "",
    seat: options.Seats = [],  # noqa: B006
    ghost: options.Ghost = "",
    turns: options.Turns = None,
    record: options.Record = None,
    frames: options.Frames = False,
    force: options.Force = False,
    reveal: options.Reveal = False,
    strict: options.Strict = False,
    strict_hints: options.StrictHints = False,
    quiet: options.Quiet = False,
    keys: options.Keys = None,
    speed: options.Speed = 2.0,
    rate: options.Rate = None,
    assignment: options.Assignment = None,
    player: options.Player = "",
    trust: options.Trust = False,
    *,
    wishes: Wishes,
    ctx: typer.Context,
) -> object:
    """Play a problem, or watch agents play it.

    \b
      dmplay play hexworld --seed 7
      dmplay play prisoners-dilemma --vs grim --turns 20
      dmplay play crying-baby --agent feed-when-crying -o game.dmt
      printf 'e\\nne\\nquit\\n' | dmplay play hexworld
    """
    from dmplay.game.errand import Sitting
    from dmplay.game.request import Request

    if str(record) == "-" and not quiet:
        raise BadParameter("-o -: only with --quiet; else the game itself is told there")
    timed = options.is_said(ctx, "rate")
    if timed and not wishes.motion:
        raise BadParameter("--rate: real time moves by itself; leave out --no-motion")
    how = "hints" if strict_hints else strict
    request = Request(
        problem, variant, set_, seed, episode, agent=agent, others=vs, seats=seat, ghost=ghost,
        turns=turns, record=record, frames=frames, force=force, strict=how, reveal=reveal,
        player=player, keys=options.wanted_keys(keys), asks=here(wishes).asks,
        timed=timed,
    )  # fmt: skip
    if assignment:
        from dmplay.measure.assignment import read

        request = read(assignment).request(request, trusted=trust)
    elif not problem:
        raise BadParameter("missing argument 'PROBLEM'; see dmplay play --help")
    return Sitting(request, wishes, quiet, speed, rate if wishes.motion else None)


@options.wishes()
def resume(
    file: options.LastFile = None,
    trust: options.Trust = False,
    quiet: options.Quiet = False,
    keys: options.Keys = None,
    turns: options.Unattended = None,
    ghost: options.Ghost = "",
    *,
    wishes: Wishes,
) -> object:
    """Go on with a game that was left or killed.

    \b
      dmplay resume
      dmplay resume game.dmt
    """
    from dmplay.game import saves
    from dmplay.game.errand import Sitting
    from dmplay.game.request import Resumption

    file = file or saves.latest_unfinished()
    asks = here(wishes).asks
    wanted = Resumption(file, trust, options.wanted_keys(keys), asks, turns=turns, ghost=ghost)
    return Sitting(wanted, wishes, quiet)


@options.wishes()
def replay(
    file: options.File,
    trust: options.Trust = False,
    peek: options.Peek = False,
    speed: options.Speed = 2.0,
    *,
    wishes: Wishes,
) -> object:
    """Watch a recorded game: Space or right steps on, Backspace back, P plays at --speed.

    \b
      dmplay replay game.dmt
      dmplay replay game.dmt --plain
    """
    from dmplay.game.errand import Sitting
    from dmplay.game.request import Recording

    return Sitting(Recording(file, trust, peek), wishes, speed=speed)


@options.wishes()
def branch(
    file: options.File,
    at: Annotated[int, typer.Option("--at", metavar="TURN", min=0, help="the turn to go on from")],
    record: Annotated[
        Path, typer.Option("--record", "-o", metavar="FILE", help="the new transcript")
    ],
    force: options.Force = False,
    trust: options.Trust = False,
    peek: options.Peek = False,
    quiet: options.Quiet = False,
    keys: options.Keys = None,
    *,
    wishes: Wishes,
) -> object:
    """Play on from any turn of a recorded game, into a transcript of its own.

    \b
      dmplay branch game.dmt --at 7 -o other.dmt
    """
    from dmplay.game.errand import Sitting
    from dmplay.game.request import Branching

    wanted = Branching(
        file, trust, options.wanted_keys(keys), here(wishes).asks, at, force, peek, record=record
    )
    return Sitting(wanted, wishes, quiet)


@options.wishes("plain", "color", "ascii", "theme", "width", "motion", "input")
def shell(
    execute: Annotated[
        list[str], typer.Option("--execute", "-e", metavar="COMMAND", help="do this and leave")
    ] = [],  # noqa: B006
    speed: options.Speed = 2.0,
    *,
    wishes: Wishes,
) -> object:
    """Play in words, one game after another; piped, a script whose first bad line ends it.

    \b
      dmplay shell < game.dm
      dmplay -e 'play hexworld --seed 7' -e ne -e 'hint; quit'
    """
    from dmplay.game.errand import Conversation

    if not here(wishes).asks and not execute:
        raise BadParameter("--no-input: nobody is asked; give commands by -e or in a pipe")
    return Conversation(execute, wishes, speed)


def bot(
    agent: Annotated[str, typer.Argument(metavar="AGENT", help="who plays")],
    problem: Annotated[
        str, typer.Option("--problem", "-p", metavar="PROBLEM", help="what is played")
    ],
) -> object:
    """Play in lines of JSON where another program keeps the game; dmplay guide bots tells of them.

    \b
      dmplay hexworld --agent 'bot:dmplay bot optimal --problem hexworld'
    """
    from dmplay.game.errand import Service

    return Service(agent, problem)


def mcp(
    problems: Annotated[
        list[str],
        typer.Argument(metavar="PROBLEM...", help="what may be played; all fifteen if not given"),
    ] = [],  # noqa: B006
    hints: Annotated[bool, typer.Option(help="let it ask what a good player would do")] = False,
    undo: Annotated[bool, typer.Option(help="let it take turns back")] = False,
    belief: Annotated[bool, typer.Option(help="tell it what its seat is to believe")] = False,
    seed: Annotated[
        int | None,
        typer.Option(metavar="N", min=0, max=2**63 - 1, help="the dice, a game an episode of them"),
    ] = None,
    turns: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="a game ends after so many")
    ] = None,
    folder: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FOLDER", help="for the transcripts")
    ] = None,
) -> object:
    """Have a language model play by the Model Context Protocol; dmplay guide mcp tells how.

    \b
      dmplay mcp
      dmplay mcp hexworld catch --hints --seed 7 -o games
    """
    from dmplay.game.errand import Hosting

    return Hosting(problems, hints, undo, belief, seed, turns, folder)
