"""What a frame is composed of beside the game: the room there is, and what the front end adds."""

from collections.abc import Sequence
from typing import NamedTuple

from rich.text import Text

from dmplay.advice.adviser import Hint
from dmplay.painting.writing import ScreenPosition
from dmplay.styles import ScreenLine, to_plain_text, to_rich_text
from dmplay.views.canvas import ASCII_TRANSLATION
from dmplay.views.style import Forecast

KEY_HINT_TURNS = 5  # turns for which the board names the keys
NEXT_PAGE_KEYS = ("space", "down", "enter")  # keys that turn a page


class Viewport(NamedTuple):
    """The terminal: its size and whether it can draw."""

    width: int
    height: int
    ascii_only: bool = False


class FrameState(NamedTuple):
    """What the front end adds: a message, the overlay, a page in place of the board."""

    message: str = ""
    overlay: str = ""
    page_rows: Sequence[str] = ()  # an answer of several lines, in place of the board
    page_index: int = 0  # which part of it, where it is longer than the screen
    scroll_offset: int = 0  # rows that the log is scrolled back
    handover_agent: str = ""  # the agent before whose turn nothing is shown
    last_key_hint_turn: int = KEY_HINT_TURNS  # the turn from which on the board names no keys
    hint: Hint | None = None  # marked on the board and the keys
    typed_action: float | None = None  # the number that is written, which Enter would play
    forecast: Forecast | None = None  # what an action may bring
    is_lookback: bool = False  # whether an earlier turn of a game that is over is shown
    motion_progress: float = 1.0  # the share of the last turn's motion that is over
    best_return: str = ""  # your best return of such a game before this one


EMPTY_FRAME_STATE = FrameState()


def fit_line(row: ScreenLine, viewport: Viewport) -> ScreenLine:
    """A row as it is where it is no wider than the room, else cut."""
    if not isinstance(row, Text):
        plain = row if isinstance(row, str) else to_plain_text(row)
        if plain.isascii() and len(plain) <= viewport.width:
            return row
    return fit_text(to_rich_text(row), viewport)


def fit_text(row: Text, viewport: Viewport) -> Text:
    """A row no wider than the room; nothing is cut silently."""
    plain = row.plain.isascii()
    width = len(row.plain) if plain else row.cell_len
    if width > viewport.width or (viewport.ascii_only and not plain):
        row = row.copy()
        row.truncate(viewport.width, overflow="ellipsis")
        row.plain = row.plain.translate(ASCII_TRANSLATION) if viewport.ascii_only else row.plain
    return row


def find_cursor(frame: Text) -> ScreenPosition | None:
    """Where the player stands, the first reversed cell: screen readers follow the real cursor."""
    plain = frame.plain
    reversed_ = (span for span in frame.spans if "reverse" in str(span.style))
    cell = min(reversed_, default=None)
    if cell is None:
        return None
    shown = plain[cell.start : cell.end]
    at = cell.start + len(shown) - len(shown.lstrip())
    return ScreenPosition(at - plain.rfind("\n", 0, at) - 1, plain.count("\n", 0, at))
