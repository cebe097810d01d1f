"""The full screen without a terminal: a game, keys, and every frame as it would be written."""

import io
import re
import traceback

from prompt_toolkit.completion import CompleteEvent
from prompt_toolkit.document import Document

from dmplay.cli.errands import understood
from dmplay.errors import DmplayError
from dmplay.game.errand import Sitting
from dmplay.game.start import begin
from dmplay.game.table import Table
from dmplay.painting.painter import Painter
from dmplay.screen.acts import obey
from dmplay.screen.press import press
from dmplay.screen.screen import Screen
from dmplay.terminal import Terminal
from dmplay.words.commands import Leave
from dmplay.words.completion.candidates import Candidates
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

    def size(self) -> tuple[int, int]:
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
    table = Table(program=understood)
    try:
        sitting = understood(case.words)
        assert isinstance(sitting, Sitting)
        table.put(begin(sitting.wanted))
    except DmplayError:
        return "refused"
    shown = Screen(table, Terminal(True, "", True, True, False))
    try:
        for key in case.keys:
            shown.paint(canvas)
            _pressed(shown, key, canvas)
        shown.paint(canvas)
    except Leave:
        return "left"
    finally:
        table.end()
    return "played"


def _pressed(shown: Screen, key: str, canvas: Canvas) -> None:
    if not key.startswith(COMMAND):
        press(shown, key)
        return
    line = key.removeprefix(COMMAND)
    found = Candidates(shown.table).get_completions(Document(line), CompleteEvent())
    canvas.paper.write("\n".join(one.display_text for one in found))
    obey(shown, line)
