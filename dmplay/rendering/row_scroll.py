"""Scrolling of a block of screen rows, which saves output when a log moves up."""

from typing import NamedTuple

from dmplay.terminal_styles import StyledRow

SCROLL_DISTANCES = (1, 2, 3, 4)  # rows by which a log may move up in one frame
MIN_SAVED_CHARACTERS = 25  # a scroll must save more characters than this


class RowScroll(NamedTuple):
    """A scroll of the rows `top` to `bottom - 1` up by `distance`, with blank rows below."""

    top: int
    bottom: int
    distance: int

    @property
    def escape_sequence(self) -> str:
        """The escape sequence that deletes rows at the top and inserts blank ones at the bottom.

        The cursor ends at the first blank row.
        """
        count = self.distance if self.distance > 1 else ""
        positions = f"\x1b[{self.top + 1}H", f"\x1b[{self.first_blank_row + 1}H"
        return f"{positions[0]}\x1b[{count}M{positions[1]}\x1b[{count}L"

    @property
    def first_blank_row(self) -> int:
        """The index of the first blank row."""
        return self.bottom - self.distance

    def apply_to(self, rows: list[StyledRow]) -> list[StyledRow]:
        """Return the rows of the screen after this scroll."""
        blank: list[StyledRow] = [()] * self.distance
        return [
            *rows[: self.top],
            *rows[self.top + self.distance : self.bottom],
            *blank,
            *rows[self.bottom :],
        ]


def find_best_scroll(old_rows: list[StyledRow], new_rows: list[StyledRow]) -> RowScroll | None:
    """Return the scroll that saves the most characters, or None if none saves enough."""
    best, max_saved = None, MIN_SAVED_CHARACTERS
    for distance in SCROLL_DISTANCES:
        y = 0
        rows = min(len(old_rows), len(new_rows))
        while y + distance < rows:
            top, saved = y, 0
            while y + distance < rows and new_rows[y] == old_rows[y + distance]:
                saved += _count_characters(new_rows[y]) if new_rows[y] != old_rows[y] else 0
                y += 1
            if saved > max_saved:
                best, max_saved = RowScroll(top, y + distance, distance), saved
            y = max(y, top + 1)
    return best


def _count_characters(row: StyledRow) -> int:
    """Return the number of characters of a row."""
    return sum(len(piece) for piece, _ in row)
