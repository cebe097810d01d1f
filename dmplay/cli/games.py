"""Commands that set up a game and play it."""

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from dmplay.cli import config, options
from dmplay.cli.program import program
from dmplay.errors import BadParameter
from dmplay.terminal import Wishes, here


@options.wishes()
def play(
    ctx: typer.Context,
    problem: options.Name,
    variant: options.Variant = "",
    set_: options.Set = [],  # noqa: B006 - typer reads it once
    seed: options.Seed = None,
    episode: options.Episode = 0,
    agent: options.Agent = "human",
    vs: options.Others = "",
    seat: options.Seats = [],  # noqa: B006
    turns: options.Turns = None,
    record: options.Record = None,
    frames: options.Frames = False,
    force: options.Force = False,
    reveal: options.Reveal = False,
    strict: options.Strict = False,
    quiet: options.Quiet = False,
    keys: options.Keys = None,
    speed: options.Speed = 2.0,
    rate: options.Rate = None,
    *,
    wishes: Wishes,
) -> int:
    """Play a problem, or watch agents play it.

    \b
      dmplay play hexworld --seed 7
      dmplay play prisoners-dilemma --vs grim --turns 20
      dmplay play crying-baby --agent feed-when-crying -o game.dmt
      printf 'e\\nne\\nquit\\n' | dmplay play hexworld
    """
    from dmplay.game.request import Request
    from dmplay.game.start import new

    if str(record) == "-" and not quiet:
        raise BadParameter("-o -: only with --quiet; else the game itself is told there")
    if rate and not wishes.motion:
        raise BadParameter("--rate: real time moves by itself; leave out --no-motion")
    terminal, table = here(wishes), _table(ctx)
    request = Request(
        problem, variant, set_, seed, episode, agent, vs, seat, turns, record, frames, force,
        strict, reveal, keep=ctx.obj is not None, keys=options.wanted_keys(keys),
        asks=ctx.obj is not None or terminal.asks,
    )  # fmt: skip
    table.put(new(request))
    return _sit(ctx, table, terminal, json=wishes.json, quiet=quiet, speed=speed, rate=rate)


@options.wishes()
def resume(
    ctx: typer.Context,
    file: options.LastFile = None,
    trust: options.Trust = False,
    quiet: options.Quiet = False,
    keys: options.Keys = None,
    *,
    wishes: Wishes,
) -> int:
    """Go on with a game that was left or killed.

    \b
      dmplay resume
      dmplay resume game.dmt
    """
    from dmplay.game import saves
    from dmplay.game.start import resumed

    terminal, table = here(wishes), _table(ctx)
    file = file or saves.latest_unfinished()
    asks, wanted = ctx.obj is not None or terminal.asks, options.wanted_keys(keys)
    table.put(resumed(file, trusted=trust, keys=wanted, asks=asks))
    return _sit(ctx, table, terminal, json=wishes.json, quiet=quiet)


@options.wishes()
def replay(
    ctx: typer.Context,
    file: options.File,
    trust: options.Trust = False,
    speed: options.Speed = 2.0,
    *,
    wishes: Wishes,
) -> int:
    """Watch a recorded game: Space or right steps on, Backspace back, A plays at --speed.

    \b
      dmplay replay game.dmt
      dmplay replay game.dmt --plain
    """
    from dmplay.game.playback import Playback

    terminal, table = here(wishes), _table(ctx)
    table.put(Playback(file, trusted=trust))
    return _sit(ctx, table, terminal, json=wishes.json, speed=speed)


@options.wishes()
def branch(
    ctx: typer.Context,
    file: options.File,
    at: Annotated[int, typer.Option("--at", metavar="TURN", min=0, help="the turn to go on from")],
    record: Annotated[
        Path, typer.Option("--record", "-o", metavar="FILE", help="the new transcript")
    ],
    force: Annotated[bool, typer.Option("--force", help="overwrite it")] = False,
    trust: options.Trust = False,
    quiet: options.Quiet = False,
    keys: options.Keys = None,
    *,
    wishes: Wishes,
) -> int:
    """Play on from any turn of a recorded game, into a transcript of its own.

    \b
      dmplay branch game.dmt --at 7 -o other.dmt
    """
    from dmplay.game.start import branched

    terminal, table = here(wishes), _table(ctx)
    asks, wanted = ctx.obj is not None or terminal.asks, options.wanted_keys(keys)
    table.put(branched(file, at, record, force=force, trusted=trust, keys=wanted, asks=asks))
    return _sit(ctx, table, terminal, json=wishes.json, quiet=quiet)


@options.wishes("plain", "color", "ascii", "theme", "width", "motion", "input")
def shell(
    ctx: typer.Context,
    execute: Annotated[
        list[str], typer.Option("--execute", "-e", metavar="COMMAND", help="do this and leave")
    ] = [],  # noqa: B006
    speed: options.Speed = 2.0,
    *,
    wishes: Wishes,
) -> int:
    """Play in words, one game after another; piped, a script whose first bad line ends it.

    \b
      dmplay
      dmplay shell < game.dm
      dmplay -e 'play hexworld --seed 7' -e ne -e 'hint; quit'
    """
    from dmplay.front import converse

    terminal = here(wishes)
    if not terminal.asks and not execute:
        raise BadParameter("--no-input: nobody is asked; give commands by -e or in a pipe")
    return converse(_table(ctx), terminal, execute, speed=speed)


def _table(ctx: typer.Context) -> Any:
    """The table of the shell that asks, else one with what the command line and files add to it."""
    from dmplay.game.table import Table
    from dmplay.words.commands import is_command

    if ctx.obj is not None:
        return ctx.obj
    for name in config.aliases():
        if is_command(name):
            raise BadParameter(f"aliases.{name}: {name} is a command; give another name")
    return Table(None, partial(program, ctx.find_root().command), config.aliases())


def _sit(ctx: typer.Context, table: Any, terminal: Any, **how: Any) -> int:
    """Plays the game at a table; a shell that asks for it does that itself."""
    from dmplay.front import run

    return 0 if ctx.obj is not None else run(table, terminal, **how)
