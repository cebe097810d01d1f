"""Functions that execute the result of a command line: play a game or print a report."""

import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from typing import TYPE_CHECKING, Any

import typer

from dmplay.cli import config_files
from dmplay.cli.app import root_command
from dmplay.cli.commands import build_command
from dmplay.cli.error_messages import USAGE_ERROR, format_error
from dmplay.core.running_command import get_running_command
from dmplay.core.safe_files import forget_input_files, register_input_file
from dmplay.core.text import JSON_REPORT_BEGINNING, escape_unprintable
from dmplay.errors import BadParameter
from dmplay.game import command_line_results as results
from dmplay.game.command_line_results import PlayCommand, Printout
from dmplay.terminal.capabilities import Terminal, current_terminal

if TYPE_CHECKING:
    from dmplay.game.game_series import GameController


def execute_result(result: results.CliResult) -> int:
    """Play the game, run the server or print the report of a command; return the exit code."""
    match result:
        case str():
            return _print_report(Printout(result))
        case Printout():
            return _print_report(result)
        case results.BotServerConfig():
            from dmplay.cli.servers import serve_bot

            return serve_bot(*result)
        case results.McpServerConfig():
            from dmplay.cli.servers import serve_mcp

            return serve_mcp(result)
    return _run_user_interface(result)


def _run_user_interface(
    result: PlayCommand | results.ShellCommand | results.TutorCommand | results.WatchCommand,
) -> int:
    """Run a user interface, imported here as a report does not need it; return the exit code."""
    from dmplay.ui import game_launcher

    match result:
        case PlayCommand():
            return game_launcher.play_game(_make_controller(), result)
        case results.ShellCommand():
            return game_launcher.run_shell(_make_controller(), result)
        case results.WatchCommand():
            return game_launcher.show_algorithm(result)
    terminal = current_terminal(result.terminal_options)
    return game_launcher.run_tutor_command(terminal, result, interpret_command)


def _print_report(report: Printout) -> int:
    """Print a report, its error text and its generated chunks; return its exit code."""
    if report.stderr_text:
        print(escape_unprintable(report.stderr_text), file=sys.stderr)
    terminal = current_terminal(report.terminal_options)
    text = render_for_terminal(report.text, terminal)
    if text.startswith(JSON_REPORT_BEGINNING) or get_running_command().options.get("meta"):
        from dmplay.output import provenance

        text = provenance.add_to_report(text)
        if text:
            provenance.write_meta_file(provenance.compute_digest(f"{text}\n".encode()))
    if report.paged:
        from dmplay.output.pager import print_paged

        print_paged(text, terminal, wrap_words=isinstance(report.text, str))
    elif text:
        print(text)
    end, output = "\n", sys.stdout
    with redirect_stdout(sys.stderr):  # User code may print while the text is generated.
        for part in report.text_chunks:
            output.write(escape_unprintable(part))
            end = part[-1:] or end
    print(end="" if end == "\n" else "\n")
    return report.exit_code


def render_for_terminal(text: Any, terminal: Terminal) -> str:
    """Return a text as a string for a terminal, in colour and in Unicode if the terminal can."""
    if isinstance(text, str):
        return escape_unprintable(text)
    if terminal.ascii:
        from dmplay.draw.canvas import to_ascii

        text = to_ascii(text)
    if not terminal.color:
        return str(text.plain)
    from dmplay.terminal.styles import to_ansi

    return to_ansi(text, terminal.theme)


def _make_controller() -> "GameController":
    """Return a game controller with the command line's interpreter, aliases and records.

    Raise BadParameter if an alias has the name of a command.
    """
    from dmplay.game import player_records
    from dmplay.game.game_series import GameController
    from dmplay.ui.shell.commands import is_command

    for name in config_files.merged_aliases():
        if is_command(name):
            raise BadParameter(f"aliases.{name}: {name} is a command; choose another name")
    return GameController(
        cli_interpreter=interpret_command,
        aliases=config_files.merged_aliases(),
        on_game_end=player_records.record_finished_game,
    )


def interpret_command(words: Sequence[str]) -> PlayCommand | results.TutorCommand | str:
    """Parse words of a command line; return a game, a lesson, or the plain text of a report."""
    forget_input_files()
    for file in config_files.load_config_files():  # They were read when the shell began.
        register_input_file(file.path)
    commands = root_command()
    name, *arguments = words
    if {"-h", "--help"} & {*arguments}:
        command = build_command(name)
        parent_context = typer.Context(commands, info_name="dmplay")
        return str(command.get_help(typer.Context(command, info_name=name, parent=parent_context)))
    try:
        result: PlayCommand | results.TutorCommand | Printout | str | int = commands(
            [*words], standalone_mode=False, prog_name="dmplay"
        )
    except USAGE_ERROR as error:
        raise BadParameter(format_error(error)) from None
    if isinstance(result, int):  # Typer returns the exit code of Ctrl-C
        raise KeyboardInterrupt
    if isinstance(result, Printout):
        if result.text_chunks:
            return escape_unprintable("".join(result.text_chunks)).removesuffix("\n")
        terminal = current_terminal(result.terminal_options)._replace(color=False)
        return render_for_terminal(result.text, terminal).rstrip("\n")
    return result
