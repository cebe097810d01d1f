"""Paint frames on the terminal, writing only what changed since the last frame."""

import os
from functools import lru_cache
from itertools import zip_longest
from typing import TextIO

from rich.cells import cell_len
from rich.text import Text

from dmplay.rendering.row_scroll import RowScroll, find_best_scroll
from dmplay.rendering.sgr_codes import NO_CODES, parse_sgr_codes, select_visible_on_blank
from dmplay.rendering.terminal_output import (
    BLANK_CELL,
    RowChange,
    ScreenCell,
    ScreenPosition,
    TerminalOutput,
)
from dmplay.terminal_styles import StyledRow, to_styled_rows

ENTER_SCREEN, LEAVE_SCREEN = "\x1b[?1049h\x1b[?25l", "\x1b[m\x1b[?1049l\x1b[?25h"
# A paste arrives as one event, not as keys. The mouse wheel reports itself; terminals would
# otherwise send arrow keys, which would play actions.
ENABLE_INPUT_REPORTS, DISABLE_INPUT_REPORTS = (
    "\x1b[?2004h\x1b[?1000h\x1b[?1006h",
    "\x1b[?1006l\x1b[?1000l\x1b[?2004l",
)
CLEAR_SCREEN = "\x1b[m\x1b[H\x1b[2J"
SHOW_CURSOR, HIDE_CURSOR = "\x1b[?25h", "\x1b[?25l"
DEFAULT_SIZE = (80, 24)  # columns and rows of a terminal that does not report its size


class Painter:
    """The alternate screen of a terminal, and the rows displayed on it."""

    def __init__(
        self,
        stream: TextIO,
        theme: str,
        max_width: int | None = None,
        *,
        erases_with_color: bool = False,
    ) -> None:
        self.stream = stream
        self._erases_with_color = (
            erases_with_color  # The terminal fills erased cells with the current background colour.
        )
        self._theme = theme
        self._max_width = max_width  # columns; all if None
        self._displayed_rows: list[StyledRow] = []
        self._displayed_size = (0, 0)
        self._cursor: ScreenPosition | None = None
        self._sgr_codes = NO_CODES

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
        self.invalidate()
        self._write(ENTER_SCREEN)

    def enable_input_reports(self) -> None:
        """Ask the terminal to mark pastes and to report the mouse wheel."""
        self._write(ENABLE_INPUT_REPORTS)

    def leave_screen(self) -> None:
        """Leave the alternate screen and restore the terminal."""
        self._write(DISABLE_INPUT_REPORTS + LEAVE_SCREEN)

    def invalidate(self) -> None:
        """Mark the screen as unknown, so that the next frame is painted whole."""
        self._displayed_size = (0, 0)

    def paint(self, frame: Text, cursor: ScreenPosition | None = None) -> None:
        """Paint a frame with the shorter of two updates, with and without scrolling.

        The real cursor goes to a cell of the frame, or is hidden if None.
        """
        new_rows, size = to_styled_rows(frame, self._theme), self.get_size()
        if self._displayed_size != size:
            self._displayed_size, self._sgr_codes = size, NO_CODES
            self._displayed_rows, self._cursor = [()] * len(new_rows), None
            self.stream.write(HIDE_CURSOR + CLEAR_SCREEN)
        scroll = find_best_scroll(self._displayed_rows, new_rows)
        updates = [
            self._build_update(None, new_rows),
            *([self._build_update(scroll, new_rows)] if scroll else []),
        ]
        output = min(updates, key=lambda update: len(str(update).encode()))
        self._displayed_rows, self._sgr_codes = new_rows, output.sgr_codes
        if cursor is not None and (str(output) or cursor != self._cursor):
            output.move_cursor(cursor)
        if (cursor is None) != (self._cursor is None):
            output.append_sequence(HIDE_CURSOR if cursor is None else SHOW_CURSOR)
        self._cursor = cursor
        self._write(str(output))

    def _build_update(self, scroll: RowScroll | None, new_rows: list[StyledRow]) -> TerminalOutput:
        """Return the output that displays `new_rows`, after a scroll if one is given."""
        output = TerminalOutput(
            self._displayed_size[0], self._sgr_codes, erases_with_color=self._erases_with_color
        )
        if scroll:
            output.erase_with(scroll.escape_sequence)
            output.cursor = ScreenPosition(0, scroll.first_blank_row)
        changes: dict[int, RowChange] = {}
        displayed_rows = scroll.apply_to(self._displayed_rows) if scroll else self._displayed_rows
        for y, (old_row, row) in enumerate(zip_longest(displayed_rows, new_rows, fillvalue=())):
            if old_row != row:
                if _has_wide_characters(old_row) or _has_wide_characters(row):
                    output.rewrite_row(y, _split_row_into_cells(row))
                else:
                    changes[y] = RowChange(
                        _split_row_into_cells(old_row), _split_row_into_cells(row)
                    )
        output.write_changed_rows(changes)
        return output

    def _write(self, text: str) -> None:
        """Write text to the terminal and flush it."""
        if text:
            self.stream.write(text)
        self.stream.flush()


def _has_wide_characters(row: StyledRow) -> bool:
    """Return whether a row has characters of a width other than one cell."""
    plain = "".join(piece for piece, _ in row)
    return not plain.isascii() and cell_len(plain) != len(plain)


@lru_cache(1000)
def _split_row_into_cells(row: StyledRow) -> tuple[ScreenCell, ...]:
    """Split a row into cells, without the blanks at its end."""
    cells: list[ScreenCell] = []
    for piece, codes in row:
        cells += _split_piece_into_cells(piece, codes)
    while cells and cells[-1] == BLANK_CELL:
        cells.pop()
    return tuple(cells)


@lru_cache(4000)
def _split_piece_into_cells(piece: str, codes: str) -> tuple[ScreenCell, ...]:
    """Split a styled piece into cells; cached, because many rows share pieces."""
    sgr_codes = parse_sgr_codes(codes)
    blank_codes = select_visible_on_blank(sgr_codes)
    return tuple((glyph, blank_codes if glyph == " " else sgr_codes) for glyph in piece)
