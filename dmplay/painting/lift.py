"""Rows of the screen that move up: a log goes on so."""

from typing import NamedTuple

from dmplay.styles import Row

LIFTS = (1, 2, 3, 4)  # by how many rows a log may move up in one go
WORTH = 25  # characters saved that a scrolling of rows may be worth


class Lift(NamedTuple):
    """Rows from `top` to `bottom` move up; blank ones come in below."""

    top: int
    bottom: int
    by: int

    @property
    def codes(self) -> str:
        """Rows out at the top, blank ones in at the bottom; the cursor stays before them."""
        many = self.by if self.by > 1 else ""
        at = f"\x1b[{self.top + 1}H", f"\x1b[{self.below + 1}H"
        return f"{at[0]}\x1b[{many}M{at[1]}\x1b[{many}L"

    @property
    def below(self) -> int:
        """The first of the rows that come in."""
        return self.bottom - self.by

    def applied(self, shown: list[Row]) -> list[Row]:
        """What then stands on the screen."""
        blank: list[Row] = [()] * self.by
        return [
            *shown[: self.top],
            *shown[self.top + self.by : self.bottom],
            *blank,
            *shown[self.bottom :],
        ]


def lifted(old: list[Row], new: list[Row]) -> Lift | None:
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
