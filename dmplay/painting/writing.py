"""What a terminal is sent: characters, moves of the cursor and changes of the pen, as few bytes
as do.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import cache, lru_cache
from itertools import groupby, zip_longest
from typing import NamedTuple

from dmplay.painting.pen import (
    NO_CODES,
    SgrCodes,
    choose_codes_for_blank,
    encode_sgr_change,
    select_background,
)

ScreenCell = tuple[str, SgrCodes]  # a character and its pen; a blank's, what is seen of it
BLANK_CELL: ScreenCell = (" ", NO_CODES)
MIN_ERASED_BLANKS = 6  # blanks from which on they are erased, not written


class ScreenPosition(NamedTuple):
    """A cell of the screen, from 0."""

    column: int
    row: int


class RowChange(NamedTuple):
    """A row of the screen as it is and as it is to be, without the blanks at its end."""

    before: tuple[ScreenCell, ...]
    after: tuple[ScreenCell, ...]


class CellSpan(NamedTuple):
    """Cells of a row to be written, of one ground; none where the rest is to be erased."""

    column: int
    cells: tuple[ScreenCell, ...]
    background: SgrCodes  # the colour behind them
    is_blank: bool  # whether they may as well be erased


class PlacedSpan(NamedTuple):
    """A stretch where it stands on the screen."""

    position: ScreenPosition
    span: CellSpan

    def take_span_below(self, pending: dict[ScreenPosition, "PlacedSpan"]) -> "PlacedSpan | None":
        """The run below, taken from those that wait, where it is of the same block."""
        if not (self.span.background or self.span.is_blank):
            return None
        below = ScreenPosition(self.position.column, self.position.row + 1)
        other = pending.get(below)
        if other is None or other.span.background != self.span.background:
            return None
        return pending.pop(below)


class TerminalOutput:
    """What is to be sent, and what state the terminal is in then."""

    def __init__(
        self, columns: int, sgr_codes: SgrCodes = NO_CODES, *, erases_with_color: bool = False
    ) -> None:
        self.sgr_codes = sgr_codes
        self._columns = columns
        self._erases_with_color = erases_with_color  # whether what is erased takes the pen's colour
        self.cursor: ScreenPosition | None = None  # of the cursor, where it is known
        self._chunks: list[str] = []

    def __str__(self) -> str:
        return "".join(self._chunks)

    def append_sequence(self, sequence: str, position: ScreenPosition | None = None) -> None:
        """Sends a sequence that leaves the cursor at a place, or nobody knows where."""
        self._chunks.append(sequence)
        self.cursor = position

    def move_cursor(self, position: ScreenPosition) -> None:
        """Moves the cursor, if it is elsewhere."""
        if self.cursor != position:
            self.append_sequence(encode_cursor_move(self.cursor, position), position)

    def write_changed_rows(self, changes: Mapping[int, RowChange]) -> None:
        """Writes what differs in rows: what has no colour behind it from left to right, then colour
        after colour, block after block, so that each is set once.
        """
        runs = [
            PlacedSpan(ScreenPosition(stretch.column, y), stretch)
            for y, row in changes.items()
            for stretch in _split_into_changed_spans(row)
        ]
        runs.sort(key=lambda run: _background_sort_key(run.span.background))
        waiting = {run.position: run for run in runs}
        for first in runs:
            run = waiting.pop(first.position, None)
            while run:
                self._write_span(run, changes[run.position.row].after)
                run = run.take_span_below(waiting)

    def _write_span(self, placed_span: PlacedSpan, row: Sequence[ScreenCell]) -> None:
        self._move_or_rewrite(placed_span.position, row)
        _, cells, ground, blank = placed_span.span
        if not cells:
            self.erase_with("\x1b[K")
        elif blank and (self._erases_with_color or not ground):
            self.erase_with(f"\x1b[{len(cells)}X", ground)
        else:
            self.write_cells(cells)

    def erase_with(self, sequence: str, background: SgrCodes = NO_CODES) -> None:
        """Erases by a sequence that leaves the cursor where it is."""
        self._set_sgr_codes(choose_codes_for_blank(self.sgr_codes, background))
        self._chunks.append(sequence)

    def write_cells(self, cells: Sequence[ScreenCell]) -> None:
        """Writes cells, on a row that holds them."""
        text, self.sgr_codes = _encode_cells(cells, self.sgr_codes)
        self._chunks.append(text)
        if self.cursor:
            column = self.cursor.column + len(cells)
            # Behind the last column, terminals differ in where the cursor is.
            self.cursor = (
                ScreenPosition(column, self.cursor.row) if column < self._columns else None
            )

    def rewrite_row(self, y: int, cells: Sequence[ScreenCell]) -> None:
        """Writes a row of which nobody knows how many columns it takes."""
        self.move_cursor(ScreenPosition(0, y))
        self.erase_with("\x1b[K")
        self.write_cells(cells)
        self.cursor = None

    def _set_sgr_codes(self, sgr_codes: SgrCodes) -> None:
        self._chunks.append(encode_sgr_change(self.sgr_codes, sgr_codes))
        self.sgr_codes = sgr_codes

    def _move_or_rewrite(self, position: ScreenPosition, row: Sequence[ScreenCell]) -> None:
        """Moves on to a cell, or writes what stands before it again where that is shorter."""
        if self.cursor == position:
            return
        codes = encode_cursor_move(self.cursor, position)
        column = position.column
        if self.cursor and self.cursor.row == position.row and self.cursor.column < column:
            between, there = row[self.cursor.column : column], row[column : column + 1]
            jump = len((codes + _encode_cells(there, self.sgr_codes)[0]).encode())
            if len(between) <= jump:
                again, pen = _encode_cells(between, self.sgr_codes)
                if len((again + _encode_cells(there, pen)[0]).encode()) <= jump:
                    self.write_cells(between)
                    return
        self.append_sequence(codes, position)


@lru_cache(4000)
def encode_cursor_move(old: ScreenPosition | None, new: ScreenPosition) -> str:
    """The shortest sequence that moves the cursor."""
    column = f";{new.column + 1}" if new.column else ""
    forms = [f"\x1b[{new.row + 1}{column}H"]
    if old and old.row == new.row:
        forms += [_encode_steps(new.column - old.column, ("\x1b[C", "C"), ("\b", "D"))]
        forms += ["\r"] * (not new.column)
    elif old and old.column == new.column:
        forms += [_encode_steps(new.row - old.row, ("\x1bD", "B"), ("\x1bM", "A"))]
    return min(forms, key=len)


@cache
def _background_sort_key(background: SgrCodes) -> list[str]:
    """Where among the colours its ground comes."""
    return sorted(background)


def _encode_steps(distance: int, forward: tuple[str, str], backward: tuple[str, str]) -> str:
    """A move of so many columns or rows: what moves by one, and what ends the move by several."""
    one, end = forward if distance > 0 else backward
    return one if abs(distance) == 1 else f"\x1b[{abs(distance)}{end}"


@lru_cache(4000)
def _encode_cells(cells: Sequence[ScreenCell], current: SgrCodes) -> tuple[str, SgrCodes]:
    """Cells as they are sent, and the pen after them."""
    sent = []
    for glyph, wanted in cells:
        pen = choose_codes_for_blank(current, wanted) if glyph == " " else wanted
        if pen != current:
            sent.append(encode_sgr_change(current, pen))
            current = pen
        sent.append(glyph)
    return "".join(sent), current


@lru_cache(4000)
def _split_into_changed_spans(change: RowChange) -> Sequence[CellSpan]:
    """The stretches of cells that differ, of one ground each; where many are blank, by themselves;
    at last what is to be erased up to the end.
    """
    before, after = change
    both = enumerate(zip_longest(before[: len(after)], after, fillvalue=BLANK_CELL))
    differ = [x for x, (old, new) in both if old != new]
    found = []
    for (_, behind), near in groupby(
        enumerate(differ), lambda at: (at[1] - at[0], select_background(after[at[1]][1]))
    ):
        places = [x for _, x in near]
        for first, end in _split_at_long_blanks(after, places[0], places[-1] + 1):
            cells = after[first:end]
            blank = end - first >= MIN_ERASED_BLANKS and all(
                cell == (" ", behind) for cell in cells
            )
            found.append(CellSpan(first, cells, behind, blank))
    if any(cell != BLANK_CELL for cell in before[len(after) :]):
        found.append(CellSpan(len(after), (), NO_CODES, is_blank=False))
    return found


def _split_at_long_blanks(
    row: Sequence[ScreenCell], first: int, end: int
) -> Iterator[tuple[int, int]]:
    """A stretch cut where it is blank for long."""
    for blank, near in groupby(range(first, end), lambda x: row[x][0] == " "):
        places = [*near]
        if blank and len(places) >= MIN_ERASED_BLANKS:
            if first < places[0]:
                yield first, places[0]
            yield places[0], places[-1] + 1
            first = places[-1] + 1
    if first < end:
        yield first, end
