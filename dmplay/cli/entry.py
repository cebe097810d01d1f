"""The command line as a process: its words, exit codes, and answers to a shell that completes."""

import contextlib
import io
import os
import sys
from typing import cast

import typer

from dmplay.cli.app import root_command
from dmplay.cli.group import rejoin_bash_words
from dmplay.cli.sentence import USAGE_ERROR, format_error
from dmplay.errors import DmplayError
from dmplay.finding.typed import parse_whole_number

COMPLETION_VARIABLE = "_DMPLAY_COMPLETE"  # set by a shell that asks what can follow
SHELL_BY_NAME_VARIABLE = (
    "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION"  # has typer take a shell by its name
)
COMPLETION_SCRIPT_OPTIONS = ("--install-completion", "--show-completion")
CONTINUED_ENDINGS = {"=": "VALUE", ":": "VALUE", "/": "..."}  # endings after which a word goes on
USAGE_EXIT_CODE, SYSTEM_ERROR_EXIT_CODE = 2, 1  # what was said is wrong, or the system cannot do it
HELP_UNREAD_EXIT_CODE = 1  # typer's code where nobody reads the help


def run_command_line() -> int:
    """Runs the command line; errors become one line and an exit code."""
    for size in ("LINES", "COLUMNS"):  # which libraries read too, and trust
        if not parse_whole_number(os.environ.get(size, "")):
            os.environ.pop(size, None)
    if COMPLETION_VARIABLE in os.environ:
        return _print_completions()
    alone = len(sys.argv) == 1
    if alone:
        if not _has_input():
            return _print_help_as_error()
        sys.argv.append("shell")
    if sys.argv[1] in COMPLETION_SCRIPT_OPTIONS and len(sys.argv) > 2:
        os.environ[SHELL_BY_NAME_VARIABLE] = "1"
        root_command.cache_clear()  # it is read when the commands are made
    try:
        return _run_command(show_gallery=alone)
    except (DmplayError, USAGE_ERROR) as error:
        from dmplay.terminal import escape_unprintable

        print(f"error: {escape_unprintable(format_error(error))}", file=sys.stderr)
        return SYSTEM_ERROR_EXIT_CODE if isinstance(error, OSError) else USAGE_EXIT_CODE
    except typer.Abort:  # Ctrl-C
        raise KeyboardInterrupt from None
    except Exception as error:  # of code that is not ours: a problem or an agent that was brought
        from dmplay.places import describe_error_location
        from dmplay.terminal import escape_unprintable

        told = "" if os.environ.get("DMPLAY_DEBUG") else describe_error_location(error)
        if not told:
            raise
        print(f"error: {escape_unprintable(told)}; --debug shows all", file=sys.stderr)
        return USAGE_EXIT_CODE


def _run_command(*, show_gallery: bool) -> int:
    """Does what the words say, and without any shows the gallery; the exit code."""
    try:
        errand = root_command()(standalone_mode=False, prog_name="dmplay")
    except SystemExit as left:
        if left.code != HELP_UNREAD_EXIT_CODE:
            raise  # a signal's
        raise BrokenPipeError from None
    if isinstance(errand, int):  # of help
        return errand
    from dmplay.cli.errands import execute_result

    return execute_result(errand._replace(opens_gallery=True) if show_gallery else errand)


def _print_completions() -> int:
    """Answers a shell that asks what can follow."""
    kept, bash = "", os.environ[COMPLETION_VARIABLE] == "complete_bash"
    if bash:
        words = os.environ.get("COMP_WORDS", "").replace(" ", "\n").split("\n")
        joined, at, kept = rejoin_bash_words(
            words, parse_whole_number(os.environ.get("COMP_CWORD", "")) or 0
        )
        os.environ |= {"COMP_WORDS": "\n".join(joined), "COMP_CWORD": str(at)}
    with contextlib.redirect_stdout(io.StringIO()) as found, contextlib.suppress(SystemExit):
        root_command()(prog_name="dmplay")
    lines = [line.removeprefix(kept) for line in found.getvalue().split("\n") if line]
    print(*(_format_for_bash(lines) if bash else lines), sep="\n")
    return 0


def _format_for_bash(lines: list[str]) -> list[str]:
    """What bash puts in as it stands: blanks escaped, and no blank after a word that goes on.

    It ends a word with a blank unless there are two that begin alike.
    """
    lines = [line.replace(" ", "\\ ") for line in lines]
    if len(lines) == 1 and lines[0][-1:] in CONTINUED_ENDINGS:
        lines.append(lines[0] + CONTINUED_ENDINGS[lines[0][-1]])
    return lines


def _has_input() -> bool:
    """Whether somebody types, or a script waits on the standard input."""
    if sys.stdin.isatty():
        return sys.stdout.isatty()
    return bool(cast(io.BufferedReader, sys.stdin.buffer).peek(1))


def _print_help_as_error() -> int:
    """Help, as an error."""
    sys.argv.append("--help")
    with contextlib.redirect_stdout(sys.stderr):
        root_command()(standalone_mode=False, prog_name="dmplay")
    return USAGE_EXIT_CODE
