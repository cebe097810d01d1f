"""The full screen without a terminal: a game, keys, and every frame as it would be written."""

import io
import re
import traceback

from prompt_toolkit.completion import CompleteEvent
from prompt_toolkit.document import Document

from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.errors import DmplayError
from dmplay.game.command_line_results import PlayCommand
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_game
from dmplay.terminal.capabilities import Terminal
from dmplay.terminal.painter import Painter
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.play_operations import run_typed_line
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.shell.commands import PlayerQuit
from dmplay.ui.shell.completer import CommandCompleter
from tests.fuzz.case import Case, CaseOutcome
from tests.fuzz.program import enter_case_folder

# the control sequences that a painter writes itself
CURSOR_PATTERN = re.compile(r"\x1b(\[[0-9;?]*[A-Za-z]|[DM])|[\r\x08]")
COMMAND_KEY = ":"


class StringPainter(Painter):
    """A painter of a fixed size that writes into a string."""

    def __init__(self, size: tuple[int, int]) -> None:
        self.paper = io.StringIO()
        super().__init__(self.paper, "default")
        self._dimensions = size

    def get_size(self) -> tuple[int, int]:
        return self._dimensions

    @property
    def text(self) -> str:
        """Everything that was written, without the sequences that move the cursor."""
        return CURSOR_PATTERN.sub("", self.paper.getvalue())


def run_screen(case: Case) -> CaseOutcome:
    """Play the game of a case on the full screen, pressing its keys in order."""
    canvas, trace = StringPainter(case.size), ""
    with enter_case_folder(case):
        try:
            ending = _play_keys(case, canvas)
        except Exception as error:
            ending, trace = type(error).__name__, traceback.format_exc()
    return CaseOutcome(ending, canvas.text, trace=trace)


def _play_keys(case: Case, canvas: StringPainter) -> str:
    table = GameController(cli_interpreter=interpret_command)
    try:
        play_command = interpret_command(case.words)
        assert isinstance(play_command, PlayCommand)
        table.set_game(start_game(play_command.request))
    except DmplayError:
        return "refused"
    play_screen = PlayScreen(table, Terminal(True, "", True, True, False))
    try:
        for key in case.keys:
            play_screen.paint(canvas)
            _press_key(play_screen, key, canvas)
        play_screen.paint(canvas)
    except PlayerQuit:
        return "left"
    finally:
        table.end_game()
    return "played"


def _press_key(play_screen: PlayScreen, key: str, canvas: StringPainter) -> None:
    if not key.startswith(COMMAND_KEY):
        handle_key(play_screen, key)
        return
    line = key.removeprefix(COMMAND_KEY)
    completions = CommandCompleter(play_screen.controller).get_completions(
        Document(line), CompleteEvent()
    )
    canvas.paper.write("\n".join(completion.display_text for completion in completions))
    run_typed_line(play_screen, line)
