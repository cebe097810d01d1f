"""Rows of the screen that move up: a log goes on so."""

from typing import NamedTuple

from dmplay.styles import StyledRow

SCROLL_DISTANCES = (1, 2, 3, 4)  # by how many rows a log may move up in one go
MIN_SAVED_CHARACTERS = 25  # characters saved that a scrolling of rows may be worth


class RowScroll(NamedTuple):
    """Rows from `top` to `bottom` move up; blank ones come in below."""

    top: int
    bottom: int
    distance: int

    @property
    def escape_sequence(self) -> str:
        """Rows out at the top, blank ones in at the bottom; the cursor stays before them."""
        many = self.distance if self.distance > 1 else ""
        at = f"\x1b[{self.top + 1}H", f"\x1b[{self.first_blank_row + 1}H"
        return f"{at[0]}\x1b[{many}M{at[1]}\x1b[{many}L"

    @property
    def first_blank_row(self) -> int:
        """The first of the rows that come in."""
        return self.bottom - self.distance

    def apply_to(self, rows: list[StyledRow]) -> list[StyledRow]:
        """What then stands on the screen."""
        blank: list[StyledRow] = [()] * self.distance
        return [
            *rows[: self.top],
            *rows[self.top + self.distance : self.bottom],
            *blank,
            *rows[self.bottom :],
        ]


def find_best_scroll(old_rows: list[StyledRow], new_rows: list[StyledRow]) -> RowScroll | None:
    """The rows whose moving up saves most; none where it saves little."""
    best, most = None, MIN_SAVED_CHARACTERS
    for by in SCROLL_DISTANCES:
        y = 0
        rows = min(len(old_rows), len(new_rows))
        while y + by < rows:
            top, saved = y, 0
            while y + by < rows and new_rows[y] == old_rows[y + by]:
                saved += _count_characters(new_rows[y]) if new_rows[y] != old_rows[y] else 0
                y += 1
            if saved > most:
                best, most = RowScroll(top, y + by, by), saved
            y = max(y, top + 1)
    return best


def _count_characters(row: StyledRow) -> int:
    return sum(len(piece) for piece, _ in row)
