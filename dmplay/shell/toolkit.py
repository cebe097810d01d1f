"""The play screen on prompt-toolkit: the event loop, keys, signals and the command row."""

import asyncio
import signal

from prompt_toolkit.application import Application
from prompt_toolkit.buffer import Buffer
from prompt_toolkit.completion import WordCompleter
from prompt_toolkit.filters import Condition, has_focus
from prompt_toolkit.formatted_text import StyleAndTextTuples
from prompt_toolkit.history import InMemoryHistory
from prompt_toolkit.input import Input
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.keys import Keys
from prompt_toolkit.layout import (
    BufferControl,
    ConditionalContainer,
    FormattedTextControl,
    HSplit,
    Layout,
    Window,
)
from prompt_toolkit.layout.processors import (
    BeforeInput,
    ConditionalProcessor,
    PasswordProcessor,
)
from prompt_toolkit.output import ColorDepth, Output
from prompt_toolkit.styles import Style

from dmplay.core import Interval
from dmplay.shell.commands import COMMANDS, Leave
from dmplay.shell.frame import Room, keys, message
from dmplay.shell.paint import fragments
from dmplay.shell.screen import Screen
from dmplay.shell.signals import ENDS

ESCAPE_WAIT = 0.05  # seconds until a lone Esc counts; the library's default is half a second
INTERRUPTED, GONE = 130, 129
NAMES: dict[str, str] = {  # the library's names of keys, as the views name them
    " ": "space",
    Keys.ControlH: "backspace", Keys.ControlI: "tab", Keys.ControlM: "enter",
    Keys.ControlUnderscore: "backspace", Keys.F1: "?", Keys.F2: "N",
}  # fmt: skip


def run(screen: Screen, input_: Input | None = None, output: Output | None = None) -> int:
    """Runs the screen until the player leaves or a signal comes; returns the exit code."""
    line = Buffer(
        completer=WordCompleter(_words(screen), ignore_case=True),
        history=InMemoryHistory(),
        multiline=False,
    )
    board = FormattedTextControl(focusable=True)
    answer, row = FormattedTextControl(), FormattedTextControl()
    app: Application[int] = Application(
        layout=_layout(screen, line, board, answer, row),
        key_bindings=_bindings(screen, board, line),
        style=Style([]),
        full_screen=True,
        color_depth=ColorDepth.DEPTH_4_BIT if screen.terminal.color else ColorDepth.DEPTH_1_BIT,
        include_default_pygments_style=False,
        input=input_,
        output=output,
    )
    app.ttimeoutlen = app.timeoutlen = ESCAPE_WAIT

    def room() -> Room:
        size = app.output.get_size()
        return Room(size.columns, size.rows, screen.terminal.ascii)

    def below() -> StyleAndTextTuples:
        return [*fragments(keys(screen.game, room()), screen.terminal.color)]

    def shown() -> StyleAndTextTuples:
        drawn = fragments(screen.upper(room()), screen.terminal.color)
        at = next((n for n, (_, piece) in enumerate(drawn) if "@" in piece), None)
        board.show_cursor = at is not None  # the cursor stands where the player does
        if at is None:
            return [*drawn]
        style, piece = drawn[at]
        before, you, after = piece.partition("@")
        cell = [(style, before), ("[SetCursorPosition]", ""), (style, you + after)]
        return [*drawn[:at], *cell, *drawn[at + 1 :]]

    board.text, row.text = shown, below
    answer.text = lambda: [*fragments(message(room(), screen.shown), screen.terminal.color)]

    def ready() -> None:
        loop = asyncio.get_running_loop()
        for number, code in (ENDS | {signal.SIGINT: INTERRUPTED}).items():
            loop.add_signal_handler(number, _leave, app, code)
        app.create_background_task(_autoplay(app, screen))
        if screen.rate:
            app.create_background_task(_clock(app, screen, screen.rate))

    try:
        return app.run(pre_run=ready, handle_sigint=False)  # one way for every signal
    except EOFError:  # the terminal is gone
        return GONE


def _leave(app: Application[int], code: int) -> None:
    if not app.is_done:
        app.exit(result=code)


async def _autoplay(app: Application[int], screen: Screen) -> None:
    while True:
        await asyncio.sleep(1 / screen.speed)
        if screen.auto and not screen.game.session.over:
            screen.autoplay()
            app.invalidate()


async def _clock(app: Application[int], screen: Screen, rate: float) -> None:
    loop = asyncio.get_running_loop()
    due = loop.time()
    while True:
        due += 1 / rate
        await asyncio.sleep(max(due - loop.time(), 0.0))
        if screen.tick():
            app.invalidate()


def _words(screen: Screen) -> list[str]:
    labels = screen.game.problem.actions[screen.game.watcher]
    actions = () if isinstance(labels, Interval) else labels
    return [*actions, *(command.name for command in COMMANDS)]


def _layout(
    screen: Screen,
    line: Buffer,
    board: FormattedTextControl,
    answer: FormattedTextControl,
    row: FormattedTextControl,
) -> Layout:
    typing = Condition(lambda: screen.typing)
    several = Condition(lambda: len(screen.game.people) > 1)
    shown = [ConditionalProcessor(PasswordProcessor(), several), BeforeInput(" :")]
    return Layout(
        HSplit(
            [
                Window(board),
                ConditionalContainer(
                    Window(BufferControl(line, input_processors=shown), height=1),
                    typing,
                ),
                ConditionalContainer(Window(answer, height=1), ~typing),
                Window(row, height=1),
            ]
        ),
        focused_element=board,
    )


def _bindings(screen: Screen, board: FormattedTextControl, line: Buffer) -> KeyBindings:
    bindings = KeyBindings()
    playing = has_focus(board)

    def focus(event: KeyPressEvent, typing: bool) -> None:
        screen.typing = typing
        line.reset()
        event.app.layout.focus(line if typing else board)

    @bindings.add("<any>", filter=playing)
    @bindings.add("tab", filter=playing)
    @bindings.add("backspace", filter=playing)
    @bindings.add("enter", filter=playing)
    @bindings.add("escape", filter=playing)
    def _press(event: KeyPressEvent) -> None:
        key = event.key_sequence[0].key
        name = NAMES.get(key, key)
        if name == ":":
            focus(event, True)
            return
        try:
            screen.press(str(getattr(name, "value", name)))
        except Leave:
            _leave(event.app, 0)

    @bindings.add("enter", filter=~playing)
    def _enter(event: KeyPressEvent) -> None:
        text = line.text
        if len(screen.game.people) == 1:  # nobody reads another's choice
            line.append_to_history()
        focus(event, False)
        try:
            screen.type(text)
        except Leave:
            _leave(event.app, 0)

    @bindings.add("escape", filter=~playing)
    def _escape(event: KeyPressEvent) -> None:
        focus(event, False)

    @bindings.add("c-c")
    def _interrupt(event: KeyPressEvent) -> None:
        _leave(event.app, INTERRUPTED)

    @bindings.add("c-d", filter=playing)
    def _end(event: KeyPressEvent) -> None:
        _leave(event.app, 0)

    @bindings.add("c-z")
    def _suspend(event: KeyPressEvent) -> None:
        event.app.suspend_to_background()

    @bindings.add("c-l")
    def _repaint(event: KeyPressEvent) -> None:
        event.app.renderer.clear()

    return bindings
