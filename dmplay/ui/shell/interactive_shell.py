"""The shell on a terminal: line editing, history, completion and a toolbar."""

import asyncio
import signal
import sys
from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING

from prompt_toolkit import PromptSession
from prompt_toolkit.application import get_app, get_app_session
from prompt_toolkit.auto_suggest import AutoSuggestFromHistory
from prompt_toolkit.completion import FuzzyCompleter
from prompt_toolkit.filters import Condition
from prompt_toolkit.history import FileHistory, History, InMemoryHistory
from prompt_toolkit.input import Input
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.layout.processors import ConditionalProcessor
from prompt_toolkit.output import ColorDepth, Output

from dmplay.core.text import escape_unprintable
from dmplay.errors import DmplayError
from dmplay.game import saves
from dmplay.terminal.input_sequences import (
    ESCAPE_SECONDS,
    REPLY_ESCAPE_SECONDS,
    REPLY_SECONDS,
    TERMINAL_INPUT,
)
from dmplay.terminal.signals import INTERRUPTED_EXIT_CODE, SIGNAL_EXIT_CODES, exit_on_signals
from dmplay.ui.screen.command_prompt import HiddenInputProcessor
from dmplay.ui.screen.full_screen import run_full_screen, show_game
from dmplay.ui.screen.key_reader import attach_key_reader
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.shell.command_shell import Shell
from dmplay.ui.shell.commands import PlayerQuit
from dmplay.ui.shell.completer import CommandCompleter

if TYPE_CHECKING:  # Most games need no algorithms.
    from dmplay.game.watching import WatchedSteps

MAX_STATE_CHARS = 24  # maximum characters of a state in the toolbar


class ShellHistory(InMemoryHistory):
    """A history of the typed lines, without choices that another person must not see."""

    def __init__(self, shell: Shell, saved_history: History) -> None:
        super().__init__()
        self._shell, self._saved_history = shell, saved_history

    def load_history_strings(self) -> Iterable[str]:
        """Return the lines of all sessions, the last first."""
        return self._saved_history.load_history_strings()

    def append_string(self, string: str) -> None:
        """Add a line to the history of this session, unless it must stay secret."""
        if not self._shell.controller.is_input_hidden:
            super().append_string(string)

    def store_string(self, string: str) -> None:
        """Write a line to the saved history."""
        self._saved_history.store_string(string)


def toolbar_text(shell: Shell) -> str:
    """Return the toolbar's text: score, state or observation, and the key for help."""
    items = []
    if shell.game:
        view = shell.game.view()
        if view.rewards is not None:
            items.append(f"score {shell.game.narrator.seat_return(shell.game.snapshot()):.2f}")
        if not view.problem.partially_observable and view.problem.state_count != 1:
            state_text = view.problem.format_state(view.observation)
            items += [f"state {state_text}"] if len(state_text) <= MAX_STATE_CHARS else []
        elif view.problem.partially_observable and view.turns_played:
            observation = view.problem.observations[view.seat].format_observation(view.observation)
            items.append(f"observed {observation}")
    separator = " - " if shell.terminal.ascii else " · "
    return f" {separator.join([*items, 'F1 help'])}"


def run_prompt(shell: Shell, input_: Input | None = None, output: Output | None = None) -> int:
    """Read and run lines until the player leaves; return the exit code."""
    input_ = input_ or get_app_session().input
    attach_key_reader(input_, TERMINAL_INPUT)
    session = _create_prompt_session(shell, input_, output)
    # If a terminal does not report the cursor's position, only the toolbar is missing.
    session.app.renderer.cpr_not_supported_callback = None
    shell.controller.open_screen = lambda: _show_full_screen(shell)
    shell.controller.open_viewer = lambda watched: _show_algorithm(shell, watched)
    warned = False
    while True:
        try:
            if shell.awaiting_handover:
                with exit_on_signals():
                    shell.hand_over(is_retry=warned)
            line = session.prompt(lambda: shell.prompt, pre_run=_prepare_prompt, handle_sigint=True)
        except KeyboardInterrupt:
            empty = shell.awaiting_handover or not session.default_buffer.text
            if empty and warned:
                return INTERRUPTED_EXIT_CODE
            warned = empty
            if empty:
                print("to quit, press Ctrl-C again, press Ctrl-D or type quit.")
            continue
        except EOFError:
            return 0
        warned = False
        try:
            with exit_on_signals():  # prompt_toolkit restores only its own signal handlers.
                shell.run_line(line)
        except PlayerQuit:
            return 0
        except KeyboardInterrupt:
            print("interrupted.")
        except DmplayError as error:
            print(f"error: {escape_unprintable(str(error))}", file=sys.stderr)


def _create_prompt_session(
    shell: Shell, input_: Input, output: Output | None
) -> PromptSession[str]:
    """Return the line editor, with its history, completion and toolbar."""
    file = saves.shell_history_path()
    bindings = KeyBindings()

    @bindings.add("f1")
    def _submit_help(event: KeyPressEvent) -> None:
        """Enter and submit the command "help"."""
        event.current_buffer.text = "help"
        event.current_buffer.validate_and_handle()

    return PromptSession(
        history=ShellHistory(shell, FileHistory(str(file)) if file else InMemoryHistory()),
        auto_suggest=AutoSuggestFromHistory(),
        completer=FuzzyCompleter(CommandCompleter(shell.controller), WORD=True),
        complete_while_typing=False,
        bottom_toolbar=lambda: toolbar_text(shell),
        input_processors=[
            ConditionalProcessor(
                HiddenInputProcessor(), Condition(lambda: shell.controller.is_input_hidden)
            )
        ],
        enable_suspend=True,
        key_bindings=bindings,
        color_depth=None if shell.terminal.color else ColorDepth.DEPTH_1_BIT,
        input=input_,
        output=output,
    )


def _prepare_prompt() -> None:
    """Let termination signals exit the prompt, and set how long an ESC waits for its sequence."""
    app, loop = get_app(), asyncio.get_running_loop()
    app.ttimeoutlen = ESCAPE_SECONDS
    if app.output.responds_to_cpr:
        app.ttimeoutlen = REPLY_ESCAPE_SECONDS
        loop.call_later(REPLY_SECONDS, setattr, app, "ttimeoutlen", ESCAPE_SECONDS)
    for number, code in SIGNAL_EXIT_CODES.items():
        loop.add_signal_handler(number, partial(app.exit, exception=SystemExit(code)))


def _show_full_screen(shell: Shell) -> None:
    """Show the game on the full screen; raise SystemExit if a signal ended it.

    Ctrl-C (SIGINT) does not raise it.
    """
    open_viewer = shell.controller.open_viewer
    screen = PlayScreen(shell.controller, shell.terminal, shell.speed)
    code = show_game(screen)
    shell.controller.open_viewer = open_viewer  # The screen has shown algorithms itself.
    _exit_on_signal(code)


def _show_algorithm(shell: Shell, watched: "WatchedSteps") -> str:
    """Show an algorithm on the full screen and return ""; raise SystemExit for a signal."""
    from dmplay.ui.watch.step_viewer import StepViewer

    _exit_on_signal(run_full_screen(StepViewer(watched, shell.terminal, shell.speed)))
    return ""


def _exit_on_signal(code: int) -> None:
    """Raise SystemExit if the exit code is that of a signal, except for Ctrl-C."""
    if code > 128 and code != 128 + signal.SIGINT:
        raise SystemExit(code)
