"""What a frame is composed of beside the game: the room there is, and what the front end adds."""

from collections.abc import Sequence
from typing import NamedTuple

from rich.text import Text

from dmplay.advice.adviser import Advice
from dmplay.painting.writing import Place
from dmplay.styles import Line, lettered, words
from dmplay.views.canvas import ASCII
from dmplay.views.style import Outlook

KEYS_SHOWN = 5  # turns for which the board names the keys
MORE = ("space", "down", "enter")  # keys that turn a page


class Room(NamedTuple):
    """The terminal: its size and whether it can draw."""

    width: int
    height: int
    ascii: bool = False


class Shown(NamedTuple):
    """What the front end adds: a message, the overlay, a page in place of the board."""

    message: str = ""
    overlay: str = ""
    page: Sequence[str] = ()  # an answer of several lines, in place of the board
    part: int = 0  # which part of it, where it is longer than the screen
    back: int = 0  # rows that the log is scrolled back
    curtain: str = ""  # the agent before whose turn nothing is shown
    keys_until: int = KEYS_SHOWN  # the turn from which on the board names no keys
    advice: Advice | None = None  # marked on the board and the keys
    written: float | None = None  # the number that is written, which Enter would play
    outlook: Outlook | None = None  # what an action may bring
    past: bool = False  # whether an earlier turn of a game that is over is shown
    passed: float = 1.0  # the share of the last turn's motion that is over
    best: str = ""  # your best return of such a game before this one


NOTHING = Shown()


def within(row: Line, room: Room) -> Line:
    """A row as it is where it is no wider than the room, else cut."""
    if not isinstance(row, Text):
        plain = row if isinstance(row, str) else words(row)
        if plain.isascii() and len(plain) <= room.width:
            return row
    return fitted(lettered(row), room)


def fitted(row: Text, room: Room) -> Text:
    """A row no wider than the room; nothing is cut silently."""
    plain = row.plain.isascii()
    width = len(row.plain) if plain else row.cell_len
    if width > room.width or (room.ascii and not plain):
        row = row.copy()
        row.truncate(room.width, overflow="ellipsis")
        row.plain = row.plain.translate(ASCII) if room.ascii else row.plain
    return row


def player(drawn: Text) -> Place | None:
    """Where the player stands, the first reversed cell: screen readers follow the real cursor."""
    plain = drawn.plain
    reversed_ = (span for span in drawn.spans if "reverse" in str(span.style))
    cell = min(reversed_, default=None)
    if cell is None:
        return None
    shown = plain[cell.start : cell.end]
    at = cell.start + len(shown) - len(shown.lstrip())
    return Place(at - plain.rfind("\n", 0, at) - 1, plain.count("\n", 0, at))
