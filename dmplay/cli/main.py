"""The command line as a process: arguments, exit codes and shell completion."""

import contextlib
import io
import os
import sys
from typing import Any, cast

import typer

from dmplay.cli.app import root_command
from dmplay.cli.command_group import rejoin_bash_words
from dmplay.cli.error_messages import USAGE_ERROR, format_error
from dmplay.core.parameter_parsing import parse_whole_number
from dmplay.errors import DmplayError
from dmplay.game.completion.safe_words import is_safe_word

COMPLETION_VARIABLE = "_DMPLAY_COMPLETE"  # set by a shell that requests completions
FISH_ACTION_VARIABLE = "_TYPER_COMPLETE_FISH_ACTION"  # `is-args` only asks whether there are any
SHELL_BY_NAME_VARIABLE = (
    "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION"  # makes Typer accept the name of a shell
)
COMPLETION_SCRIPT_OPTIONS = ("--install-completion", "--show-completion")
# word endings after which more can be typed
CONTINUED_ENDINGS = {"=": "VALUE", ":": "VALUE", "/": "..."}
USAGE_EXIT_CODE, SYSTEM_ERROR_EXIT_CODE = 2, 1  # invalid usage; failure of the system
HELP_UNREAD_EXIT_CODE = 1  # Typer's exit code if the output of the help is closed


def run_command_line() -> int:
    """Run the command line and return the exit code; errors are printed as one line."""
    for variable in ("LINES", "COLUMNS"):  # Libraries read these variables without checking them.
        if not parse_whole_number(os.environ.get(variable, "")):
            os.environ.pop(variable, None)
    if COMPLETION_VARIABLE in os.environ:
        return _print_completions()
    has_no_arguments = len(sys.argv) == 1
    if has_no_arguments:
        if not _has_input():
            return _print_help_as_error()
        sys.argv.append("shell")
    if sys.argv[1] in COMPLETION_SCRIPT_OPTIONS and len(sys.argv) > 2:
        os.environ[SHELL_BY_NAME_VARIABLE] = "1"
        root_command.cache_clear()  # Typer reads the variable when it creates the commands.
    try:
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

        location = "" if os.environ.get("DMPLAY_DEBUG") else describe_error_location(error)
        if not location:
            raise
        print(
            f"error: {escape_unprintable(location)}; --debug shows the traceback", file=sys.stderr
        )
        return USAGE_EXIT_CODE


def _run_command(*, show_gallery: bool) -> int:
    """Run the command given by the arguments and return the exit code.

    With `show_gallery`, the shell starts with the list of problems.
    """
    try:
        result = root_command()(standalone_mode=False, prog_name="dmplay")
    except SystemExit as exit_error:
        if exit_error.code != HELP_UNREAD_EXIT_CODE:
            raise  # raised for a signal
        raise BrokenPipeError from None
    if isinstance(result, int):  # exit code of the help
        return result
    from dmplay.cli.parsed_command_runner import execute_result

    return execute_result(result._replace(opens_gallery=True) if show_gallery else result)


def _print_completions() -> int:
    """Print the completions that a shell requests, or its script; return the exit code."""
    from typer._click.shell_completion import get_completion_class

    command = root_command()  # Typer registers its completion classes with the commands.
    instruction, _, shell = os.environ[COMPLETION_VARIABLE].partition("_")
    completion_class: Any = get_completion_class(shell) if instruction == "complete" else None
    if completion_class is None:
        with contextlib.suppress(SystemExit):
            command(prog_name="dmplay")
        return 0
    prefix = ""
    if shell == "bash":
        words = os.environ.get("COMP_WORDS", "").replace(" ", "\n").split("\n")
        joined_words, cursor_index, prefix = rejoin_bash_words(
            words, parse_whole_number(os.environ.get("COMP_CWORD", "")) or 0
        )
        os.environ |= {"COMP_WORDS": "\n".join(joined_words), "COMP_CWORD": str(cursor_index)}
    completion = completion_class(command, {}, "dmplay", COMPLETION_VARIABLE)
    arguments, partial_word = completion.get_completion_args()
    with contextlib.redirect_stdout(io.StringIO()):  # zsh evaluates all output.
        items = [
            item
            for item in completion.get_completions(arguments, partial_word)
            if is_safe_word(str(item.value), partial_word)
        ]
        lines = [completion.format_completion(item).removeprefix(prefix) for item in items]
    if shell == "bash":
        lines = _format_for_bash(lines)
    elif shell == "zsh":
        lines = _format_for_zsh(lines)
    elif os.environ.get(FISH_ACTION_VARIABLE) == "is-args":  # Without words, fish offers files.
        return 0 if lines else 1
    print(*lines, sep="\n")
    return 0


def _format_for_bash(lines: list[str]) -> list[str]:
    """Return completions for bash: spaces escaped, and no space added after an unfinished word.

    Bash adds a space after a single completion, so a second one with the same beginning is added.
    """
    lines = [line.replace(" ", "\\ ") for line in lines]
    if len(lines) == 1 and lines[0][-1:] in CONTINUED_ENDINGS:
        lines.append(lines[0] + CONTINUED_ENDINGS[lines[0][-1]])
    return lines


def _format_for_zsh(lines: list[str]) -> list[str]:
    """Return the command of zsh that offers these completions, or files if there are none."""
    rows = "\n".join(lines)
    return [f"_arguments '*: :(({rows}))'"] if rows else ["_files"]


def _has_input() -> bool:
    """Return whether there is input: a terminal for typing, or data in a pipe."""
    if sys.stdin.isatty():
        return sys.stdout.isatty()
    return bool(cast(io.BufferedReader, sys.stdin.buffer).peek(1))


def _print_help_as_error() -> int:
    """Print the help to stderr and return the exit code for invalid usage."""
    sys.argv.append("--help")
    with contextlib.redirect_stdout(sys.stderr):
        root_command()(standalone_mode=False, prog_name="dmplay")
    return USAGE_EXIT_CODE
