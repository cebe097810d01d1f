"""The command row of the play screen, edited by prompt_toolkit with history and completion."""

from collections.abc import Callable

from prompt_toolkit.application import Application
from prompt_toolkit.buffer import Buffer
from prompt_toolkit.completion import FuzzyCompleter
from prompt_toolkit.data_structures import Size
from prompt_toolkit.formatted_text import StyleAndTextTuples
from prompt_toolkit.history import DummyHistory, History
from prompt_toolkit.input import Input
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.layout import (
    BufferControl,
    CompletionsMenu,
    Float,
    FloatContainer,
    FormattedTextControl,
    HSplit,
    Layout,
    Window,
)
from prompt_toolkit.layout.processors import (
    BeforeInput,
    Processor,
    Transformation,
    TransformationInput,
)
from prompt_toolkit.output import ColorDepth
from prompt_toolkit.output.vt100 import Vt100_Output
from prompt_toolkit.styles import Style

from dmplay.terminal.painter import Painter
from dmplay.terminal.signals import INTERRUPTED_EXIT_CODE
from dmplay.terminal.styles import to_fragments
from dmplay.ui.screen.footer import format_footer
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.shell.commands import PlayerQuit
from dmplay.ui.shell.completer import CommandCompleter

MAX_COMPLETION_ROWS = 8  # rows
HIDDEN_INPUT_PROMPT = " :(your typing is hidden) "
PROMPT_STYLE = Style.from_dict(
    {"completion-menu": "reverse", "completion-menu.completion.current": "noreverse bold"}
)


class HiddenInputProcessor(Processor):
    """A processor that hides the typed text and its length."""

    def apply_transformation(self, transformation_input: TransformationInput) -> Transformation:
        """Return an empty line with the cursor at its start."""
        return Transformation([], lambda position: 0, lambda position: 0)


class _NestedScreenOutput(Vt100_Output):
    """A terminal output that is already on the alternate screen."""

    def enter_alternate_screen(self) -> None:
        """Move the cursor to the top left, where prompt_toolkit expects it."""
        self.write_raw("\x1b[m\x1b[H")

    def quit_alternate_screen(self) -> None:
        """Stay on the alternate screen: the play screen still uses it."""


def create_application(
    screen: PlayScreen,
    painter: Painter,
    input_: Input,
    history: History,
    suspend: Callable[[], None],
) -> Application[str | None]:
    """Create the application that reads one command line.

    Its result is the line, or None after Esc; it raises PlayerQuit on Ctrl-C. While several people
    share the keyboard, the input is hidden and not saved in the history.
    """
    # Other players must not read a choice, now or later in the history.
    is_hidden = screen.controller.is_input_hidden
    input_buffer = Buffer(
        completer=FuzzyCompleter(CommandCompleter(screen.controller), WORD=True),
        history=DummyHistory() if is_hidden else history,
        multiline=False,
    )

    def get_size() -> Size:
        columns, rows = painter.get_size()
        return Size(rows, columns)

    has_color = screen.terminal.theme != "mono"
    return Application(
        layout=_build_layout(screen, painter, input_buffer, is_input_hidden=is_hidden),
        key_bindings=_build_key_bindings(input_buffer, suspend),
        style=PROMPT_STYLE,
        full_screen=True,
        color_depth=ColorDepth.DEPTH_8_BIT if has_color else ColorDepth.DEPTH_1_BIT,
        include_default_pygments_style=False,
        input=input_,
        output=_NestedScreenOutput(painter.stream, get_size, enable_cpr=False),
    )


def _build_layout(
    screen: PlayScreen, painter: Painter, input_buffer: Buffer, *, is_input_hidden: bool
) -> Layout:
    """Return the layout: the screen above, the command row, the key row and the completion menu.

    Only the command row if the terminal has no more rows.
    """

    def upper_fragments() -> StyleAndTextTuples:
        """Return the screen above the command row for prompt_toolkit."""
        return [
            *to_fragments(
                screen.render_upper(screen.measure_viewport(painter)), screen.terminal.theme
            )
        ]

    def footer_fragments() -> StyleAndTextTuples:
        """Return the key row for prompt_toolkit."""
        footer = format_footer(screen.game, screen.measure_viewport(painter), screen.frame_state)
        return [*to_fragments(footer, screen.terminal.theme)]

    processors: list[Processor] = (
        [HiddenInputProcessor(), BeforeInput(HIDDEN_INPUT_PROMPT)]
        if is_input_hidden
        else [BeforeInput(" :")]
    )
    command_control = BufferControl(input_buffer, input_processors=processors)
    rows = [
        Window(FormattedTextControl(upper_fragments)),
        # no horizontal scrolling
        Window(command_control, height=1, get_horizontal_scroll=lambda window: 0),
        Window(FormattedTextControl(footer_fragments), height=1),
    ]
    if painter.get_size()[1] < len(rows):  # too few rows for anything but the input
        rows = rows[1:2]
    menu = Float(CompletionsMenu(max_height=MAX_COMPLETION_ROWS), xcursor=True, ycursor=True)
    return Layout(FloatContainer(HSplit(rows), [menu]), focused_element=command_control)


def _build_key_bindings(input_buffer: Buffer, suspend: Callable[[], None]) -> KeyBindings:
    """Return the key bindings of the command row: Enter, Esc, Ctrl-C and Ctrl-Z."""
    bindings = KeyBindings()

    @bindings.add("c-z")
    def _suspend(event: KeyPressEvent) -> None:
        suspend()

    @bindings.add("enter")
    def _enter(event: KeyPressEvent) -> None:
        input_buffer.append_to_history()
        event.app.exit(result=input_buffer.text)

    @bindings.add("escape")
    def _escape(event: KeyPressEvent) -> None:
        event.app.exit(result=None)

    @bindings.add("c-c")
    def _interrupt(event: KeyPressEvent) -> None:
        event.app.exit(exception=PlayerQuit(INTERRUPTED_EXIT_CODE))

    return bindings
