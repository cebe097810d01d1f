"""The terminal's screen: of each frame only what differs from the last one is written."""

import os
from functools import lru_cache
from itertools import zip_longest
from typing import TextIO

from rich.cells import cell_len
from rich.text import Text

from dmplay.painting.lift import Lift, lifted
from dmplay.painting.pen import PLAIN, pen, seen
from dmplay.painting.writing import BLANK, Cell, Change, Place, Writing
from dmplay.styles import Row, rows

ENTER, LEAVE = "\x1b[?1049h\x1b[?25l", "\x1b[m\x1b[?1049l\x1b[?25h"
# A paste comes as one, not as keys; the wheel as itself, not as arrows, which would play.
LISTEN, DEAF = "\x1b[?2004h\x1b[?1000h\x1b[?1006h", "\x1b[?1006l\x1b[?1000l\x1b[?2004l"
CLEAR = "\x1b[m\x1b[H\x1b[2J"
SHOW, HIDE = "\x1b[?25h", "\x1b[?25l"
SIZE = (80, 24)  # of a terminal that does not tell


class Painter:
    """The alternate screen of a terminal, and what stands on it."""

    def __init__(
        self, stream: TextIO, theme: str, width: int | None = None, *, fills: bool = False
    ) -> None:
        self.stream = stream
        self._fills = fills  # whether what is erased takes the colour that is set
        self._theme = theme
        self._width = width  # columns at most; all if None
        self._shown: list[Row] = []
        self._size = (0, 0)
        self._cursor: Place | None = None
        self._pen = PLAIN

    def size(self) -> tuple[int, int]:
        """The columns and rows to paint on."""
        try:
            columns, lines = os.get_terminal_size(self.stream.fileno())
        except OSError:  # no terminal, or one that is gone
            columns, lines = 0, 0
        columns, lines = columns or SIZE[0], lines or SIZE[1]
        return (min(self._width or columns, columns), lines)

    def enter(self) -> None:
        """Takes the whole screen."""
        self.forget()
        self._write(ENTER)

    def listen(self) -> None:
        """Asks for pastes as one piece and for the wheel, once keys are read."""
        self._write(LISTEN)

    def leave(self) -> None:
        """Gives the terminal back as it was."""
        self._write(DEAF + LEAVE)

    def forget(self) -> None:
        """Lets the next frame be painted whole."""
        self._size = (0, 0)

    def paint(self, frame: Text, cursor: Place | None = None) -> None:
        """Brings a frame onto the screen, the real cursor to a cell of it or out of sight."""
        new, size = rows(frame, self._theme), self.size()
        if self._size != size:
            self._size, self._pen = size, PLAIN
            self._shown, self._cursor = [()] * len(new), None
            self.stream.write(HIDE + CLEAR)
        lift = lifted(self._shown, new)
        ways = [self._way(None, new), *([self._way(lift, new)] if lift else [])]
        out = min(ways, key=lambda way: len(str(way).encode()))
        self._shown, self._pen = new, out.pen
        if cursor is not None and (str(out) or cursor != self._cursor):
            out.go(cursor)
        if (cursor is None) != (self._cursor is None):
            out.send(HIDE if cursor is None else SHOW)
        self._cursor = cursor
        self._write(str(out))

    def _way(self, lift: Lift | None, new: list[Row]) -> Writing:
        """What brings the rows onto the screen, with rows moved up first or without."""
        out = Writing(self._size[0], self._pen, fills=self._fills)
        if lift:
            out.erase(lift.codes)
            out.place = Place(0, lift.below)
        changed: dict[int, Change] = {}
        before = lift.applied(self._shown) if lift else self._shown
        for y, (old, row) in enumerate(zip_longest(before, new, fillvalue=())):
            if old != row:
                if _wide(old) or _wide(row):
                    out.whole(y, _cells(row))
                else:
                    changed[y] = Change(_cells(old), _cells(row))
        out.rows(changed)
        return out

    def _write(self, text: str) -> None:
        if text:
            self.stream.write(text)
        self.stream.flush()


def _wide(row: Row) -> bool:
    """Whether some character takes more than a cell, or none."""
    plain = "".join(piece for piece, _ in row)
    return not plain.isascii() and cell_len(plain) != len(plain)


@lru_cache(1000)
def _cells(row: Row) -> tuple[Cell, ...]:
    """The cells of a row, without the blanks at its end."""
    cells: list[Cell] = []
    for piece, codes in row:
        cells += _piece(piece, codes)
    while cells and cells[-1] == BLANK:
        cells.pop()
    return tuple(cells)


@lru_cache(4000)
def _piece(piece: str, codes: str) -> tuple[Cell, ...]:
    """The cells of a piece, which many rows have."""
    own = pen(codes)
    of_blanks = seen(own)
    return tuple((glyph, of_blanks if glyph == " " else own) for glyph in piece)
