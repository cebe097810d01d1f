"""The shell on a terminal: line editing, history, completion and a toolbar."""

import asyncio
import signal
import sys
from collections.abc import Iterable
from functools import partial

from prompt_toolkit import PromptSession
from prompt_toolkit.application import get_app
from prompt_toolkit.auto_suggest import AutoSuggestFromHistory
from prompt_toolkit.completion import FuzzyCompleter
from prompt_toolkit.filters import Condition
from prompt_toolkit.history import FileHistory, History, InMemoryHistory
from prompt_toolkit.input import Input
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.layout.processors import ConditionalProcessor
from prompt_toolkit.output import ColorDepth, Output

from dmplay.errors import DmplayError
from dmplay.game import saves
from dmplay.screen.row import Veil
from dmplay.screen.screen import Screen
from dmplay.screen.show import show
from dmplay.signals import ENDS, INTERRUPTED, leaving
from dmplay.terminal import clean
from dmplay.words.commands import Leave
from dmplay.words.completion.candidates import Candidates
from dmplay.words.shell import Shell

SHORT = 24  # characters of a state that the toolbar has room for


class Typed(InMemoryHistory):
    """The lines typed, but for choices that another person must not see."""

    def __init__(self, shell: Shell, kept: History) -> None:
        super().__init__()
        self._shell, self._kept = shell, kept

    def load_history_strings(self) -> Iterable[str]:
        """The lines of all sessions, the last first."""
        return self._kept.load_history_strings()

    def append_string(self, string: str) -> None:
        """Keeps a line."""
        if not self._shell.table.secret:
            super().append_string(string)

    def store_string(self, string: str) -> None:
        """Writes a line down."""
        self._kept.store_string(string)


def toolbar(shell: Shell) -> str:
    """Score, place and the key for help."""
    facts = []
    if shell.game:
        view = shell.game.view()
        if view.rewards is not None:
            facts.append(f"score {shell.game.account.returned(shell.game.moment()):.2f}")
        if not view.problem.hidden and view.problem.states != 1:
            at = view.problem.notation(view.observation)
            facts += [f"at {at}"] if len(at) <= SHORT else []
        elif view.problem.hidden and view.turn:
            facts.append(f"saw {view.problem.observations[view.seat].told(view.observation)}")
    between = " - " if shell.terminal.ascii else " · "
    return f" {between.join([*facts, 'F1 help'])}"


def run(shell: Shell, input_: Input | None = None, output: Output | None = None) -> int:
    """Asks for lines until the player leaves; returns the exit code."""
    session = _session(shell, input_, output)
    shell.table.open_screen = lambda: _screen(shell)
    warned = False
    while True:
        try:
            if shell.curtained:
                with leaving():
                    shell.change_places(again=warned)
            line = session.prompt(lambda: shell.prompt, pre_run=_ready, handle_sigint=True)
        except KeyboardInterrupt:
            empty = shell.curtained or not session.default_buffer.text
            if empty and warned:
                return INTERRUPTED
            warned = empty
            if empty:
                print("Ctrl-C once more leaves; so do quit and Ctrl-D.")
            continue
        except EOFError:
            return 0
        warned = False
        try:
            with leaving():  # the library puts back no handler but its own
                shell.do(line)
        except Leave:
            return 0
        except KeyboardInterrupt:
            print("interrupted.")
        except DmplayError as error:
            print(f"error: {clean(str(error))}", file=sys.stderr)


def _session(shell: Shell, input_: Input | None, output: Output | None) -> PromptSession[str]:
    """The line editor, with its history, completion and toolbar."""
    file = saves.history()
    bindings = KeyBindings()

    @bindings.add("f1")
    def _help(event: KeyPressEvent) -> None:
        event.current_buffer.text = "help"
        event.current_buffer.validate_and_handle()

    return PromptSession(
        history=Typed(shell, FileHistory(str(file)) if file else InMemoryHistory()),
        auto_suggest=AutoSuggestFromHistory(),
        completer=FuzzyCompleter(Candidates(shell.table), WORD=True),
        complete_while_typing=False,
        bottom_toolbar=lambda: toolbar(shell),
        input_processors=[ConditionalProcessor(Veil(), Condition(lambda: shell.table.secret))],
        enable_suspend=True,
        key_bindings=bindings,
        color_depth=None if shell.terminal.color else ColorDepth.DEPTH_1_BIT,
        input=input_,
        output=output,
    )


def _ready() -> None:
    """Lets the signals that end a program end the prompt."""
    app, loop = get_app(), asyncio.get_running_loop()
    for number, code in ENDS.items():
        loop.add_signal_handler(number, partial(app.exit, exception=SystemExit(code)))


def _screen(shell: Shell) -> str:
    """Shows the game on the full screen."""
    code = show(Screen(shell.table, shell.terminal, shell.speed))
    if code > 128 and code != 128 + signal.SIGINT:
        raise SystemExit(code)
    return ""
