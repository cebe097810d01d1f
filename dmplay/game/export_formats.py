"""The formats that a recorded game can be exported to."""

from pathlib import Path
from typing import NamedTuple

from dmplay.errors import BadParameter


class ExportFormat(NamedTuple):
    """A format that a game can be exported to."""

    help: str
    extension: str  # file extension without the dot
    shows_one_turn: bool = False  # whether it shows a single turn
    screen_rows: int = 18  # height of the screen in rows; 0 if no screen is drawn
    is_text: bool = False  # whether it is readable as text


EXPORT_FORMATS = {
    "svg": ExportFormat("a picture of the screen", "svg", shows_one_turn=True),
    "film": ExportFormat("an animated picture", "svg"),
    "html": ExportFormat(
        "a page with every turn, to step through", "html", shows_one_turn=True, screen_rows=24
    ),
    "cast": ExportFormat("a recording, asciicast v3", "cast", screen_rows=24),
    "text": ExportFormat("every screen as text", "txt", is_text=True),
    "csv": ExportFormat("a row a turn", "csv", screen_rows=0, is_text=True),
    "json": ExportFormat("the game as one object", "json", screen_rows=0, is_text=True),
}
# Extensions that identify a file format.
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


def check_extension_fits_format(path: Path | None, format_name: str) -> None:
    """Raise BadParameter if a file's extension belongs to a different format.

    `.txt` is accepted for every text format.
    """
    ending = EXPORT_FORMATS[format_name].extension
    allowed = {ending, "txt"} if EXPORT_FORMATS[format_name].is_text else {ending}
    if path and path.suffix[1:].lower() in KNOWN_EXTENSIONS - allowed:
        suggestion = path.with_suffix(f".{ending}")
        raise BadParameter(f"-o {path}: it is written as {ending.upper()}; name it {suggestion}")
