"""What a recorded game can be written as: name, what it is, and whether it shows one turn."""

from typing import NamedTuple


class Format(NamedTuple):
    """A form that a game can be written in."""

    help: str
    still: bool = False  # whether it shows one turn
    ending: str = ""  # of its file, where it is no text to read


FORMATS = {
    "svg": Format("a picture of the screen", still=True, ending="svg"),
    "film": Format("an animated picture", ending="svg"),
    "html": Format("a page with every turn, to step through", still=True, ending="html"),
    "cast": Format("a recording, asciicast v2", ending="cast"),
    "cast3": Format("a recording, asciicast v3", ending="cast"),
    "text": Format("every screen as text"),
    "csv": Format("a row a turn"),
    "json": Format("the game as one object"),
}
