"""The front end that plays a game: screen, lines, data or nothing, as the terminal allows."""

import contextlib
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from shlex import quote

from dmplay import __version__
from dmplay.describe import counted
from dmplay.errors import BadParameter, DmplayError
from dmplay.finding import problems
from dmplay.gallery.gallery import SHELL, Gallery
from dmplay.gallery.offers import offers
from dmplay.game.errand import Conversation, Sitting
from dmplay.game.saves import KEPT
from dmplay.game.start import begin
from dmplay.game.table import Table
from dmplay.screen.screen import Screen
from dmplay.screen.show import show
from dmplay.signals import leaving
from dmplay.terminal import clean, here
from dmplay.transcript.recorder import Recorder
from dmplay.words.plain import Objects, Reporter, Sentences, by_lines
from dmplay.words.shell import Shell, ask, script

BANNER = f"""\
dmplay {__version__}: decision problems, in words
list names them, play hexworld begins one,
help tells the rest, Ctrl-D leaves"""


def sit(table: Table, sitting: Sitting) -> int:
    """Plays the game that is wanted with the front end that the terminal allows; the exit code."""
    terminal, quiet = here(sitting.wishes), sitting.quiet
    why = "--quiet" if quiet else terminal.why
    if sitting.timed and why:
        raise BadParameter(f"--rate: real time is for the full screen; there is none (from {why})")
    table.put(begin(sitting.wanted))
    code = 0
    with _closing(table, quiet=quiet):
        if terminal.screen and not quiet:
            code = show(Screen(table, terminal, sitting.speed, sitting.rate))
            table.end("interrupted" if code else "quit")
            print(table.game.account.result())
        else:
            reporter = Objects() if sitting.wishes.json else Sentences(terminal)
            by_lines(table, terminal, sys.stdin, Reporter() if quiet else reporter)
            if quiet and table.game.account.forfeited:
                print(table.game.account.forfeited, file=sys.stderr)
    return code or faults(table.ended)


def converse(table: Table, conversation: Conversation) -> int:
    """Plays at a table in words, typed, piped or given; returns the exit code."""
    terminal = here(conversation.wishes)
    shell = Shell(table, terminal, conversation.speed)
    code = 0
    with _closing(table):
        if conversation.commands:
            script(shell, conversation.commands, "command", echo=False)
        elif terminal.screen and conversation.gallery:
            code = _browse(shell)
        elif terminal.screen:
            from dmplay import prompt

            print(BANNER)
            code = prompt.run(shell)
        elif terminal.typed:
            print(BANNER)
            ask(shell)
        else:
            script(shell, sys.stdin)
        table.end("interrupted" if code else "quit")
    return code or faults(table.ended)


def _browse(shell: Shell) -> int:
    """Shows the gallery, and after it what is wanted there, until the player leaves."""
    gallery = Gallery(offers(), shell.terminal, time.strftime("%Y%m%d"))
    while True:
        code = show(gallery)
        if code or not gallery.wants:
            return code
        words, gallery.wants = gallery.wants, ()
        try:
            code = _wanted(shell, gallery, words)
        except DmplayError as error:
            gallery.message = str(error)
        if code:
            return code


def _wanted(shell: Shell, gallery: Gallery, words: Sequence[str]) -> int:
    """Plays the game that was chosen, or has the player type; the exit code."""
    table = shell.table
    if words == SHELL:
        from dmplay import prompt

        print(BANNER)
        code = prompt.run(shell)
    else:
        table.ask(words)
        code = show(Screen(table, shell.terminal, shell.speed))
    table.end("interrupted" if code else "quit")
    if table.playing:
        gallery.back(table.game)
    return code


@contextlib.contextmanager
def _closing(table: Table, *, quiet: bool = False) -> Iterator[None]:
    """Ends the game, and tells where it is kept, however its player leaves."""
    try:
        with leaving():
            try:
                yield
            except (KeyboardInterrupt, OSError, SystemExit):  # or the terminal is gone
                table.end("interrupted")
                raise
    finally:
        if not quiet:
            epilogue(table)


def epilogue(table: Table) -> None:
    """Where the transcripts are, how to see the last again, how to play it again."""
    whole = [one for one in table.ended if not one.fault and one.path.exists()]
    rows = [f"transcript: {recorder.path}" for recorder in whole]
    sealed = table.playing and table.game.sealed  # and so neither looked at nor begun again
    if whole:
        trust = " --trust" if problems.brought(table.ended[whole[-1]]) else ""
        does = "resume" if sealed and whole[-1].path == table.game.source else "replay"
        rows.append(f"{does}: dmplay {does} {quote(str(whole[-1].path))}{trust}")
    if table.playing and table.game.again and not sealed:
        rows.append(f"again: {table.game.again}")
    if table.removed:
        rows.append(f"removed: {counted(table.removed, 'older game')}; the last {KEPT} are kept")
    rows += [f"log: {path}" for path in table.game.logs] if table.playing else []
    for row in rows:
        print(clean(row), file=sys.stderr)


def faults(ended: Iterable[Recorder]) -> int:
    """Exit code 1, and a line each, where turns could not be written."""
    bad = [recorder for recorder in ended if recorder.fault]
    for recorder in bad:
        assert recorder.fault
        if isinstance(recorder.fault, BrokenPipeError):
            raise recorder.fault
        told = clean(f"cannot write {recorder.path}: {recorder.fault.strerror}")
        print(f"error: {told}", file=sys.stderr)
    return 1 if bad else 0
