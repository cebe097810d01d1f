"""The terminal's screen: of each frame only what differs from the last one is written."""

import os
from functools import lru_cache
from itertools import zip_longest
from typing import TextIO

from rich.cells import cell_len
from rich.text import Text

from dmplay.painting.lift import RowScroll, find_best_scroll
from dmplay.painting.pen import NO_CODES, parse_sgr_codes, select_visible_on_blank
from dmplay.painting.writing import (
    BLANK_CELL,
    RowChange,
    ScreenCell,
    ScreenPosition,
    TerminalOutput,
)
from dmplay.styles import StyledRow, to_styled_rows

ENTER_SCREEN, LEAVE_SCREEN = "\x1b[?1049h\x1b[?25l", "\x1b[m\x1b[?1049l\x1b[?25h"
# A paste comes as one, not as keys; the wheel as itself, not as arrows, which would play.
ENABLE_INPUT_REPORTS, DISABLE_INPUT_REPORTS = (
    "\x1b[?2004h\x1b[?1000h\x1b[?1006h",
    "\x1b[?1006l\x1b[?1000l\x1b[?2004l",
)
CLEAR_SCREEN = "\x1b[m\x1b[H\x1b[2J"
SHOW_CURSOR, HIDE_CURSOR = "\x1b[?25h", "\x1b[?25l"
DEFAULT_SIZE = (80, 24)  # of a terminal that does not tell


class Painter:
    """The alternate screen of a terminal, and what stands on it."""

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
            erases_with_color  # whether what is erased takes the colour that is set
        )
        self._theme = theme
        self._max_width = max_width  # columns at most; all if None
        self._displayed_rows: list[StyledRow] = []
        self._displayed_size = (0, 0)
        self._cursor: ScreenPosition | None = None
        self._sgr_codes = NO_CODES

    def get_size(self) -> tuple[int, int]:
        """The columns and rows to paint on."""
        try:
            columns, lines = os.get_terminal_size(self.stream.fileno())
        except OSError:  # no terminal, or one that is gone
            columns, lines = 0, 0
        columns, lines = columns or DEFAULT_SIZE[0], lines or DEFAULT_SIZE[1]
        return (min(self._max_width or columns, columns), lines)

    def enter_screen(self) -> None:
        """Takes the whole screen."""
        self.invalidate()
        self._write(ENTER_SCREEN)

    def enable_input_reports(self) -> None:
        """Asks for pastes as one piece and for the wheel, once keys are read."""
        self._write(ENABLE_INPUT_REPORTS)

    def leave_screen(self) -> None:
        """Gives the terminal back as it was."""
        self._write(DISABLE_INPUT_REPORTS + LEAVE_SCREEN)

    def invalidate(self) -> None:
        """Lets the next frame be painted whole."""
        self._displayed_size = (0, 0)

    def paint(self, frame: Text, cursor: ScreenPosition | None = None) -> None:
        """Brings a frame onto the screen, the real cursor to a cell of it or out of sight."""
        new, size = to_styled_rows(frame, self._theme), self.get_size()
        if self._displayed_size != size:
            self._displayed_size, self._sgr_codes = size, NO_CODES
            self._displayed_rows, self._cursor = [()] * len(new), None
            self.stream.write(HIDE_CURSOR + CLEAR_SCREEN)
        lift = find_best_scroll(self._displayed_rows, new)
        ways = [self._build_update(None, new), *([self._build_update(lift, new)] if lift else [])]
        out = min(ways, key=lambda way: len(str(way).encode()))
        self._displayed_rows, self._sgr_codes = new, out.sgr_codes
        if cursor is not None and (str(out) or cursor != self._cursor):
            out.move_cursor(cursor)
        if (cursor is None) != (self._cursor is None):
            out.append_sequence(HIDE_CURSOR if cursor is None else SHOW_CURSOR)
        self._cursor = cursor
        self._write(str(out))

    def _build_update(self, scroll: RowScroll | None, new_rows: list[StyledRow]) -> TerminalOutput:
        """What brings the rows onto the screen, with rows moved up first or without."""
        out = TerminalOutput(
            self._displayed_size[0], self._sgr_codes, erases_with_color=self._erases_with_color
        )
        if scroll:
            out.erase_with(scroll.escape_sequence)
            out.cursor = ScreenPosition(0, scroll.first_blank_row)
        changed: dict[int, RowChange] = {}
        before = scroll.apply_to(self._displayed_rows) if scroll else self._displayed_rows
        for y, (old, row) in enumerate(zip_longest(before, new_rows, fillvalue=())):
            if old != row:
                if _has_wide_characters(old) or _has_wide_characters(row):
                    out.rewrite_row(y, _split_row_into_cells(row))
                else:
                    changed[y] = RowChange(_split_row_into_cells(old), _split_row_into_cells(row))
        out.write_changed_rows(changed)
        return out

    def _write(self, text: str) -> None:
        if text:
            self.stream.write(text)
        self.stream.flush()


def _has_wide_characters(row: StyledRow) -> bool:
    """Whether some character takes more than a cell, or none."""
    plain = "".join(piece for piece, _ in row)
    return not plain.isascii() and cell_len(plain) != len(plain)


@lru_cache(1000)
def _split_row_into_cells(row: StyledRow) -> tuple[ScreenCell, ...]:
    """The cells of a row, without the blanks at its end."""
    cells: list[ScreenCell] = []
    for piece, codes in row:
        cells += _split_piece_into_cells(piece, codes)
    while cells and cells[-1] == BLANK_CELL:
        cells.pop()
    return tuple(cells)


@lru_cache(4000)
def _split_piece_into_cells(piece: str, codes: str) -> tuple[ScreenCell, ...]:
    """The cells of a piece, which many rows have."""
    own = parse_sgr_codes(codes)
    of_blanks = select_visible_on_blank(own)
    return tuple((glyph, of_blanks if glyph == " " else own) for glyph in piece)
