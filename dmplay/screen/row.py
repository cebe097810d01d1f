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
from dmplay.screen.footer import keys
from dmplay.screen.screen import Screen
from dmplay.signals import INTERRUPTED
from dmplay.styles import fragments
from dmplay.words.commands import Leave
from dmplay.words.completion.candidates import Candidates

MENU = 8  # rows of completions
UNSEEN = " :(what is typed is not shown) "
STYLE = Style.from_dict(
    {"completion-menu": "reverse", "completion-menu.completion.current": "noreverse bold"}
)


class Veil(Processor):
    """Shows nothing of what is typed, not even how much."""

    def apply_transformation(self, transformation_input: TransformationInput) -> Transformation:
        """An empty line, with the cursor at its beginning."""
        return Transformation([], lambda place: 0, lambda place: 0)


class _Inside(Vt100_Output):
    """A terminal whose alternate screen is taken already."""

    def enter_alternate_screen(self) -> None:
        """To its beginning, where the toolkit expects to be."""
        self.write_raw("\x1b[m\x1b[H")

    def quit_alternate_screen(self) -> None:
        """Not yet."""


def opened(
    screen: Screen, painter: Painter, input_: Input, history: History, stop: Callable[[], None]
) -> Application[str | None]:
    """Comes to the line that is typed; None where Esc closes the row. Raises Leave on Ctrl-C."""
    secret = screen.table.secret  # nobody reads another's choice, nor finds it later
    line = Buffer(
        completer=FuzzyCompleter(Candidates(screen.table), WORD=True),
        history=DummyHistory() if secret else history,
        multiline=False,
    )

    def size() -> Size:
        columns, rows = painter.size()
        return Size(rows, columns)

    color = screen.terminal.theme != "mono"
    return Application(
        layout=_layout(screen, painter, line, hidden=secret),
        key_bindings=_bindings(line, stop),
        style=STYLE,
        full_screen=True,
        color_depth=ColorDepth.DEPTH_4_BIT if color else ColorDepth.DEPTH_1_BIT,
        include_default_pygments_style=False,
        input=input_,
        output=_Inside(painter.stream, size, enable_cpr=False),
    )


def _layout(screen: Screen, painter: Painter, line: Buffer, *, hidden: bool) -> Layout:
    def upper() -> StyleAndTextTuples:
        return [*fragments(screen.upper(screen.room(painter)), screen.terminal.theme)]

    def row() -> StyleAndTextTuples:
        shown = keys(screen.game, screen.room(painter), screen.shown)
        return [*fragments(shown, screen.terminal.theme)]

    shown: list[Processor] = [Veil(), BeforeInput(UNSEEN)] if hidden else [BeforeInput(" :")]
    typed = BufferControl(line, input_processors=shown)
    rows = [
        Window(FormattedTextControl(upper)),
        Window(typed, height=1, get_horizontal_scroll=lambda window: 0),  # no further than it must
        Window(FormattedTextControl(row), height=1),
    ]
    if painter.size()[1] < len(rows):  # no room beside what is typed
        rows = rows[1:2]
    menu = Float(CompletionsMenu(max_height=MENU), xcursor=True, ycursor=True)
    return Layout(FloatContainer(HSplit(rows), [menu]), focused_element=typed)


def _bindings(line: Buffer, stop: Callable[[], None]) -> KeyBindings:
    bindings = KeyBindings()

    @bindings.add("c-z")
    def _stop(event: KeyPressEvent) -> None:
        stop()

    @bindings.add("enter")
    def _enter(event: KeyPressEvent) -> None:
        line.append_to_history()
        event.app.exit(result=line.text)

    @bindings.add("escape")
    def _escape(event: KeyPressEvent) -> None:
        event.app.exit(result=None)

    @bindings.add("c-c")
    def _interrupt(event: KeyPressEvent) -> None:
        event.app.exit(exception=Leave(INTERRUPTED))

    return bindings
