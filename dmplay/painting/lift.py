"""Rows of the screen that move up: a log goes on so."""

from typing import NamedTuple

from dmplay.styles import Row

LIFTS = (1, 2, 3, 4)  # by how many rows a log may move up in one go
WORTH = 40  # characters saved that a scrolling of rows is worth


class Lift(NamedTuple):
    """Rows from `top` to `bottom` move up; blank ones come in below."""

    top: int
    bottom: int
    by: int

    @property
    def codes(self) -> str:
        """A scroll region, line feeds at its end, and the whole screen as the region again."""
        region = f"\x1b[{self.top + 1};{self.bottom}r\x1b[{self.bottom}H"
        return region + "\n" * self.by + "\x1b[r"

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
