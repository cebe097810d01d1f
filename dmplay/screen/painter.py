"""The terminal's screen: of each frame only what differs from the last one is written."""

import os
from itertools import zip_longest
from typing import NamedTuple, TextIO

from rich.cells import cell_len
from rich.text import Text

from dmplay.styles import Row, rows

ENTER, LEAVE = "\x1b[?1049h\x1b[?25l", "\x1b[m\x1b[?1049l\x1b[?25h"
# A paste comes as one, not as keys; the wheel as itself, not as arrows, which would play.
LISTEN, DEAF = "\x1b[?2004h\x1b[?1000h\x1b[?1006h", "\x1b[?1006l\x1b[?1000l\x1b[?2004l"
CLEAR, PLAIN, REST = "\x1b[m\x1b[H\x1b[2J", "\x1b[m", "\x1b[K"
SHOW, HIDE = "\x1b[?25h", "\x1b[?25l"
GAP = 8  # cells that are cheaper written again than jumped over
LIFTS = (1, 2, 3, 4)  # by how many rows a log may move up in one go
WORTH = 40  # characters saved that a scrolling of rows is worth
SIZE = (80, 24)  # of a terminal that does not tell
BLANK = (" ", "")

Cell = tuple[str, str]  # a character and its SGR codes


class Place(NamedTuple):
    """A cell of the screen, from 0."""

    column: int
    row: int


class Painter:
    """The alternate screen of a terminal, and what stands on it."""

    def __init__(self, stream: TextIO, theme: str, width: int | None = None) -> None:
        self.stream = stream
        self._theme = theme
        self._width = width  # columns at most; all if None
        self._shown: list[Row] = []
        self._size = (0, 0)
        self._cursor: Place | None = None
        self._style = ""

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
        new, out = rows(frame, self._theme), []
        if self._size != self.size():
            self._size = self.size()
            self._shown, self._cursor, self._style = [()] * len(new), None, ""
            out.append(HIDE + CLEAR)
        lift = _lift(self._shown, new)
        if lift:
            out.append(lift.codes)
            self._shown = lift.applied(self._shown)
        for y, (old, row) in enumerate(zip_longest(self._shown, new, fillvalue=())):
            if old != row:
                out.append(self._row(y, old, row))
        self._shown = new
        if out and self._style:
            self._style = ""
            out.append(PLAIN)
        if cursor is not None and (out or cursor != self._cursor):
            out.append(_to(cursor.row, cursor.column))
        if (cursor is None) != (self._cursor is None):
            out.append(HIDE if cursor is None else SHOW)
        self._cursor = cursor
        self._write("".join(out))

    def _write(self, text: str) -> None:
        if text:
            self.stream.write(text)
        self.stream.flush()

    def _row(self, y: int, old: Row, new: Row) -> str:
        """What turns one row into another."""
        if _wide(old) or _wide(new):
            return f"{_to(y, 0)}{self._styled('')}{REST}{self._cells(_cells(new))}"
        before, after = _cells(old), _cells(new)
        while after and after[-1] == BLANK:
            after.pop()
        cut = len(before) > len(after) and any(cell != BLANK for cell in before[len(after) :])
        before += [BLANK] * (len(after) - len(before))
        differs = [x for x, cell in enumerate(after) if cell != before[x]]
        out, done = [], 0
        for x, until in _stretches(differs):
            out += [_to(y, x), self._cells(after[x:until])]
            done = until
        if cut:
            if done != len(after) or not out:
                out.append(_to(y, len(after)))
            out += [self._styled(""), REST]
        return "".join(out)

    def _cells(self, cells: list[Cell]) -> str:
        return "".join(self._styled(style) + glyph for glyph, style in cells)

    def _styled(self, style: str) -> str:
        if style == self._style:
            return ""
        self._style = style
        return f"\x1b[0;{style}m" if style else PLAIN


class Lift(NamedTuple):
    """Rows from `top` to `bottom` move up; blank ones come in below."""

    top: int
    bottom: int
    by: int

    @property
    def codes(self) -> str:
        """A scroll region, line feeds at its end, and the whole screen as the region again."""
        return (
            f"\x1b[{self.top + 1};{self.bottom}r{_to(self.bottom - 1, 0)}{PLAIN}"
            + "\n" * self.by
            + "\x1b[r"
        )

    def applied(self, shown: list[Row]) -> list[Row]:
        """What then stands on the screen."""
        blank: list[Row] = [()] * self.by
        return [
            *shown[: self.top],
            *shown[self.top + self.by : self.bottom],
            *blank,
            *shown[self.bottom :],
        ]


def _lift(old: list[Row], new: list[Row]) -> Lift | None:
    """The rows whose moving up saves most; none where it saves little."""
    best, most = None, WORTH
    for by in LIFTS:
        y = 0
        rows = min(len(old), len(new))
        while y + by < rows:
            top, saved = y, 0
            while y + by < rows and new[y] == old[y + by]:
                saved += _length(new[y]) if new[y] != old[y] else 0
                y += 1
            if saved > most:
                best, most = Lift(top, y + by, by), saved
            y = max(y, top + 1)
    return best


def _length(row: Row) -> int:
    return sum(len(piece) for piece, _ in row)


def _wide(row: Row) -> bool:
    """Whether some character takes more than a cell, or none."""
    plain = "".join(piece for piece, _ in row)
    return not plain.isascii() and cell_len(plain) != len(plain)


def _cells(row: Row) -> list[Cell]:
    return [(glyph, style) for piece, style in row for glyph in piece]


def _stretches(places: list[int]) -> list[tuple[int, int]]:
    """Places joined to stretches, across gaps that are not worth a jump."""
    found: list[tuple[int, int]] = []
    for x in places:
        if found and x - found[-1][1] < GAP:
            found[-1] = (found[-1][0], x + 1)
        else:
            found.append((x, x + 1))
    return found


def _to(row: int, column: int) -> str:
    return f"\x1b[{row + 1};{column + 1}H"
