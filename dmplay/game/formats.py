"""What a recorded game can be written as: name, what it is, whether it shows one turn."""

from pathlib import Path
from typing import NamedTuple

from dmplay.errors import BadParameter


class Format(NamedTuple):
    """A form that a game can be written in."""

    help: str
    still: bool = False  # whether it shows one turn
    ending: str = ""  # of its file, where it is no text to read
    rows: int = 18  # of a screen in it


FORMATS = {
    "svg": Format("a picture of the screen", still=True, ending="svg"),
    "film": Format("an animated picture", ending="svg"),
    "html": Format("a page with every turn, to step through", True, "html", 24),
    "cast": Format("a recording, asciicast v2", ending="cast", rows=24),
    "cast3": Format("a recording, asciicast v3", ending="cast", rows=24),
    "text": Format("every screen as text"),
    "csv": Format("a row a turn"),
    "json": Format("the game as one object"),
}
# By which a file is taken for what it is.
ENDINGS = {"svg", "html", "cast", "csv", "json", "txt", "png", "jpg", "jpeg", "gif", "webp", "pdf"}


def fits(path: Path | None, form: str) -> None:
    """Refuses to write a form into a file whose name ends as another's does."""
    ending = FORMATS[form].ending
    if path and ending and path.suffix[1:].lower() in ENDINGS - {ending}:
        rather = path.with_suffix(f".{ending}")
        raise BadParameter(f"-o {path}: it is written as {ending.upper()}; name it {rather}")
