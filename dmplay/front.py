"""The front end that plays a game: screen, lines, data or nothing, as the terminal allows."""

import contextlib
import sys
from collections.abc import Iterator, Sequence
from shlex import quote

from dmplay import __version__
from dmplay.finding import problems
from dmplay.game.table import Table
from dmplay.screen.screen import Screen
from dmplay.screen.show import show
from dmplay.signals import leaving
from dmplay.terminal import Terminal
from dmplay.words.plain import Objects, Reporter, Sentences, Silence, play
from dmplay.words.shell import Shell, ask
from dmplay.words.shell import play as play_script

BANNER = f"""\
dmplay {__version__}: decision problems, in words
list names them, play hexworld begins one,
help tells the rest, Ctrl-D leaves"""


def run(  # noqa: PLR0913 - a table, how to talk, and what is wanted beside it
    table: Table,
    terminal: Terminal,
    *,
    json: bool = False,
    quiet: bool = False,
    speed: float = 2.0,
    rate: float | None = None,
) -> int:
    """Plays at a table with the front end that the terminal allows; returns the exit code."""
    code = 0
    with _closing(table, quiet=quiet):
        if terminal.screen and not quiet:
            code = show(Screen(table, terminal, speed, rate))
            table.end("interrupted" if code else "quit")
            print(table.game.result())
        else:
            reporter: Reporter = Silence() if quiet else Objects() if json else Sentences()
            play(table, terminal, sys.stdin, reporter)
    return code or faults(table)


def converse(
    table: Table, terminal: Terminal, commands: Sequence[str], *, speed: float = 2.0
) -> int:
    """Plays at a table in words, typed, piped or given; returns the exit code."""
    shell = Shell(table, terminal, speed)
    code = 0
    with _closing(table):
        if commands:
            play_script(shell, commands, "command", echo=False)
        elif terminal.screen:
            from dmplay import prompt

            print(BANNER)
            code = prompt.run(shell)
        elif terminal.typed:
            print(BANNER)
            ask(shell)
        else:
            play_script(shell, sys.stdin)
        table.end("interrupted" if code else "quit")
    return code or faults(table)


@contextlib.contextmanager
def _closing(table: Table, *, quiet: bool = False) -> Iterator[None]:
    """Ends the game, and tells where it is kept, however its player leaves."""
    try:
        with leaving():
            yield
    except (KeyboardInterrupt, BrokenPipeError, SystemExit):
        table.end("interrupted")
        raise
    finally:
        if not quiet:
            epilogue(table)


def epilogue(table: Table) -> None:
    """Where the transcripts are, how to see the last again, how to play it again."""
    whole = [recorder for recorder in table.ended if not recorder.fault]
    rows = [f"transcript: {recorder.path}" for recorder in whole]
    if whole:
        trust = "" if problems.stem(whole[-1].session.problem) else " --trust"
        rows.append(f"replay: dmplay replay {quote(str(whole[-1].path))}{trust}")
    if table.playing and table.game.again:
        rows.append(f"again: {table.game.again}")
    for row in rows:
        print(row, file=sys.stderr)


def faults(table: Table) -> int:
    """Exit code 1, and a line each, where turns could not be written."""
    bad = [recorder for recorder in table.ended if recorder.fault]
    for recorder in bad:
        assert recorder.fault
        print(f"error: cannot write {recorder.path}: {recorder.fault.strerror}", file=sys.stderr)
    return 1 if bad else 0
