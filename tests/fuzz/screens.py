"""The full screen without a terminal: a game, keys, and every frame as it would be written."""

import io
import re
import traceback

from prompt_toolkit.completion import CompleteEvent
from prompt_toolkit.document import Document

from dmplay.cli.errands import interpret_command
from dmplay.errors import DmplayError
from dmplay.game.errand import PlayCommand
from dmplay.game.start import start_game
from dmplay.game.table import GameController
from dmplay.painting.painter import Painter
from dmplay.screen.acts import run_typed_line
from dmplay.screen.press import handle_key
from dmplay.screen.screen import PlayScreen
from dmplay.terminal import Terminal
from dmplay.words.commands import PlayerQuit
from dmplay.words.completion.candidates import CommandCompleter
from tests.fuzz.case import Case, Told
from tests.fuzz.program import laid_out

STEERS = re.compile(r"\x1b(\[[0-9;?]*[A-Za-z]|[DM])|[\r\x08]")  # what a painter writes of its own
COMMAND = ":"


class Canvas(Painter):
    """A painter of a size, into a string."""

    def __init__(self, size: tuple[int, int]) -> None:
        self.paper = io.StringIO()
        super().__init__(self.paper, "default")
        self._dimensions = size

    def get_size(self) -> tuple[int, int]:
        return self._dimensions

    @property
    def text(self) -> str:
        """All that was written, but for what steers the cursor."""
        return STEERS.sub("", self.paper.getvalue())


def screen(case: Case) -> Told:
    """The game of a case on the screen, its keys pressed one after the other."""
    canvas, trace = Canvas(case.size), ""
    with laid_out(case):
        try:
            ending = _played(case, canvas)
        except Exception as error:
            ending, trace = type(error).__name__, traceback.format_exc()
    return Told(ending, canvas.text, trace=trace)


def _played(case: Case, canvas: Canvas) -> str:
    table = GameController(cli_interpreter=interpret_command)
    try:
        sitting = interpret_command(case.words)
        assert isinstance(sitting, PlayCommand)
        table.set_game(start_game(sitting.request))
    except DmplayError:
        return "refused"
    shown = PlayScreen(table, Terminal(True, "", True, True, False))
    try:
        for key in case.keys:
            shown.paint(canvas)
            _pressed(shown, key, canvas)
        shown.paint(canvas)
    except PlayerQuit:
        return "left"
    finally:
        table.end_game()
    return "played"


def _pressed(shown: PlayScreen, key: str, canvas: Canvas) -> None:
    if not key.startswith(COMMAND):
        handle_key(shown, key)
        return
    line = key.removeprefix(COMMAND)
    found = CommandCompleter(shown.controller).get_completions(Document(line), CompleteEvent())
    canvas.paper.write("\n".join(one.display_text for one in found))
    run_typed_line(shown, line)
