"""What a recorded game can be written as: name, what it is, whether it shows one turn."""

from pathlib import Path
from typing import NamedTuple

from dmplay.errors import BadParameter


class ExportFormat(NamedTuple):
    """A form that a game can be written in."""

    help: str
    extension: str  # of its file
    shows_one_turn: bool = False  # whether it shows one turn
    screen_rows: int = 18  # of a screen in it; 0 where it has none
    is_text: bool = False  # whether it is text to read


EXPORT_FORMATS = {
    "svg": ExportFormat("a picture of the screen", "svg", shows_one_turn=True),
    "film": ExportFormat("an animated picture", "svg"),
    "html": ExportFormat(
        "a page with every turn, to step through", "html", shows_one_turn=True, screen_rows=24
    ),
    "cast": ExportFormat("a recording, asciicast v2", "cast", screen_rows=24),
    "cast3": ExportFormat("a recording, asciicast v3", "cast", screen_rows=24),
    "text": ExportFormat("every screen as text", "txt", is_text=True),
    "csv": ExportFormat("a row a turn", "csv", screen_rows=0, is_text=True),
    "json": ExportFormat("the game as one object", "json", screen_rows=0, is_text=True),
}
# By which a file is taken for what it is.
KNOWN_EXTENSIONS = {
    "svg",
    "html",
    "cast",
    "csv",
    "json",
    "txt",
    "png",
    "jpg",
    "jpeg",
    "gif",
    "webp",
    "pdf",
}


def check_extension(path: Path | None, format_name: str) -> None:
    """Refuses to write a form into a file whose name ends as another's does."""
    ending = EXPORT_FORMATS[format_name].extension
    own = {ending, "txt"} if EXPORT_FORMATS[format_name].is_text else {ending}
    if path and path.suffix[1:].lower() in KNOWN_EXTENSIONS - own:
        rather = path.with_suffix(f".{ending}")
        raise BadParameter(f"-o {path}: it is written as {ending.upper()}; name it {rather}")
