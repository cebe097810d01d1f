"""The front ends with a scripted player: everything that they write for each line or key."""

import io
import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from typing import NamedTuple

from rich.text import Text

from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.errors import DmplayError
from dmplay.game import saves
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.terminal.capabilities import Terminal
from dmplay.terminal.painter import Painter, ScreenPosition
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.modes import Mode
from dmplay.ui.screen.play_operations import run_typed_line
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.shell.command_shell import Shell
from dmplay.ui.shell.commands import PlayerQuit
from dmplay.ui.shell.interactive_shell import toolbar_text
from dmplay.ui.shell.plain_mode import JsonReporter, Reporter, SentenceReporter, play_by_lines
from tests.privacy.indistinguishable_pairs import OPEN_GAMES, Pair, Side

TRANSCRIPT_PATH = Path("game.dmt")
SCREEN_TERMINAL = Terminal(
    full_screen=True, plain_reason="", is_interactive=True, color=True, ascii=False, width=80
)
PLAIN_TERMINAL = SCREEN_TERMINAL._replace(full_screen=False, plain_reason="--plain", color=False)


class Response(NamedTuple):
    """An input line or key, and all output that followed it."""

    done: str
    output: str


FrontEnd = Callable[[Game, Sequence[str]], list[Response]]
PlaySide = Callable[[Side], list[Response]]


def assert_indistinguishable(
    responses: Sequence[Response], other_responses: Sequence[Response]
) -> None:
    """Assert that two games gave the same output after every input."""
    for first, second in zip(responses, other_responses, strict=True):
        assert first == second, f"after {first.done!r} the games can be told apart"


def are_distinguishable(responses: Sequence[Response], other_responses: Sequence[Response]) -> bool:
    """Return whether any output distinguishes two games."""
    return [*responses] != [*other_responses]


def empty_folder(folder: Path) -> None:
    """Remove everything in a folder but the files of problems."""
    for path in {*folder.iterdir()} - {*folder.glob("*.efg")}:
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    saves.prepare_folder.cache_clear()


def play_both(pair: Pair, folder: Path, play: PlaySide) -> tuple[list[Response], list[Response]]:
    """Return the responses of both games, each played in the emptied folder."""
    responses = []
    for side in pair.sides:
        empty_folder(folder)
        responses.append(play(side))
    while OPEN_GAMES:  # none of these games is resumed
        if recorder := OPEN_GAMES.pop().recorder:
            recorder.close()
    return responses[0], responses[1]


def iter_readable_files(folder: Path) -> Iterator[Response]:
    """Yield the name of every file, and the content of those that other users can read."""
    for parent, folders, files in os.walk(folder):
        folders[:] = sorted(
            subfolder for subfolder in folders if Path(parent, subfolder).stat().st_mode & 0o005
        )
        for path in (Path(parent, name) for name in sorted(files)):
            if path.stat().st_mode & 0o044:
                yield Response(f"read {path.relative_to(folder)}", path.read_text(encoding="utf-8"))
            else:
                yield Response("names of files", str(path.relative_to(folder)))


class CapturedOutput(io.StringIO):
    """Captured output that is read step by step."""

    encoding = "utf-8"

    def taken(self) -> str:
        """Return the output since the last call."""
        text = self.getvalue()
        self.seek(0)
        self.truncate()
        return text


@contextmanager
def capture_output() -> Iterator[CapturedOutput]:
    """Capture standard output and standard error."""
    output = CapturedOutput()
    with redirect_stdout(output), redirect_stderr(output):
        yield output


class ScriptedInput(io.StringIO):
    """Standard input that types these lines and records the output after each."""

    def __init__(self, lines: Sequence[str], output: CapturedOutput) -> None:
        super().__init__("".join(f"{line}\n" for line in lines))
        self._paper = output
        self._done = "begin"
        self.heard: list[Response] = []

    def readline(self, size: int = -1, /) -> str:  # type: ignore[override] # of text, not of bytes
        """Return the next line."""
        self.heard.append(Response(self._done, self._paper.taken()))
        line = super().readline()
        self._done = line.strip()
        return line


class SentencesWithoutEnd(SentenceReporter):
    """Sentences without the end, which may reveal everything."""

    def report_end(self, game: Game) -> None:
        """Print nothing."""


class ObjectsWithoutEnd(JsonReporter):
    """JSON objects without the end."""

    def report_end(self, game: Game) -> None:
        """Print nothing."""


def make_line_front_end(reporter: Reporter) -> FrontEnd:
    """Return a front end that reads lines and prints with this reporter, the end included."""

    def play(game: Game, lines: Sequence[str]) -> list[Response]:
        with capture_output() as output:
            stdin = ScriptedInput(lines, output)
            play_by_lines(GameController(game, interpret_command), PLAIN_TERMINAL, stdin, reporter)
            return [*stdin.heard, Response("the end", output.taken())]

    return play


def play_in_shell(game: Game, lines: Sequence[str]) -> list[Response]:
    """Play lines in the shell on a terminal: prompt, toolbar, boards and text."""
    shell_session = Shell(GameController(game, interpret_command), SCREEN_TERMINAL)
    responses = []
    with capture_output() as output:
        for line in lines:
            try:
                shell_session.run_line(line)
            except PlayerQuit:
                break
            except DmplayError as error:
                print(error)
            responses.append(
                Response(
                    line,
                    "\n".join([output.taken(), shell_session.prompt, toolbar_text(shell_session)]),
                )
            )
    return responses


class RecordingPainter(Painter):
    """A painter that records each frame; the bytes sent to a terminal follow from the frames."""

    def __init__(self, size: tuple[int, int]) -> None:
        self.paper = CapturedOutput()
        super().__init__(self.paper, "default")
        self._dimensions = size

    def get_size(self) -> tuple[int, int]:
        """Return the number of columns and rows."""
        return self._dimensions

    def paint(self, frame: Text, cursor: ScreenPosition | None = None) -> None:
        """Record the whole frame, its styles and the position of the cursor."""
        self.paper.write(f"{frame.plain}\n{frame.spans}\n{cursor}\n")


class RecordedScreen:
    """A screen, and everything that it shows after each line or key."""

    def __init__(self, game: Game, size: tuple[int, int] = (80, 24)) -> None:
        self.screen = PlayScreen(GameController(game, interpret_command), SCREEN_TERMINAL)
        self.canvas = RecordingPainter(size)
        self.heard: list[Response] = []
        self._look("begin")

    def do(self, input_text: str) -> None:
        """Press a `<key>` unless it plays an action, or type a line into the command row."""
        key = input_text.removeprefix("<").removesuffix(">")
        if input_text == key:
            run_typed_line(self.screen, input_text)
        elif self.screen.game.keyboard.find_key_action(self.screen.game.viewing_seat, key) is None:
            self.handle_key(key)
            return
        self._look(input_text)

    def handle_key(self, key: str) -> None:
        """Press a key, and page through everything that it shows."""
        handle_key(self.screen, key)
        self._look(key)
        while self.screen.modes.display_mode is Mode.PAGE:
            handle_key(self.screen, "space")
            self._look(f"{key}, and more")

    def _look(self, input_text: str) -> None:
        """Record the frame that the screen shows."""
        self.canvas.mark_screen_unknown()
        self.screen.paint(self.canvas)
        parts = [self.screen.message, *self.screen.page_rows, self.canvas.paper.taken()]
        self.heard.append(Response(input_text, "\n".join(parts)))


def make_screen_front_end(size: tuple[int, int]) -> FrontEnd:
    """Return a front end on a full screen of this size."""

    def play(game: Game, lines: Sequence[str]) -> list[Response]:
        recorded = RecordedScreen(game, size)
        with suppress(PlayerQuit):
            for line in lines:
                recorded.do(line)
        return recorded.heard

    return play


FRONT_ENDS: dict[str, FrontEnd] = {
    "screen": make_screen_front_end((80, 24)),
    "plain": make_line_front_end(SentencesWithoutEnd(PLAIN_TERMINAL)),
    "json": make_line_front_end(ObjectsWithoutEnd()),
    "shell": play_in_shell,
}
