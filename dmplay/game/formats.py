"""What a recorded game can be written as: name, what it is, whether it shows one turn."""

from pathlib import Path
from typing import NamedTuple

from dmplay.errors import BadParameter


class Format(NamedTuple):
    """A form that a game can be written in."""

    help: str
    ending: str  # of its file
    still: bool = False  # whether it shows one turn
    rows: int = 18  # of a screen in it; 0 where it has none
    plain: bool = False  # whether it is text to read


FORMATS = {
    "svg": Format("a picture of the screen", "svg", still=True),
    "film": Format("an animated picture", "svg"),
    "html": Format("a page with every turn, to step through", "html", still=True, rows=24),
    "cast": Format("a recording, asciicast v2", "cast", rows=24),
    "cast3": Format("a recording, asciicast v3", "cast", rows=24),
    "text": Format("every screen as text", "txt", plain=True),
    "csv": Format("a row a turn", "csv", rows=0, plain=True),
    "json": Format("the game as one object", "json", rows=0, plain=True),
}
# By which a file is taken for what it is.
ENDINGS = {"svg", "html", "cast", "csv", "json", "txt", "png", "jpg", "jpeg", "gif", "webp", "pdf"}


def fits(path: Path | None, form: str) -> None:
    """Refuses to write a form into a file whose name ends as another's does."""
    ending = FORMATS[form].ending
    own = {ending, "txt"} if FORMATS[form].plain else {ending}
    if path and path.suffix[1:].lower() in ENDINGS - own:
        rather = path.with_suffix(f".{ending}")
        raise BadParameter(f"-o {path}: it is written as {ending.upper()}; name it {rather}")
