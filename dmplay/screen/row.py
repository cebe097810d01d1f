"""The command row of the play screen, with history and completion, as prompt-toolkit edits it."""

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

from dmplay.painting.painter import Painter
from dmplay.screen.footer import format_footer
from dmplay.screen.screen import PlayScreen
from dmplay.signals import INTERRUPTED_EXIT_CODE
from dmplay.styles import to_fragments
from dmplay.words.commands import PlayerQuit
from dmplay.words.completion.candidates import CommandCompleter

MAX_COMPLETION_ROWS = 8  # rows of completions
HIDDEN_INPUT_PROMPT = " :(what is typed is not shown) "
PROMPT_STYLE = Style.from_dict(
    {"completion-menu": "reverse", "completion-menu.completion.current": "noreverse bold"}
)


class HiddenInputProcessor(Processor):
    """Shows nothing of what is typed, not even how much."""

    def apply_transformation(self, transformation_input: TransformationInput) -> Transformation:
        """An empty line, with the cursor at its beginning."""
        return Transformation([], lambda place: 0, lambda place: 0)


class _NestedScreenOutput(Vt100_Output):
    """A terminal whose alternate screen is taken already."""

    def enter_alternate_screen(self) -> None:
        """To its beginning, where the toolkit expects to be."""
        self.write_raw("\x1b[m\x1b[H")

    def quit_alternate_screen(self) -> None:
        """Not yet."""


def create_application(
    screen: PlayScreen,
    painter: Painter,
    input_: Input,
    history: History,
    suspend: Callable[[], None],
) -> Application[str | None]:
    """Comes to the line that is typed; None where Esc closes the row. Raises Leave on Ctrl-C."""
    secret = screen.controller.is_input_hidden  # nobody reads another's choice, nor finds it later
    line = Buffer(
        completer=FuzzyCompleter(CommandCompleter(screen.controller), WORD=True),
        history=DummyHistory() if secret else history,
        multiline=False,
    )

    def get_size() -> Size:
        columns, rows = painter.get_size()
        return Size(rows, columns)

    color = screen.terminal.theme != "mono"
    return Application(
        layout=_build_layout(screen, painter, line, is_input_hidden=secret),
        key_bindings=_build_key_bindings(line, suspend),
        style=PROMPT_STYLE,
        full_screen=True,
        color_depth=ColorDepth.DEPTH_4_BIT if color else ColorDepth.DEPTH_1_BIT,
        include_default_pygments_style=False,
        input=input_,
        output=_NestedScreenOutput(painter.stream, get_size, enable_cpr=False),
    )


def _build_layout(
    screen: PlayScreen, painter: Painter, input_buffer: Buffer, *, is_input_hidden: bool
) -> Layout:
    def upper_fragments() -> StyleAndTextTuples:
        return [
            *to_fragments(
                screen.render_upper(screen.measure_viewport(painter)), screen.terminal.theme
            )
        ]

    def footer_fragments() -> StyleAndTextTuples:
        shown = format_footer(screen.game, screen.measure_viewport(painter), screen.frame_state)
        return [*to_fragments(shown, screen.terminal.theme)]

    shown: list[Processor] = (
        [HiddenInputProcessor(), BeforeInput(HIDDEN_INPUT_PROMPT)]
        if is_input_hidden
        else [BeforeInput(" :")]
    )
    typed = BufferControl(input_buffer, input_processors=shown)
    rows = [
        Window(FormattedTextControl(upper_fragments)),
        Window(typed, height=1, get_horizontal_scroll=lambda window: 0),  # no further than it must
        Window(FormattedTextControl(footer_fragments), height=1),
    ]
    if painter.get_size()[1] < len(rows):  # no room beside what is typed
        rows = rows[1:2]
    menu = Float(CompletionsMenu(max_height=MAX_COMPLETION_ROWS), xcursor=True, ycursor=True)
    return Layout(FloatContainer(HSplit(rows), [menu]), focused_element=typed)


def _build_key_bindings(input_buffer: Buffer, suspend: Callable[[], None]) -> KeyBindings:
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
