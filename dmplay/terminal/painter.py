"""Paint frames on the terminal, writing only the rows that changed since the last frame."""

import os
from itertools import zip_longest
from typing import NamedTuple, TextIO

from rich.text import Text

from dmplay.terminal.background import BACKGROUND_QUERY
from dmplay.terminal.key_releases import KEYBOARD_QUERY, REPORT_RELEASES, STOP_REPORTS
from dmplay.terminal.styles import StyledRow, to_styled_rows

ENTER_SCREEN, LEAVE_SCREEN = "\x1b[?1049h\x1b[?25l", "\x1b[m\x1b[?1049l\x1b[?25h"
# A paste arrives as one event, not as keys. The mouse wheel reports itself; terminals would
# otherwise send arrow keys, which would play actions.
ENABLE_INPUT_REPORTS = "\x1b[?2004h\x1b[?1000h\x1b[?1006h"
DISABLE_INPUT_REPORTS = "\x1b[?1006l\x1b[?1000l\x1b[?2004l"
CLEAR_SCREEN = "\x1b[m\x1b[H\x1b[2J"
SHOW_CURSOR, HIDE_CURSOR = "\x1b[?25h", "\x1b[?25l"
DEFAULT_SIZE = (80, 24)  # columns and rows of a terminal that does not report its size


class ScreenPosition(NamedTuple):
    """A cell of the screen, counted from 0."""

    column: int
    row: int


class Painter:
    """The alternate screen of a terminal, and the rows displayed on it."""

    def __init__(self, stream: TextIO, theme: str, max_width: int | None = None) -> None:
        self.stream = stream
        self.theme = theme
        self._max_width = max_width  # columns; all if None
        self._reports_releases = False  # whether the terminal can, and the screen needs it
        self._displayed_rows: list[StyledRow] = []
        self._displayed_size = (0, 0)
        self._cursor: ScreenPosition | None = None

    def get_size(self) -> tuple[int, int]:
        """Return the columns and rows to paint on."""
        try:
            columns, lines = os.get_terminal_size(self.stream.fileno())
        except OSError:  # not a terminal, or the terminal is gone
            columns, lines = 0, 0
        columns, lines = columns or DEFAULT_SIZE[0], lines or DEFAULT_SIZE[1]
        return (min(self._max_width or columns, columns), lines)

    def enter_screen(self) -> None:
        """Enter the alternate screen and hide the cursor."""
        self.mark_screen_unknown()
        self._write(ENTER_SCREEN)

    def ask_background(self) -> None:
        """Ask the terminal for its background colour; the reply arrives among the keys."""
        self._write(BACKGROUND_QUERY)

    def ask_keyboard(self) -> None:
        """Ask the terminal whether it can report releases; the reply arrives among the keys."""
        self._write(KEYBOARD_QUERY)

    def report_releases(self) -> None:
        """Ask the terminal to report releases of keys until the screen is left."""
        if not self._reports_releases:
            self._reports_releases = True
            self._write(REPORT_RELEASES)

    def enable_input_reports(self) -> None:
        """Ask the terminal to mark pastes and to report the mouse wheel, and releases again."""
        self._write(ENABLE_INPUT_REPORTS + REPORT_RELEASES * self._reports_releases)

    def leave_screen(self) -> None:
        """Leave the alternate screen and restore the terminal."""
        stop_reports = STOP_REPORTS * self._reports_releases
        self._write(stop_reports + DISABLE_INPUT_REPORTS + LEAVE_SCREEN)

    def mark_screen_unknown(self) -> None:
        """Mark the screen as unknown, so that the next frame is painted whole."""
        self._displayed_size = (0, 0)

    def paint(self, frame: Text, cursor: ScreenPosition | None = None) -> None:
        """Paint a frame: write each row that changed, in one output.

        The real cursor goes to a cell of the frame, or is hidden if None.
        """
        new_rows, size = to_styled_rows(frame, self.theme), self.get_size()
        output = ""
        if self._displayed_size != size:
            self._displayed_size, self._displayed_rows, self._cursor = size, [], None
            output = HIDE_CURSOR + CLEAR_SCREEN
        row_pairs = enumerate(zip_longest(self._displayed_rows, new_rows, fillvalue=()), 1)
        changes = [_encode_row(number, row) for number, (old, row) in row_pairs if old != row]
        self._displayed_rows = new_rows
        output += "".join(changes)
        if cursor is not None and (output or cursor != self._cursor):
            output += f"\x1b[{cursor.row + 1};{cursor.column + 1}H"
        if (cursor is None) != (self._cursor is None):
            output += HIDE_CURSOR if cursor is None else SHOW_CURSOR
        self._cursor = cursor
        self._write(output)

    def _write(self, text: str) -> None:
        """Write text to the terminal and flush it."""
        if text:
            self.stream.write(text)
        self.stream.flush()


def _encode_row(number: int, row: StyledRow) -> str:
    """Return the output that erases the row with this number, from 1, and writes it again."""
    pieces = [f"\x1b[{codes}m{piece}\x1b[m" if codes else piece for piece, codes in row]
    return "".join([f"\x1b[{number}H\x1b[K", *pieces])
