"""The command line as a process: arguments, exit codes and shell completion."""

import contextlib
import io
import os
import sys
from typing import cast

import typer

from dmplay.cli.app import root_command
from dmplay.cli.error_messages import USAGE_ERROR, format_error
from dmplay.core.parameter_parsing import parse_whole_number
from dmplay.core.safe_files import track_input_files
from dmplay.errors import DmplayError

# makes Typer accept the name of a shell
SHELL_BY_NAME_VARIABLE = "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION"
COMPLETION_SCRIPT_OPTIONS = ("--install-completion", "--show-completion")
USAGE_EXIT_CODE, SYSTEM_ERROR_EXIT_CODE = 2, 1  # invalid usage; failure of the system
HELP_UNREAD_EXIT_CODE = 1  # Typer's exit code if the output of the help is closed


def run_command_line() -> int:
    """Run the command line and return the exit code; errors are printed as one line."""
    for variable in ("LINES", "COLUMNS"):  # Libraries read these variables without checking them.
        if not parse_whole_number(os.environ.get(variable, "")):
            os.environ.pop(variable, None)
    if "_DMPLAY_COMPLETE" in os.environ:  # set by a shell that requests completions
        from dmplay.cli.shell_completion import print_completions

        return print_completions()
    has_no_arguments = len(sys.argv) == 1
    if has_no_arguments:
        if not _has_input():
            sys.argv.append("--help")
            with contextlib.redirect_stdout(sys.stderr):
                root_command()(standalone_mode=False, prog_name="dmplay")
            return USAGE_EXIT_CODE
        sys.argv.append("shell")
    if sys.argv[1] in COMPLETION_SCRIPT_OPTIONS and len(sys.argv) > 2:
        os.environ[SHELL_BY_NAME_VARIABLE] = "1"
        root_command.cache_clear()  # Typer reads the variable when it creates the commands.
    try:
        with track_input_files():
            return _run_command(show_gallery=has_no_arguments)
    except (DmplayError, USAGE_ERROR) as error:
        from dmplay.core.text import escape_unprintable

        print(f"error: {escape_unprintable(format_error(error))}", file=sys.stderr)
        return SYSTEM_ERROR_EXIT_CODE if isinstance(error, OSError) else USAGE_EXIT_CODE
    except typer.Abort:  # raised for Ctrl-C
        raise KeyboardInterrupt from None
    except Exception as error:  # raised in a user-defined problem or agent
        if isinstance(error.__cause__, KeyboardInterrupt):
            # Python 3.11 wraps an interrupt that arrives in `__set_name__`, as of an enumeration.
            raise KeyboardInterrupt from None
        from dmplay.core.text import escape_unprintable
        from dmplay.core.user_code_locations import describe_error_location

        location = escape_unprintable(describe_error_location(error))
        if not location or os.environ.get("DMPLAY_DEBUG"):
            raise
        print(f"error: {location}; --debug shows the traceback", file=sys.stderr)
        return USAGE_EXIT_CODE


def _run_command(*, show_gallery: bool) -> int:
    """Run the command given by the arguments and return the exit code.

    With `show_gallery`, the shell starts with the list of problems.
    """
    try:
        # A program reads JSON and CSV, so what user code prints meanwhile goes to standard error.
        is_data = {"--json", "--csv"} & {*sys.argv} and not {"-h", "--help"} & {*sys.argv}
        with contextlib.redirect_stdout(sys.stderr) if is_data else contextlib.nullcontext():
            result = root_command()(standalone_mode=False, prog_name="dmplay")
    except SystemExit as exit_error:
        if exit_error.code != HELP_UNREAD_EXIT_CODE:
            raise  # raised for a signal
        raise BrokenPipeError from None
    if isinstance(result, int):  # exit code of the help
        return result
    from dmplay.cli.parsed_command_runner import execute_result

    return execute_result(result._replace(opens_gallery=True) if show_gallery else result)


def _has_input() -> bool:
    """Return whether there is input: a terminal for typing, or data in a pipe."""
    if sys.stdin.isatty():
        return sys.stdout.isatty()
    return bool(cast(io.BufferedReader, sys.stdin.buffer).peek(1))
