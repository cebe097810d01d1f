"""The front ends with somebody before them: all that comes of each line or key, byte for byte."""

import io
import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from typing import NamedTuple

from rich.text import Text

from dmplay.cli.errands import interpret_command
from dmplay.errors import DmplayError
from dmplay.game import saves
from dmplay.game.game import Game
from dmplay.game.table import GameController
from dmplay.painting.painter import Painter
from dmplay.painting.writing import ScreenPosition
from dmplay.prompt import toolbar_text
from dmplay.screen.acts import run_typed_line
from dmplay.screen.modes import Mode
from dmplay.screen.press import handle_key
from dmplay.screen.screen import PlayScreen
from dmplay.terminal import Terminal
from dmplay.words.commands import PlayerQuit
from dmplay.words.plain import JsonReporter, Reporter, SentenceReporter, play_by_lines
from dmplay.words.shell import Shell
from tests.privacy.pairs import BEGUN, Pair, Side

FILE = Path("game.dmt")
DRAWN = Terminal(
    full_screen=True, plain_reason="", is_interactive=True, color=True, ascii=False, width=80
)
IN_LINES = DRAWN._replace(full_screen=False, plain_reason="--plain", color=False)


class Told(NamedTuple):
    """What somebody did, and all that came of it."""

    done: str
    came: str


Front = Callable[[Game, Sequence[str]], list[Told]]
Play = Callable[[Side], list[Told]]


def alike(one: Sequence[Told], other: Sequence[Told]) -> None:
    """Nothing that comes of anything tells two games apart."""
    for first, second in zip(one, other, strict=True):
        assert first == second, f"after {first.done!r} the games can be told apart"


def apart(one: Sequence[Told], other: Sequence[Told]) -> bool:
    """Whether anything tells two games apart."""
    return [*one] != [*other]


def emptied(place: Path) -> None:
    """Removes all that was written in a folder."""
    for path in place.iterdir():
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    saves.prepare_folder.cache_clear()


def both(pair: Pair, place: Path, play: Play) -> tuple[list[Told], list[Told]]:
    """What comes of both games, each in the empty folder."""
    heard = []
    for side in pair.sides:
        emptied(place)
        heard.append(play(side))
    while BEGUN:  # nobody goes on with any of them
        if recorder := BEGUN.pop().recorder:
            recorder.close()
    return heard[0], heard[1]


def readable(place: Path) -> Iterator[Told]:
    """The files that others can read: name, and content."""
    for folder, folders, files in os.walk(place):
        folders[:] = sorted(each for each in folders if Path(folder, each).stat().st_mode & 0o005)
        for path in (Path(folder, name) for name in sorted(files)):
            if path.stat().st_mode & 0o044:
                yield Told(f"read {path.relative_to(place)}", path.read_text(encoding="utf-8"))
            else:
                yield Told("names of files", str(path.relative_to(place)))


class Paper(io.StringIO):
    """What is printed, taken off line by line."""

    encoding = "utf-8"

    def taken(self) -> str:
        """What was printed since the last time."""
        told = self.getvalue()
        self.seek(0)
        self.truncate()
        return told


@contextmanager
def printed() -> Iterator[Paper]:
    """All that is printed, errors too."""
    paper = Paper()
    with redirect_stdout(paper), redirect_stderr(paper):
        yield paper


class Typist(io.StringIO):
    """A person who types these lines, and writes down what came of each."""

    def __init__(self, lines: Sequence[str], paper: Paper) -> None:
        super().__init__("".join(f"{line}\n" for line in lines))
        self._paper = paper
        self._done = "begin"
        self.heard: list[Told] = []

    def readline(self, size: int = -1, /) -> str:  # type: ignore[override] # of text, not of bytes
        """The next line."""
        self.heard.append(Told(self._done, self._paper.taken()))
        line = super().readline()
        self._done = line.strip()
        return line


class Endless(SentenceReporter):
    """Sentences up to the end, which may tell all."""

    def report_end(self, game: Game) -> None:
        """Says nothing."""


class EndlessObjects(JsonReporter):
    """Data up to the end."""

    def report_end(self, game: Game) -> None:
        """Says nothing."""


def to_the_end(reporter: Reporter) -> Front:
    """What plain lines or JSON tell, of the end too."""

    def play(game: Game, lines: Sequence[str]) -> list[Told]:
        with printed() as paper:
            typist = Typist(lines, paper)
            play_by_lines(GameController(game, interpret_command), IN_LINES, typist, reporter)
            return [*typist.heard, Told("the end", paper.taken())]

    return play


def shell(game: Game, lines: Sequence[str]) -> list[Told]:
    """The typed shell on a terminal: prompt, toolbar, boards and words."""
    made = Shell(GameController(game, interpret_command), DRAWN)
    heard = []
    with printed() as paper:
        for line in lines:
            try:
                made.run_line(line)
            except PlayerQuit:
                break
            except DmplayError as error:
                print(error)
            heard.append(Told(line, "\n".join([paper.taken(), made.prompt, toolbar_text(made)])))
    return heard


class Canvas(Painter):
    """A painter that writes down each frame: what a terminal is sent for it follows from it."""

    def __init__(self, size: tuple[int, int]) -> None:
        self.paper = Paper()
        super().__init__(self.paper, "default")
        self._dimensions = size

    def get_size(self) -> tuple[int, int]:
        """The paper's."""
        return self._dimensions

    def paint(self, frame: Text, cursor: ScreenPosition | None = None) -> None:
        """Writes the whole frame, its styles, and where the cursor stands."""
        self.paper.write(f"{frame.plain}\n{frame.spans}\n{cursor}\n")


class Looked:
    """A screen, and all that it shows after each line or key."""

    def __init__(self, game: Game, size: tuple[int, int] = (80, 24)) -> None:
        self.screen = PlayScreen(GameController(game, interpret_command), DRAWN)
        self.canvas = Canvas(size)
        self.heard: list[Told] = []
        self._look("begin")

    def do(self, done: str) -> None:
        """Presses a `<key>`, unless it plays, or types a line into the command row."""
        key = done.removeprefix("<").removesuffix(">")
        if done == key:
            run_typed_line(self.screen, done)
        elif self.screen.game.keyboard.find_key_action(self.screen.game.viewing_seat, key) is None:
            self.handle_key(key)
            return
        self._look(done)

    def handle_key(self, key: str) -> None:
        """Presses a key, and reads to the end what it shows."""
        handle_key(self.screen, key)
        self._look(key)
        while self.screen.modes.display_mode is Mode.PAGE:
            handle_key(self.screen, "space")
            self._look(f"{key}, and more")

    def _look(self, done: str) -> None:
        """Writes down what is shown now."""
        self.canvas.invalidate()
        self.screen.paint(self.canvas)
        seen = [self.screen.message, *self.screen.page_rows, self.canvas.paper.taken()]
        self.heard.append(Told(done, "\n".join(seen)))


def on_screen(size: tuple[int, int]) -> Front:
    """The full screen."""

    def play(game: Game, lines: Sequence[str]) -> list[Told]:
        looked = Looked(game, size)
        with suppress(PlayerQuit):
            for line in lines:
                looked.do(line)
        return looked.heard

    return play


FRONTS: dict[str, Front] = {
    "screen": on_screen((80, 24)),
    "plain": to_the_end(Endless(IN_LINES)),
    "json": to_the_end(EndlessObjects()),
    "shell": shell,
}
