"""The viewport and the frame state: the input of a frame in addition to the game."""

from collections.abc import Sequence
from typing import NamedTuple

from rich.text import Text

from dmplay.draw.canvas import ASCII_TRANSLATION
from dmplay.draw.options import Forecast
from dmplay.game.hints.hint_provider import Hint
from dmplay.terminal.painter import ScreenPosition
from dmplay.terminal.styles import ScreenLine, to_plain_text, to_rich_text

NEXT_PAGE_KEYS = ("space", "down", "enter")  # keys that turn to the next page


class Viewport(NamedTuple):
    """The space for a drawing: its size in columns and rows, and whether it is limited to ASCII."""

    width: int
    height: int
    ascii_only: bool = False


class FrameState(NamedTuple):
    """The state that the play screen adds to a game, such as a message, a page or an overlay."""

    message: str = ""
    overlay: str = ""
    page_rows: Sequence[str] = ()  # rows of a long message, shown in place of the board
    page_index: int = 0  # index of the visible page, if they need several
    scroll_offset: int = 0  # rows by which the log is scrolled back
    handover_agent: str = ""  # agent to whom the keyboard is passed; '' if it is not
    hint: Hint | None = None  # marked on the board and the keys
    typed_action: float | None = None  # number typed so far, which Enter would play
    forecast: Forecast | None = None  # outcomes of the previewed action
    is_lookback: bool = False  # an earlier turn of a finished game is shown
    motion_progress: float = 1.0  # completed share of the last turn's animation
    show_coordinates: bool | None = None  # whether hex maps show coordinates; None: if they fit
    note: str = ""  # what a lesson says about this moment, above the goal
    best_return: str = ""  # the player's record in this game, from earlier games
    is_picture: bool = False  # in a picture or a film, no key works
    clock_keys: tuple[str, ...] = ()  # keys that start, stop and pace the clock
    # the key of a replay that goes to the worst turn, once the game is reviewed; '' without one
    worst_key: str = "X review"


EMPTY_FRAME_STATE = FrameState()
PICTURE_FRAME_STATE = FrameState(is_picture=True)


def fit_line(row: ScreenLine, viewport: Viewport) -> ScreenLine:
    """Return a row unchanged if it fits the viewport; cut it otherwise."""
    if not isinstance(row, Text):
        plain = row if isinstance(row, str) else to_plain_text(row)
        if plain.isascii() and len(plain) <= viewport.width:
            return row
    return fit_text(to_rich_text(row), viewport)


def fit_text(row: Text, viewport: Viewport) -> Text:
    """Return a row cut to the viewport's width with an ellipsis, in ASCII if required."""
    is_ascii = row.plain.isascii()
    width = len(row.plain) if is_ascii else row.cell_len
    if width > viewport.width or (viewport.ascii_only and not is_ascii):
        row = row.copy()
        row.truncate(viewport.width, overflow="ellipsis")
        row.plain = row.plain.translate(ASCII_TRANSLATION) if viewport.ascii_only else row.plain
    return row


def find_cursor(frame: Text) -> ScreenPosition | None:
    """Return the first reversed cell that is not blank, which marks the player, or None.

    The real cursor is put there, because screen readers follow it.
    """
    plain = frame.plain
    reversed_ = (span for span in frame.spans if "reverse" in str(span.style))
    first_span = min(reversed_, default=None)
    if first_span is None:
        return None
    reversed_text = plain[first_span.start : first_span.end]
    index = first_span.start + len(reversed_text) - len(reversed_text.lstrip())
    return ScreenPosition(index - plain.rfind("\n", 0, index) - 1, plain.count("\n", 0, index))
