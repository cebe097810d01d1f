"""What a player sees of every problem in terminals of every size: one game each, five moments.

`python -m tests.screen.frames` draws them anew, and the README's pictures; the diff is read in a
review.
"""

import os
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from rich.text import Text

from dmplay.finding.names import name_to_stem
from dmplay.game.request import GameRequest
from dmplay.game.start import start_new_game
from dmplay.game.table import GameController
from dmplay.painting.painter import Painter
from dmplay.painting.writing import ScreenPosition
from dmplay.screen.press import handle_key
from dmplay.screen.screen import PlayScreen
from dmplay.terminal import Terminal
from tests.support import pictures
from tests.support.blocks import ROOT

KEPT = Path(__file__).parent / "kept"
SIZES = ((50, 14), (80, 24), (120, 40), (200, 60))
HERE = Terminal(
    full_screen=True, plain_reason="", is_interactive=True, color=True, ascii=False, motion=False
)


class Played(NamedTuple):
    """A game as it is played: what is pressed, or typed and entered, word by word."""

    first: str  # up to the middle
    ahead: str  # there after the key of what if
    then: str  # up to the end; `3*h` is pressed three times
    turns: int | None = None


SEED = 7
GAMES = {
    "hexworld": Played("h b", "u", "l l n n"),
    "2048": Played("down left down left right left", "up", "down left down", 9),
    "cart-pole": Played("h h h l l", "h", "12*l"),
    "mountain-car": Played("23*h", "l", "56*l h"),
    "simple-regulator": Played("-.5 .2", ".1", ".1 .3", 4),
    "collision-avoidance": Played("3*k 2*space", "k", "36*space"),
    "crying-baby": Played("i i s", "f", "f i i", 6),
    "machine-replacement": Played("m m e", "i", "i m m", 6),
    "catch": Played("50 60", "60", "70 80 90", 5),
    "prisoners-dilemma": Played("c c d", "c", "d c d", 6),
    "rock-paper-scissors": Played("r p s", "p", "r p s", 6),
    "travelers-dilemma": Played("99 90", "85", "80 70", 4),
    "predator-prey": Played("b n l", "u", "u u l", 6),
    "multicaregiver-crying-baby": Played("i s", "f", "f i", 4),
    "collaborative-predator-prey": Played("l u", "l", "n b", 4),
}


class Paper(Painter):
    """A terminal of any size, which keeps what was painted last."""

    def __init__(self) -> None:
        self.columns, self.rows, self.frame = *SIZES[0], Text()

    def get_size(self) -> tuple[int, int]:
        """Its own."""
        return self.columns, self.rows

    def paint(self, frame: Text, cursor: ScreenPosition | None = None) -> None:
        """Keeps the frame."""
        self.frame = frame


def frames(name: str, folder: Path) -> dict[str, str]:
    """The frames of a problem by file, of one size each; the game is written to the folder."""
    played = GAMES[name]
    game = start_new_game(
        GameRequest(name, seed=SEED, turns=played.turns, record_path=folder / "game.dmt")
    )
    screen = PlayScreen(GameController(game), HERE)
    drawn = {f"{columns}x{rows}": "" for columns, rows in SIZES}
    for moment in _moments(screen, played):
        for size, frame in _drawn(screen, moment):
            drawn[size] += frame
    assert game.session.over
    game.finish()
    return {f"{name_to_stem(name)}/{size}.txt": text for size, text in drawn.items()}


def _moments(screen: PlayScreen, played: Played) -> Iterator[str]:
    """Plays the game, and names each moment that is drawn."""
    yield "the beginning"
    _press(screen, played.first)
    yield "the middle"
    handle_key(screen, "W")
    _press(screen, played.ahead)
    yield f"what if {played.ahead}"
    handle_key(screen, "escape")
    handle_key(screen, "tab")
    yield "a hint"
    _press(screen, played.then)
    yield "the end"


def _press(screen: PlayScreen, words: str) -> None:
    """Presses keys; types and enters numbers."""
    for word in words.split():
        times, _, key = word.rpartition("*")
        for _ in range(int(times or 1)):
            numbers = screen.game.keyboard.is_number_entry(screen.game.viewing_seat)
            for one in (*key, "enter") if numbers else (key,):
                handle_key(screen, one)


def _drawn(screen: PlayScreen, moment: str) -> Iterator[tuple[str, str]]:
    """The screen in every size, in Unicode and ASCII, below a heading."""
    paper = Paper()
    for ascii_ in (False, True):
        screen.terminal = HERE._replace(ascii=ascii_)
        for paper.columns, paper.rows in SIZES:
            screen.paint(paper)
            rows = [row.rstrip() for row in paper.frame.plain.split("\n")]
            heading = f"== {moment}{', ASCII' if ascii_ else ''}"
            yield f"{paper.columns}x{paper.rows}", "\n".join([heading, *rows, "", ""])


def main() -> None:
    """Draws the frames of every problem anew, and the pictures."""
    with TemporaryDirectory() as folder:
        os.environ["XDG_STATE_HOME"] = folder  # nobody's best is told
        for number, name in enumerate(GAMES):
            place = Path(folder, str(number))
            place.mkdir()
            for path, text in frames(name, place).items():
                kept = KEPT / path
                kept.parent.mkdir(parents=True, exist_ok=True)
                kept.write_text(text, encoding="utf-8")
    for picture in pictures.PICTURES:
        (ROOT / picture).write_text(pictures.drawn(picture), encoding="utf-8")


if __name__ == "__main__":
    main()
