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
    "svg": ExportFormat("picture of one turn (SVG)", "svg", shows_one_turn=True),
    "film": ExportFormat("animated picture of the game (SVG), 1 to 3 kB per turn", "svg"),
    "html": ExportFormat(
        "page for stepping through the turns", "html", shows_one_turn=True, screen_rows=24
    ),
    "cast": ExportFormat("terminal recording (asciicast v3)", "cast", screen_rows=24),
    "text": ExportFormat("all screens as text", "txt", is_text=True),
    "csv": ExportFormat("table with one row per turn", "csv", screen_rows=0, is_text=True),
    "jsonl": ExportFormat(
        "one JSON object per turn, each on a line", "jsonl", screen_rows=0, is_text=True
    ),
    "json": ExportFormat("whole game as one JSON object", "json", screen_rows=0, is_text=True),
}
# Extensions that identify a file format.
KNOWN_EXTENSIONS = {
    "svg",
    "html",
    "cast",
    "csv",
    "json",
    "jsonl",
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
        raise BadParameter(f"-o {path}: the format is {ending.upper()}; name the file {suggestion}")
