"""What a recorded game can be written as: name, what it is, and whether it shows one turn."""

from typing import NamedTuple


class Format(NamedTuple):
    """A form that a game can be written in."""

    help: str
    still: bool = False  # whether it shows one turn


FORMATS = {
    "svg": Format("a picture of the screen", still=True),
    "film": Format("an animated picture"),
    "html": Format("a page with every turn, to step through", still=True),
    "cast": Format("a recording, asciicast v2"),
    "text": Format("every screen as text"),
    "csv": Format("a row a turn"),
    "json": Format("the game as one object"),
}
