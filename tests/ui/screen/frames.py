"""Draw what a player sees of every problem in terminals of four sizes: one game, five moments.

`python -m tests.ui.screen.frames` redraws these frames and the pictures in
`transcripts/README.md`; read the diff in a review.
"""

import json
import os
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from rich.text import Text

from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.registry.builtin_names import name_to_stem, problem_names
from dmplay.terminal.capabilities import Terminal
from dmplay.terminal.painter import Painter, ScreenPosition
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.play_screen import PlayScreen
from tests.support import pictures
from tests.support.document_examples import PROJECT_ROOT

FRAMES_FOLDER = Path(__file__).parent / "kept"
SIZES = ((50, 14), (80, 24), (120, 40), (200, 60))
BASE_TERMINAL = Terminal(
    full_screen=True, plain_reason="", is_interactive=True, color=True, ascii=False, motion=False
)


class ScriptedGame(NamedTuple):
    """The keys of a game, with spaces between; a number is typed and entered."""

    first: str  # up to the middle of the game
    ahead: str  # in the middle, after the what-if key
    then: str  # up to the end; `3*h` presses h three times
    turns: int | None = None


SEED = 7
GAMES = {  # those in `keys.json`, beside the frames of a problem
    name: ScriptedGame(**json.loads(file.read_text(encoding="utf-8")))
    for name in problem_names()
    if (file := FRAMES_FOLDER / name_to_stem(name) / "keys.json").exists()
}


class FrameRecorder(Painter):
    """A terminal of any size that records the last frame."""

    def __init__(self) -> None:
        self.columns, self.rows, self.frame = *SIZES[0], Text()

    def get_size(self) -> tuple[int, int]:
        """Return the current size."""
        return self.columns, self.rows

    def paint(self, frame: Text, cursor: ScreenPosition | None = None) -> None:
        """Record the frame."""
        self.frame = frame


def render_frames(name: str, folder: Path) -> dict[str, str]:
    """Return the frames of a problem by file, one file for each size; the game is saved in the
    folder.
    """
    script = GAMES[name]
    game = start_new_game(
        GameRequest(name, seed=SEED, turns=script.turns, record_path=folder / "game.dmt")
    )
    screen = PlayScreen(GameController(game), BASE_TERMINAL)
    text_by_size = {f"{columns}x{rows}": "" for columns, rows in SIZES}
    for moment in play_to_moments(screen, script):
        for size, frame in _draw_sizes(screen, moment):
            text_by_size[size] += frame
    assert game.session.over
    game.finish()
    return {f"{name_to_stem(name)}/{size}.txt": text for size, text in text_by_size.items()}


def play_to_moments(screen: PlayScreen, script: ScriptedGame) -> Iterator[str]:
    """Play the game and yield the name of each moment that is drawn."""
    yield "the beginning"
    _press_keys(screen, script.first)
    yield "the middle"
    handle_key(screen, "W")
    _press_keys(screen, script.ahead)
    yield f"what if {script.ahead}"
    handle_key(screen, "escape")
    handle_key(screen, "tab")
    yield "a hint"
    _press_keys(screen, script.then)
    yield "the end"


def _press_keys(screen: PlayScreen, keys: str) -> None:
    """Press keys; type and enter numbers."""
    for step in keys.split():
        times, _, key = step.rpartition("*")
        for _ in range(int(times or 1)):
            types_numbers = screen.game.keyboard.is_number_entry(screen.game.viewing_seat)
            for single_key in (*key, "enter") if types_numbers else (key,):
                handle_key(screen, single_key)
                screen.review_game()


def _draw_sizes(screen: PlayScreen, moment: str) -> Iterator[tuple[str, str]]:
    """Draw the screen in every size, in Unicode and ASCII, below a heading."""
    recorder = FrameRecorder()
    for ascii_ in (False, True):
        screen.terminal = BASE_TERMINAL._replace(ascii=ascii_)
        for recorder.columns, recorder.rows in SIZES:
            screen.paint(recorder)
            rows = [row.rstrip() for row in recorder.frame.plain.split("\n")]
            heading = f"== {moment}{', ASCII' if ascii_ else ''}"
            yield f"{recorder.columns}x{recorder.rows}", "\n".join([heading, *rows, "", ""])


def main() -> None:
    """Redraw the frames of every problem, and the pictures."""
    with TemporaryDirectory() as folder:
        os.environ["XDG_STATE_HOME"] = folder  # so that no best score of an earlier game is shown
        for number, name in enumerate(GAMES):
            game_folder = Path(folder, str(number))
            game_folder.mkdir()
            for path, text in render_frames(name, game_folder).items():
                target = FRAMES_FOLDER / path
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_text(text, encoding="utf-8")
    for picture in pictures.PICTURE_PATHS:
        (PROJECT_ROOT / picture).write_text(pictures.export_picture(picture), encoding="utf-8")


if __name__ == "__main__":
    main()
