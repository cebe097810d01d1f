"""The command line: parse, call, print."""

import contextlib
import io
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, cast

os.environ.setdefault("TYPER_USE_RICH", "0")  # its help costs more than the rest of the start

import typer

from dmplay import config
from dmplay.errors import BadParameter, DmplayError
from dmplay.group import Commands, rejoined
from dmplay.options import (
    Agent,
    Ascii,
    Color,
    Figure,
    File,
    Json,
    Keys,
    Kind,
    LastFile,
    Name,
    Others,
    Paths,
    Plain,
    Quiet,
    Seats,
    Seed,
    Set,
    Speed,
    Theme,
    Trust,
    Variant,
)  # fmt: skip

USAGE: type[Exception] = typer.BadParameter.__mro__[1]  # click's, wherever typer keeps it
COMPLETING = "_DMPLAY_COMPLETE"  # set by a shell that asks what can follow
USAGE_CODE, MISMATCH_CODE, INTERRUPT_CODE = 2, 3, 130


app = typer.Typer(
    cls=Commands,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "auto_envvar_prefix": "DMPLAY"},
    help="""Play the decision problems of Algorithms for Decision Making in a terminal.

\b
  dmplay hexworld                        play hex world
  dmplay 2048 --seed 7 -o game.dmt       the same dice again, recorded
  dmplay verify game.dmt                 check a recording to the last number
  dmplay crying-baby --agent random      watch an agent
  dmplay list                            all problems
  dmplay                                 type commands, one game after another

'dmplay PROBLEM' is short for 'dmplay play PROBLEM'.""",
)


configuration = typer.Typer(
    rich_markup_mode=None,
    help="""Settings: flags over DMPLAY_... variables over ./dmplay.toml over your config.toml.

\b
  dmplay config show
  dmplay config path""",
)
app.add_typer(configuration, name="config")


def _table(ctx: typer.Context) -> Any:
    """The table of the shell that asks, else one with what the command line and files add to it."""
    from dmplay.shell.commands import is_command
    from dmplay.shell.table import Table

    if ctx.obj is not None:
        return ctx.obj
    for name in config.aliases():
        if is_command(name):
            raise BadParameter(f"aliases.{name}: {name} is a command; give another name")
    return Table(None, program, config.aliases())


def _sit(ctx: typer.Context, table: Any, terminal: Any, **how: Any) -> int:
    """Plays the game at a table; a shell that asks for it does that itself."""
    from dmplay.shell.front import run

    return 0 if ctx.obj is not None else run(table, terminal, **how)


def _keys(preset: str) -> Any:
    """The keys that are wanted: a preset, and those of the files."""
    from dmplay.shell.keymap import Keys

    return Keys(preset, config.keys())


@app.command()
def play(
    ctx: typer.Context,
    problem: Name,
    variant: Variant = "",
    set_: Set = [],  # noqa: B006 - typer reads it once
    seed: Seed = None,
    episode: Annotated[int, typer.Option("--episode", min=0, help="which game of the seed")] = 0,
    agent: Agent = "human",
    vs: Others = "",
    seat: Seats = [],  # noqa: B006
    turns: Annotated[
        int | None, typer.Option("--turns", help="the game ends after so many")
    ] = None,
    record: Annotated[
        Path | None, typer.Option("--record", "-o", help="write a transcript")
    ] = None,
    frames: Annotated[bool, typer.Option("--frames", help="boards in the transcript too")] = False,
    force: Annotated[bool, typer.Option("--force", help="overwrite the transcript")] = False,
    reveal: Annotated[bool, typer.Option("--reveal", help="show the hidden state")] = False,
    strict: Annotated[bool, typer.Option("--strict", help="no undo, no reroll")] = False,
    plain: Plain = False,
    json: Json = False,
    quiet: Quiet = False,
    color: Color = "auto",
    ascii_: Ascii = False,
    keys: Keys = "",
    theme: Theme = "default",
    speed: Speed = 2.0,
    rate: Annotated[
        float | None,
        typer.Option("--rate", min=0.1, max=1000, help="real time: turns a second, 50 if bare"),
    ] = None,
) -> int:
    """Play a problem, or watch agents play it.

    \b
      dmplay play hexworld --seed 7
      dmplay play prisoners-dilemma --vs grim --turns 20
      dmplay play crying-baby --agent feed-when-crying -o game.dmt
      printf 'e\\nne\\nquit\\n' | dmplay play hexworld
    """
    from dmplay.shell.request import Request
    from dmplay.shell.start import new
    from dmplay.shell.terminal import Wishes, here

    if str(record) == "-" and not quiet:
        raise BadParameter("-o -: only with --quiet; else the game itself is told there")
    terminal, table = here(Wishes(plain, json, color, ascii_, theme)), _table(ctx)
    request = Request(
        problem, variant, set_, seed, episode, agent, vs, seat, turns, record, frames, force,
        strict, reveal, keep=ctx.obj is not None, keys=_keys(keys),
    )  # fmt: skip
    table.put(new(request))
    return _sit(ctx, table, terminal, json=json, quiet=quiet, speed=speed, rate=rate)


@app.command()
def resume(
    ctx: typer.Context,
    file: LastFile = None,
    trust: Trust = False,
    plain: Plain = False,
    json: Json = False,
    quiet: Quiet = False,
    color: Color = "auto",
    ascii_: Ascii = False,
    keys: Keys = "",
    theme: Theme = "default",
) -> int:
    """Go on with a game that was left or killed.

    \b
      dmplay resume
      dmplay resume game.dmt
    """
    from dmplay.shell import saves
    from dmplay.shell.start import resumed
    from dmplay.shell.terminal import Wishes, here

    terminal, table = here(Wishes(plain, json, color, ascii_, theme)), _table(ctx)
    file = file or saves.latest_unfinished()
    table.put(resumed(file, trusted=trust, keys=_keys(keys)))
    return _sit(ctx, table, terminal, json=json, quiet=quiet)


@app.command()
def replay(
    ctx: typer.Context,
    file: File,
    trust: Trust = False,
    plain: Plain = False,
    json: Json = False,
    color: Color = "auto",
    ascii_: Ascii = False,
    theme: Theme = "default",
    speed: Speed = 2.0,
) -> int:
    """Watch a recorded game: Space or right steps on, Backspace back, A plays at --speed.

    \b
      dmplay replay game.dmt
      dmplay replay game.dmt --plain
    """
    from dmplay.shell.start import Playback
    from dmplay.shell.terminal import Wishes, here

    terminal, table = here(Wishes(plain, json, color, ascii_, theme)), _table(ctx)
    table.put(Playback(file, trusted=trust))
    return _sit(ctx, table, terminal, json=json, speed=speed)


@app.command()
def shell(
    ctx: typer.Context,
    execute: Annotated[
        list[str], typer.Option("--execute", "-e", metavar="COMMAND", help="do this and leave")
    ] = [],  # noqa: B006
    plain: Plain = False,
    color: Color = "auto",
    ascii_: Ascii = False,
    theme: Theme = "default",
    speed: Speed = 2.0,
) -> int:
    """Play in words, one game after another; piped, a script whose first bad line ends it.

    \b
      dmplay
      dmplay shell < game.dm
      dmplay -e 'play hexworld --seed 7' -e ne -e 'hint; quit'
    """
    from dmplay.shell.front import converse
    from dmplay.shell.terminal import Wishes, here

    terminal = here(Wishes(plain, color=color, ascii=ascii_, theme=theme))
    return converse(_table(ctx), terminal, execute, speed=speed)


@app.command()
def verify(
    paths: Paths,
    update: Annotated[bool, typer.Option("--update", help="show the diff and rewrite")] = False,
    allow_unfinished: Annotated[
        bool, typer.Option("--allow-unfinished", help="a file without an end is no fault")
    ] = False,
    trust: Trust = False,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Check transcripts: facts against a replay, inputs against seed and agents; 3 if one differs.

    \b
      dmplay verify game.dmt
      dmplay verify transcripts
      dmplay verify transcripts --update
    """
    from dmplay.shell import checking

    files = list(checking.files(paths))
    if update:
        checking.print_updates(files, trusted=trust)
    reports = [checking.check(file, trusted=trust) for file in files]
    good = [report.ok or (allow_unfinished and report.unfinished) for report in reports]
    checking.print_reports(reports, good, json=json, quiet=quiet)
    return 0 if all(good) else MISMATCH_CODE


@app.command()
def export(
    file: File,
    svg: Annotated[bool, typer.Option("--svg", help="a picture of the screen")] = False,
    film: Annotated[bool, typer.Option("--film", help="an animated picture")] = False,
    html: Annotated[bool, typer.Option("--html", help="a page with the screen")] = False,
    cast: Annotated[bool, typer.Option("--cast", help="a recording, asciicast v2")] = False,
    text: Annotated[bool, typer.Option("--text", help="every screen as text")] = False,
    csv: Annotated[bool, typer.Option("--csv", help="a row a turn")] = False,
    json: Annotated[bool, typer.Option("--json", help="the game as one object")] = False,
    at: Annotated[int | None, typer.Option("--at", help="the turn of a picture")] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="a file")] = None,
    trust: Trust = False,
) -> None:
    """Write a recorded game as a picture, a screen recording, text, a table or data.

    \b
      dmplay export game.dmt --svg -o game.svg
      dmplay export game.dmt --film -o film.svg
      dmplay export game.dmt --csv
    """
    from dmplay.shell.export import FORMATS, write
    from dmplay.shell.start import Playback

    wanted = {
        "svg": svg, "film": film, "html": html, "cast": cast, "text": text, "csv": csv,
        "json": json,
    }  # fmt: skip
    chosen = [name for name, wish in wanted.items() if wish]
    if len(chosen) != 1:
        raise BadParameter(f"export: choose one of {', '.join(f'--{name}' for name in wanted)}")
    write(output, FORMATS[chosen[0]](Playback(file, trusted=trust), at))


@app.command()
def review(
    file: File,
    write: Annotated[bool, typer.Option("--write", help="keep it in the file as notes")] = False,
    trust: Trust = False,
    json: Json = False,
) -> None:
    """Value each move of the people in a game: the best action, and the regret.

    \b
      dmplay review game.dmt
      dmplay review game.dmt --write
    """
    from dmplay.shell.review import print_review

    print_review(file, write=write, json=json, trusted=trust)


@app.command()
def branch(
    ctx: typer.Context,
    file: File,
    at: Annotated[int, typer.Option("--at", min=0, help="the turn to go on from")],
    record: Annotated[Path, typer.Option("--record", "-o", help="the new transcript")],
    force: Annotated[bool, typer.Option("--force", help="overwrite it")] = False,
    trust: Trust = False,
    plain: Plain = False,
    json: Json = False,
    quiet: Quiet = False,
    color: Color = "auto",
    ascii_: Ascii = False,
    keys: Keys = "",
    theme: Theme = "default",
) -> int:
    """Play on from any turn of a recorded game, into a transcript of its own.

    \b
      dmplay branch game.dmt --at 7 -o other.dmt
    """
    from dmplay.shell.start import branched
    from dmplay.shell.terminal import Wishes, here

    terminal, table = here(Wishes(plain, json, color, ascii_, theme)), _table(ctx)
    table.put(branched(file, at, record, force=force, trusted=trust, keys=_keys(keys)))
    return _sit(ctx, table, terminal, json=json, quiet=quiet)


@app.command("list")
def list_(
    kind: Kind = "",
    json: Json = False,
) -> None:
    """List the problems: table F.1 of the book.

    \b
      dmplay list
      dmplay list pomdp --json
    """
    from dmplay.shell import reports

    reports.print_list(kind, json=json)


@app.command()
def solve(
    problem: Name,
    variant: Variant = "",
    set_: Set = [],  # noqa: B006 - typer reads it once
    json: Json = False,
) -> None:
    """Solve a problem: values, best actions or equilibria, and how they were found.

    \b
      dmplay solve hexworld --set slip=0.1
      dmplay solve rock-paper-scissors --json
    """
    from dmplay.shell import solving
    from dmplay.shell.request import pairs

    name = f"{problem}:{variant}" if variant else problem
    solving.print_solution(name, pairs(set_, "--set"), json=json)


@app.command()
def figure(
    name: Figure = "",
    svg: Annotated[bool, typer.Option("--svg", help="as a picture")] = False,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="a file")] = None,
    color: Color = "auto",
    ascii_: Ascii = False,
    theme: Theme = "default",
) -> None:
    """Draw a figure or table of the book's appendix F from the problems themselves.

    \b
      dmplay figure                 names them
      dmplay figure F.2
      dmplay figure F.11 --svg -o regions.svg
    """
    from dmplay.shell import drawing
    from dmplay.shell.export import write
    from dmplay.shell.terminal import Wishes, here

    terminal = here(Wishes(color=color, ascii=ascii_, theme=theme))
    if not name:
        print(*(f"{key:<5} {title}" for key, (title, _) in drawing.figures().items()), sep="\n")
        return
    title, draw = drawing.figure(name)
    if svg or output:
        write(output, drawing.picture(draw(), title))
    else:
        drawing.show(draw(), terminal)


@app.command()
def agents(problem: Name, json: Json = False) -> None:
    """List the agents that fit a problem, with their parameters.

    \b
      dmplay agents 2048
      dmplay agents prisoners-dilemma --json
    """
    from dmplay.shell import reports

    reports.print_agents(problem, json=json)


@app.command()
def info(problem: Name, json: Json = False, keys: Keys = "") -> None:
    """Tell all about a problem: spaces, parameters, variants, agents, keys, decisions, source.

    \b
      dmplay info hexworld
      dmplay info crying-baby --json
    """
    from dmplay.shell import reports

    reports.print_info(problem, _keys(keys), json=json)


@configuration.command("show")
def config_show(ctx: typer.Context, json: Json = False) -> None:
    """Show every setting with its value and where it comes from.

    \b
      dmplay config show
      DMPLAY_COLOR=never dmplay config show --json
    """
    from dmplay.settings import in_force, named, shown

    told = [*in_force(ctx.find_root()), *named(config.files())]
    print(shown(told, as_json=json))


@configuration.command("path")
def config_path() -> None:
    """Tell where the files of settings are looked for.

    \b
      dmplay config path
    """
    user, project = config.paths(os.environ)
    print(user, project, sep="\n")


def program(words: Sequence[str], table: object) -> str:
    """What these words print; a game that they set up is put on the table."""
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        try:
            app([*words], standalone_mode=False, prog_name="dmplay", obj=table)
        except USAGE as error:
            raise BadParameter(_sentence(error)) from None
    return printed.getvalue().rstrip("\n")


def run() -> int:
    """Runs the command line; errors become one line and an exit code."""
    if COMPLETING in os.environ:
        return _complete()
    if len(sys.argv) == 1:
        if not _spoken_to():
            return _no_words()
        sys.argv.append("shell")
    try:
        code = app(standalone_mode=False, prog_name="dmplay")
    except (DmplayError, USAGE) as error:
        return _fail(_sentence(error), USAGE_CODE)
    except typer.Abort:
        return INTERRUPT_CODE
    return code if isinstance(code, int) else 0


def _complete() -> int:
    """Answers a shell that asks what can follow."""
    kept = ""
    if os.environ[COMPLETING] == "complete_bash":
        words = os.environ.get("COMP_WORDS", "").replace(" ", "\n").split("\n")
        whole, at, kept = rejoined(words, int(os.environ.get("COMP_CWORD", "0")))
        os.environ |= {"COMP_WORDS": "\n".join(whole), "COMP_CWORD": str(at)}
    with contextlib.redirect_stdout(io.StringIO()) as found, contextlib.suppress(SystemExit):
        app(prog_name="dmplay")
    lines = [line.removeprefix(kept) for line in found.getvalue().split("\n")]
    print(*filter(None, lines), sep="\n")
    return 0


def _spoken_to() -> bool:
    """Whether somebody types, or a script waits on the standard input."""
    if sys.stdin.isatty():
        return sys.stdout.isatty()
    return bool(cast(io.BufferedReader, sys.stdin.buffer).peek(1))


def _no_words() -> int:
    """Help, as an error."""
    sys.argv.append("--help")
    with contextlib.redirect_stdout(sys.stderr):
        app(standalone_mode=False, prog_name="dmplay")
    return USAGE_CODE


def _fail(message: str, code: int) -> int:
    from dmplay.shell.terminal import clean

    print(f"error: {clean(message)}", file=sys.stderr)
    return code


def _sentence(error: Exception) -> str:
    """An error in one line; click's in our form, lower case first and without a full stop."""
    if isinstance(error, DmplayError):
        return str(error)
    message = getattr(error, "format_message", lambda: str(error))().rstrip(".")
    return f"{message[:1].lower()}{message[1:]}; see dmplay --help"


__all__ = ["BadParameter", "app", "run"]
