"""The front end that plays a game: screen, lines, data or nothing, as the terminal allows."""

import contextlib
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from shlex import quote

from dmplay import __version__
from dmplay.describe import format_count
from dmplay.errors import BadParameter, DmplayError
from dmplay.finding import problems
from dmplay.gallery.gallery import SHELL_COMMAND, Gallery
from dmplay.gallery.offers import list_problem_entries
from dmplay.game.errand import PlayCommand, ShellCommand
from dmplay.game.saves import MAX_SAVES
from dmplay.game.start import start_game
from dmplay.game.table import GameController
from dmplay.screen.screen import PlayScreen
from dmplay.screen.show import run_full_screen
from dmplay.signals import exit_on_signals
from dmplay.terminal import current_terminal, escape_unprintable
from dmplay.transcript.recorder import Recorder
from dmplay.words.plain import JsonReporter, Reporter, SentenceReporter, play_by_lines
from dmplay.words.shell import Shell, run_prompt_loop, run_script

SHELL_BANNER = f"""\
dmplay {__version__}: decision problems, in words
list names them, play hexworld begins one,
help tells the rest, Ctrl-D leaves"""


def play_game(table: GameController, command: PlayCommand) -> int:
    """Plays the game that is wanted with the front end that the terminal allows; the exit code."""
    terminal, quiet = current_terminal(command.terminal_options), command.quiet
    why = "--quiet" if quiet else terminal.plain_reason
    if command.has_rate_option and why:
        raise BadParameter(f"--rate: real time is for the full screen; there is none (from {why})")
    table.set_game(start_game(command.request))
    code = 0
    with _end_game_on_exit(table, quiet=quiet):
        if terminal.full_screen and not quiet:
            code = run_full_screen(
                PlayScreen(table, terminal, command.speed, command.realtime_rate)
            )
            table.end_game("interrupted" if code else "quit")
            print(table.game.narrator.describe_result())
        else:
            reporter = (
                JsonReporter() if command.terminal_options.json else SentenceReporter(terminal)
            )
            play_by_lines(table, terminal, sys.stdin, Reporter() if quiet else reporter)
            if quiet and table.game.narrator.forfeit_reason:
                print(table.game.narrator.forfeit_reason, file=sys.stderr)
    return code or report_write_errors(table.finished_games)


def run_shell(table: GameController, command: ShellCommand) -> int:
    """Plays at a table in words, typed, piped or given; returns the exit code."""
    terminal = current_terminal(command.terminal_options)
    shell = Shell(table, terminal, command.speed)
    code = 0
    with _end_game_on_exit(table):
        if command.commands:
            run_script(shell, command.commands, "command", echo=False)
        elif terminal.full_screen and command.opens_gallery:
            code = _run_gallery(shell)
        elif terminal.full_screen:
            from dmplay import prompt

            print(SHELL_BANNER)
            code = prompt.run_prompt(shell)
        elif terminal.is_interactive:
            print(SHELL_BANNER)
            run_prompt_loop(shell)
        else:
            run_script(shell, sys.stdin)
        table.end_game("interrupted" if code else "quit")
    return code or report_write_errors(table.finished_games)


def _run_gallery(shell: Shell) -> int:
    """Shows the gallery, and after it what is wanted there, until the player leaves."""
    gallery = Gallery(list_problem_entries(), shell.terminal, time.strftime("%Y%m%d"))
    while True:
        code = run_full_screen(gallery)
        if code or not gallery.pending_command:
            return code
        words, gallery.pending_command = gallery.pending_command, ()
        try:
            code = _run_gallery_choice(shell, gallery, words)
        except DmplayError as error:
            gallery.message = str(error)
        if code:
            return code


def _run_gallery_choice(shell: Shell, gallery: Gallery, words: Sequence[str]) -> int:
    """Plays the game that was chosen, or has the player type; the exit code."""
    table = shell.controller
    if words == SHELL_COMMAND:
        from dmplay import prompt

        print(SHELL_BANNER)
        code = prompt.run_prompt(shell)
    else:
        table.run_cli_words(words)
        code = run_full_screen(PlayScreen(table, shell.terminal, shell.speed))
    table.end_game("interrupted" if code else "quit")
    if table.has_game:
        gallery.return_from_game(table.game)
    return code


@contextlib.contextmanager
def _end_game_on_exit(table: GameController, *, quiet: bool = False) -> Iterator[None]:
    """Ends the game, and tells where it is kept, however its player leaves."""
    try:
        with exit_on_signals():
            try:
                yield
            except (KeyboardInterrupt, OSError, SystemExit):  # or the terminal is gone
                table.end_game("interrupted")
                raise
    finally:
        if not quiet:
            print_epilogue(table)


def print_epilogue(table: GameController) -> None:
    """Where the transcripts are, how to see the last again, how to play it again."""
    whole = [one for one in table.finished_games if not one.write_error and one.path.exists()]
    rows = [f"transcript: {recorder.path}" for recorder in whole]
    sealed = table.has_game and table.game.is_concealed  # and so neither looked at nor begun again
    if whole:
        trust = " --trust" if problems.requires_trust(table.finished_games[whole[-1]]) else ""
        does = "resume" if sealed and whole[-1].path == table.game.transcript_path else "replay"
        rows.append(f"{does}: dmplay {does} {quote(str(whole[-1].path))}{trust}")
    if table.has_game and table.game.play_again_command and not sealed:
        rows.append(f"again: {table.game.play_again_command}")
    if table.removed_save_count:
        rows.append(
            f"removed: {format_count(table.removed_save_count, 'older game')}; the last {MAX_SAVES} are kept"
        )
    rows += [f"log: {path}" for path in table.game.log_paths] if table.has_game else []
    for row in rows:
        print(escape_unprintable(row), file=sys.stderr)


def report_write_errors(recorders: Iterable[Recorder]) -> int:
    """Exit code 1, and a line each, where turns could not be written."""
    bad = [recorder for recorder in recorders if recorder.write_error]
    for recorder in bad:
        assert recorder.write_error
        if isinstance(recorder.write_error, BrokenPipeError):
            raise recorder.write_error
        told = escape_unprintable(f"cannot write {recorder.path}: {recorder.write_error.strerror}")
        print(f"error: {told}", file=sys.stderr)
    return 1 if bad else 0
