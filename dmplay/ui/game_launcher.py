"""The launcher of games and shells: full screen, lines of text, JSON or no output at all."""

import contextlib
import shutil
import sys
from collections.abc import Iterable, Iterator, Sequence
from shlex import quote
from textwrap import fill

from dmplay import __version__
from dmplay.core.text import escape_unprintable
from dmplay.errors import BadParameter, DmplayError
from dmplay.game import saves
from dmplay.game.command_line_results import (
    CliInterpreter,
    LearnCommand,
    MistakesCommand,
    PlayCommand,
    PuzzleCommand,
    ShellCommand,
    TutorCommand,
    WatchCommand,
)
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import format_resume_command, start_game
from dmplay.game.saves import SaveRemoval
from dmplay.game.share_line import format_share_line
from dmplay.registry import problems
from dmplay.terminal.capabilities import Terminal, current_terminal, read_line
from dmplay.terminal.signals import exit_on_signals
from dmplay.transcript.recorder import Recorder
from dmplay.tutor.progress import current_day
from dmplay.ui.gallery.gallery import LESSON_COMMAND, SHELL_COMMAND, Gallery
from dmplay.ui.gallery.problem_entries import list_problem_entries
from dmplay.ui.screen.full_screen import run_full_screen, show_game
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.shell.command_shell import Shell, run_prompt_loop, run_script
from dmplay.ui.shell.plain_mode import JsonReporter, Reporter, SentenceReporter, play_by_lines

INVALID_LINE_EXIT_CODE = 2  # as for an invalid command line
SHELL_BANNER = f"""\
dmplay {__version__}: play decision problems with typed commands
list shows the problems, play hexworld starts one,
help explains the commands, Ctrl-D quits"""
# shown once, at the first start
FIRST_GAME_ADVICE = "new here? Enter starts your first game, which says what to do"
FIRST_COMMAND_ADVICE = "new here? begin with play hexworld; in a game, hint suggests an action"


def play_game(controller: GameController, command: PlayCommand) -> int:
    """Play a game with the front end that the terminal allows, and return the exit code."""
    is_json = command.terminal_options.json
    if not (is_json or command.quiet):
        terminal = current_terminal(command.terminal_options)
        return _play_game(controller, command, SentenceReporter(terminal))
    reporter = JsonReporter(sys.stdout) if is_json else Reporter()
    with contextlib.redirect_stdout(sys.stderr):  # for what user code prints
        return _play_game(controller, command, reporter)


def _play_game(controller: GameController, command: PlayCommand, reporter: Reporter) -> int:
    """Play a game on the full screen or with a reporter, and return the exit code."""
    terminal, quiet = current_terminal(command.terminal_options), command.quiet
    plain_reason = "--quiet" if quiet else terminal.plain_reason
    if command.has_rate_option and plain_reason:
        raise BadParameter(
            f"--rate: real time needs the full screen, which is off here ({plain_reason})"
        )
    controller.set_game(start_game(command.request))
    code, has_invalid_line = 0, False
    with _end_game_on_exit(controller, terminal, quiet=quiet):
        if terminal.full_screen and not quiet:
            screen = PlayScreen(controller, terminal, command.speed, command.realtime_rate)
            code = show_game(screen)
            controller.end_game("interrupted" if code else "quit")
            print(controller.game.narrator.describe_result())
        else:
            has_invalid_line = play_by_lines(controller, terminal, sys.stdin, reporter)
            if quiet and controller.game.narrator.end_explanation:
                print(controller.game.narrator.end_explanation, file=sys.stderr)
    return code or _print_write_errors(controller, has_invalid_line=has_invalid_line)


def run_shell(controller: GameController, command: ShellCommand) -> int:
    """Run the shell on commands that are typed, piped or given as options; return the exit code."""
    terminal = current_terminal(command.terminal_options)
    shell = Shell(controller, terminal, command.speed)
    shell.run_lesson = lambda lesson: run_tutor_command(
        terminal, lesson, controller.cli_interpreter
    )
    code, has_invalid_line = 0, False
    with _end_game_on_exit(controller, terminal):
        if command.commands:
            has_invalid_line = run_script(shell, command.commands, "command", echo=False)
        elif terminal.full_screen and command.opens_gallery:
            code = _run_gallery(shell, FIRST_GAME_ADVICE if saves.is_first_run() else "")
        elif terminal.full_screen:
            from dmplay.ui.shell import interactive_shell

            print(SHELL_BANNER)
            code = interactive_shell.run_prompt(shell)
        elif terminal.is_interactive:
            print(SHELL_BANNER)
            if command.opens_gallery and saves.is_first_run():
                print(FIRST_COMMAND_ADVICE)
            run_prompt_loop(shell)
        else:
            has_invalid_line = run_script(shell, sys.stdin)
        controller.end_game("interrupted" if code else "quit")
    return code or _print_write_errors(controller, has_invalid_line=has_invalid_line)


def run_tutor_command(
    terminal: Terminal, command: TutorCommand, cli_interpreter: CliInterpreter | None
) -> int:
    """Run a lesson, or ask puzzles or mistakes, in the terminal; return the exit code."""
    from dmplay.ui.lessons import lesson_player, question_player  # Games need none of them.

    match command:
        case LearnCommand():
            return lesson_player.play_lesson(terminal, command, cli_interpreter)
        case PuzzleCommand():
            return question_player.play_puzzle(terminal, command)
        case MistakesCommand():
            return question_player.play_mistakes(terminal, command)


def show_algorithm(command: WatchCommand) -> int:
    """Show an algorithm step by step on the full screen, and return the exit code."""
    from dmplay.ui.watch.step_viewer import StepViewer  # Games need no algorithms.

    terminal = current_terminal(command.terminal_options)
    viewer = StepViewer(command.watched, terminal, command.speed, command.first_step)
    return run_full_screen(viewer)


def _run_gallery(shell: Shell, message: str) -> int:
    """Show the gallery and run each choice until the player leaves; return the exit code.

    It shows a message until the first key.
    """
    gallery = Gallery(list_problem_entries(), shell.terminal, current_day())
    gallery.message = message
    while True:
        code = run_full_screen(
            gallery, lambda: gallery.pending_command[:1] not in ((), (LESSON_COMMAND,))
        )
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
    """Play the chosen game on the full screen, or run the shell; return the exit code."""
    controller = shell.controller
    if words == SHELL_COMMAND:
        from dmplay.ui.shell import interactive_shell

        print(SHELL_BANNER)
        code = interactive_shell.run_prompt(shell)
    elif words[0] == LESSON_COMMAND:
        return _run_gallery_lesson(shell, gallery, words[1])
    else:
        controller.run_command_words(words)
        screen = PlayScreen(controller, shell.terminal, shell.speed)
        screen.next_problem = gallery.find_next_game(controller.game.problem_name)
        code = show_game(screen)
    controller.end_game("interrupted" if code else "quit")
    if controller.has_game:
        gallery.return_from_game(controller.game)
    return code


def _run_gallery_lesson(shell: Shell, gallery: Gallery, word: str) -> int:
    """Run a lesson and wait for Enter, so that its last lines can be read; return the exit code."""
    interpreter = shell.controller.cli_interpreter
    code = run_tutor_command(shell.terminal, LearnCommand(word), interpreter)
    read_line("Enter goes back to the list of problems> ", sys.stdin)
    gallery.return_from_lesson()
    return code


@contextlib.contextmanager
def _end_game_on_exit(
    controller: GameController, terminal: Terminal, *, quiet: bool = False
) -> Iterator[None]:
    """Run the block, end the game however the player leaves, and print where it is saved."""
    try:
        with exit_on_signals():
            try:
                yield
            # An OSError means that the terminal is lost.
            except (KeyboardInterrupt, OSError, SystemExit):
                controller.end_game("interrupted")
                raise
    finally:
        if not quiet:
            print_epilogue(controller, ascii_only=terminal.ascii or not terminal.full_screen)
        report_removed_saves(controller.save_removal)


def print_epilogue(controller: GameController, *, ascii_only: bool = False) -> None:
    """Print the paths of the transcripts, and commands for the last game.

    They replay it, resume it if it is unfinished, and play it again, in a line to share if a person
    finished it.
    """
    recorders = [
        candidate
        for candidate in controller.finished_games
        if not candidate.write_error and candidate.path.exists()
    ]
    lines = [f"transcript: {recorder.path}" for recorder in recorders]
    # a sealed game can be neither replayed nor started again
    sealed = controller.has_game and controller.game.is_concealed
    if recorders:
        is_current = controller.has_game and recorders[-1] is controller.game.recorder
        if not (sealed and is_current):
            needs_trust = problems.requires_trust(controller.finished_games[recorders[-1]])
            trust = " --trust" if needs_trust else ""
            lines.append(f"replay: dmplay replay {quote(str(recorders[-1].path))}{trust}")
        resume_command = format_resume_command(controller.game) if is_current else ""
        lines += [f"resume: {resume_command}"] if resume_command else []
    share_line = ""
    earlier = controller.last_unaided_game
    if earlier and earlier is not controller.game:  # A second try does not replace its result.
        lines.append(f"share: {format_share_line(earlier, ascii_only=ascii_only)}")
    if controller.has_game and not sealed:
        share_line = format_share_line(controller.game, ascii_only=ascii_only)
    if share_line:
        lines.append(f"share: {share_line}")
    elif controller.has_game and controller.game.play_again_command and not sealed:
        lines.append(f"again: {controller.game.play_again_command}")
    lines += [f"log: {path}" for path in controller.game.log_paths] if controller.has_game else []
    for line in lines:
        text = escape_unprintable(line)
        if line.startswith("share: ") and sys.stderr.isatty():  # broken between words
            width, indent = shutil.get_terminal_size().columns, " " * len("share: ")
            text = fill(text, width, subsequent_indent=indent, break_on_hyphens=False)
        print(text, file=sys.stderr)


def report_removed_saves(removal: SaveRemoval) -> None:
    """Print how many saved games were deleted, and whether the others still exceed the limit."""
    if str(removal):
        print(removal, file=sys.stderr)


def _print_write_errors(controller: GameController, *, has_invalid_line: bool) -> int:
    """Print each error of writing a transcript; return 1 for any, else 2 for an invalid line."""
    return (
        report_write_errors(controller.finished_games) or INVALID_LINE_EXIT_CODE * has_invalid_line
    )


def report_write_errors(recorders: Iterable[Recorder]) -> int:
    """Print each error of writing a transcript; return exit code 1 if there is any, else 0."""
    failed = [recorder for recorder in recorders if recorder.write_error]
    for recorder in failed:
        if isinstance(recorder.write_error, BrokenPipeError):
            raise recorder.write_error
        message = escape_unprintable(recorder.describe_write_error())
        print(f"error: {message}", file=sys.stderr)
    return 1 if failed else 0
