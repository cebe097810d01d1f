"""Encode screen changes as few bytes of characters, cursor moves and SGR codes."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cache, lru_cache
from itertools import groupby, zip_longest
from typing import NamedTuple

from dmplay.rendering.sgr_codes import (
    NO_CODES,
    SgrCodes,
    choose_codes_for_blank,
    encode_sgr_change,
    select_background,
)

ScreenCell = tuple[str, SgrCodes]  # character and SGR codes; of a blank, only the visible codes
BLANK_CELL: ScreenCell = (" ", NO_CODES)
MIN_ERASED_BLANKS = 6  # minimum number of blanks that are erased instead of written


class ScreenPosition(NamedTuple):
    """A cell of the screen, counted from 0."""

    column: int
    row: int


class RowChange(NamedTuple):
    """The cells of a row before and after a change, without the blanks at its end."""

    before: tuple[ScreenCell, ...]
    after: tuple[ScreenCell, ...]


class CellSpan(NamedTuple):
    """Cells to write in one row, all with the same background; none to erase the end of the row."""

    column: int
    cells: tuple[ScreenCell, ...]
    background: SgrCodes  # background colour of the cells
    is_blank: bool  # only blanks, so they may be erased instead of written


class PlacedSpan(NamedTuple):
    """A span of cells and its position on the screen."""

    position: ScreenPosition
    span: CellSpan

    def take_span_below(self, pending: dict[ScreenPosition, "PlacedSpan"]) -> "PlacedSpan | None":
        """Remove the span directly below from `pending` and return it, or None.

        Only a span of the same background counts, because it continues the same block.
        """
        if not (self.span.background or self.span.is_blank):
            return None
        below = ScreenPosition(self.position.column, self.position.row + 1)
        candidate = pending.get(below)
        if candidate is None or candidate.span.background != self.span.background:
            return None
        return pending.pop(below)


class TerminalOutput:
    """The terminal output collected so far, and the terminal's state after it."""

    def __init__(
        self, columns: int, sgr_codes: SgrCodes = NO_CODES, *, erases_with_color: bool = False
    ) -> None:
        self.sgr_codes = sgr_codes
        self._columns = columns
        # The terminal fills erased cells with the current background colour.
        self._erases_with_color = erases_with_color
        self.cursor: ScreenPosition | None = None  # None if unknown
        self._chunks: list[str] = []

    def __str__(self) -> str:
        return "".join(self._chunks)

    def append_sequence(self, sequence: str, position: ScreenPosition | None = None) -> None:
        """Append a sequence that leaves the cursor at a position, or at an unknown one if None."""
        self._chunks.append(sequence)
        self.cursor = position

    def move_cursor(self, position: ScreenPosition) -> None:
        """Move the cursor to a position, unless it is there."""
        if self.cursor != position:
            self.append_sequence(encode_cursor_move(self.cursor, position), position)

    def write_changed_rows(self, changes: Mapping[int, RowChange]) -> None:
        """Write the cells that differ in the changed rows.

        Spans without background colour are written from left to right, then those of each colour
        block by block, so that each colour is set once.
        """
        placed_spans = [
            PlacedSpan(ScreenPosition(span.column, y), span)
            for y, change in changes.items()
            for span in _split_into_changed_spans(change)
        ]
        placed_spans.sort(key=lambda placed_span: _background_sort_key(placed_span.span.background))
        pending = {placed_span.position: placed_span for placed_span in placed_spans}
        for start_span in placed_spans:
            placed_span = pending.pop(start_span.position, None)
            while placed_span:
                self._write_span(placed_span, changes[placed_span.position.row].after)
                placed_span = placed_span.take_span_below(pending)

    def _write_span(self, placed_span: PlacedSpan, row: Sequence[ScreenCell]) -> None:
        """Write or erase a span, whichever the terminal allows."""
        self._move_or_rewrite(placed_span.position, row)
        _, cells, background, is_blank = placed_span.span
        if not cells:
            self.erase_with("\x1b[K")
        elif is_blank and (self._erases_with_color or not background):
            self.erase_with(f"\x1b[{len(cells)}X", background)
        else:
            self.write_cells(cells)

    def erase_with(self, sequence: str, background: SgrCodes = NO_CODES) -> None:
        """Append a sequence that erases cells to a background without moving the cursor."""
        self._set_sgr_codes(choose_codes_for_blank(self.sgr_codes, background))
        self._chunks.append(sequence)

    def write_cells(self, cells: Sequence[ScreenCell]) -> None:
        """Write cells at the cursor's position."""
        text, self.sgr_codes = _encode_cells(cells, self.sgr_codes)
        self._chunks.append(text)
        if self.cursor:
            column = self.cursor.column + len(cells)
            # Terminals differ in the cursor's position after the last column.
            self.cursor = (
                ScreenPosition(column, self.cursor.row) if column < self._columns else None
            )

    def rewrite_row(self, y: int, cells: Sequence[ScreenCell]) -> None:
        """Erase and write a whole row whose width in columns is unknown."""
        self.move_cursor(ScreenPosition(0, y))
        self.erase_with("\x1b[K")
        self.write_cells(cells)
        self.cursor = None

    def _set_sgr_codes(self, sgr_codes: SgrCodes) -> None:
        """Append the change to other SGR codes."""
        self._chunks.append(encode_sgr_change(self.sgr_codes, sgr_codes))
        self.sgr_codes = sgr_codes

    def _move_or_rewrite(self, position: ScreenPosition, row: Sequence[ScreenCell]) -> None:
        """Move the cursor to a cell, or write the cells before it again if that is shorter."""
        if self.cursor == position:
            return
        move_sequence = encode_cursor_move(self.cursor, position)
        column = position.column
        if self.cursor and self.cursor.row == position.row and self.cursor.column < column:
            skipped_cells, target_cells = row[self.cursor.column : column], row[column : column + 1]
            jump_bytes = len(
                (move_sequence + _encode_cells(target_cells, self.sgr_codes)[0]).encode()
            )
            if len(skipped_cells) <= jump_bytes:
                rewritten, new_codes = _encode_cells(skipped_cells, self.sgr_codes)
                if (
                    len((rewritten + _encode_cells(target_cells, new_codes)[0]).encode())
                    <= jump_bytes
                ):
                    self.write_cells(skipped_cells)
                    return
        self.append_sequence(move_sequence, position)


@lru_cache(4000)
def encode_cursor_move(old: ScreenPosition | None, new: ScreenPosition) -> str:
    """Return the shortest sequence that moves the cursor; `old` is None if it is unknown."""
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
    """Return the sort key of a background, which puts spans without one first."""
    return sorted(background)


def _encode_steps(distance: int, forward: tuple[str, str], backward: tuple[str, str]) -> str:
    """Return the sequence for a move by `distance` columns or rows.

    `forward` and `backward` are (move by one, final letter of the move by several).
    """
    single_step, final_letter = forward if distance > 0 else backward
    return single_step if abs(distance) == 1 else f"\x1b[{abs(distance)}{final_letter}"


@lru_cache(4000)
def _encode_cells(cells: Sequence[ScreenCell], current: SgrCodes) -> tuple[str, SgrCodes]:
    """Return the characters and SGR changes that write the cells, and the codes set at the end."""
    chunks = []
    for glyph, cell_codes in cells:
        new_codes = choose_codes_for_blank(current, cell_codes) if glyph == " " else cell_codes
        if new_codes != current:
            chunks.append(encode_sgr_change(current, new_codes))
            current = new_codes
        chunks.append(glyph)
    return "".join(chunks), current


@lru_cache(4000)
def _split_into_changed_spans(change: RowChange) -> Sequence[CellSpan]:
    """Split the cells that differ into spans of one background each.

    Long runs of blanks are spans of their own. A last span erases the end of the row, if needed.
    """
    before, after = change
    cell_pairs = enumerate(zip_longest(before[: len(after)], after, fillvalue=BLANK_CELL))
    changed_columns = [x for x, (old, new) in cell_pairs if old != new]
    spans = []
    for (_, background), group in groupby(
        enumerate(changed_columns),
        lambda pair: (pair[1] - pair[0], select_background(after[pair[1]][1])),
    ):
        columns = [x for _, x in group]
        for first, end in _split_at_long_blanks(after, columns[0], columns[-1] + 1):
            cells = after[first:end]
            is_blank = end - first >= MIN_ERASED_BLANKS and all(
                cell == (" ", background) for cell in cells
            )
            spans.append(CellSpan(first, cells, background, is_blank))
    if any(cell != BLANK_CELL for cell in before[len(after) :]):
        spans.append(CellSpan(len(after), (), NO_CODES, is_blank=False))
    return spans


def _split_at_long_blanks(
    row: Sequence[ScreenCell], first: int, end: int
) -> Iterator[tuple[int, int]]:
    """Yield (first, end) of the parts of a span, split where it has a long run of blanks."""
    for is_blank, group in groupby(range(first, end), lambda x: row[x][0] == " "):
        columns = [*group]
        if is_blank and len(columns) >= MIN_ERASED_BLANKS:
            if first < columns[0]:
                yield first, columns[0]
            yield columns[0], columns[-1] + 1
            first = columns[-1] + 1
    if first < end:
        yield first, end
