"""What a terminal is sent: characters, moves of the cursor and changes of the pen, as few bytes
as do.
"""

from typing import NamedTuple

from dmplay.painting.pen import PLAIN, Pen, blanking, turned

Cell = tuple[str, Pen]  # a character and its pen; a blank's, what is seen of it
BLANK: Cell = (" ", PLAIN)
ERASED = 6  # blanks from which on they are erased, not written


class Place(NamedTuple):
    """A cell of the screen, from 0."""

    column: int
    row: int


class Writing:
    """What is to be sent, and what state the terminal is in then."""

    def __init__(self, columns: int, pen: Pen = PLAIN) -> None:
        self.pen = pen
        self._columns = columns
        self.place: Place | None = None  # of the cursor, where it is known
        self._sent: list[str] = []

    def __str__(self) -> str:
        return "".join(self._sent)

    def send(self, codes: str, place: Place | None = None) -> None:
        """Sends a sequence that leaves the cursor at a place, or nobody knows where."""
        self._sent.append(codes)
        self.place = place

    def go(self, place: Place) -> None:
        """Moves the cursor, if it is elsewhere."""
        if self.place != place:
            self.send(moved(self.place, place), place)

    def row(self, y: int, before: list[Cell], after: list[Cell]) -> None:
        """Writes what differs in a row; both are as long."""
        for first, end in _stretches(before, after):
            self._reach(Place(first, y), after)
            cells = after[first:end]
            if len(cells) >= ERASED and all(cell == BLANK for cell in cells):
                self.erase(f"\x1b[{len(cells)}X")
            else:
                self.write(cells)

    def erase(self, codes: str) -> None:
        """Erases by a sequence that leaves the cursor where it is."""
        self._turn(blanking(self.pen, PLAIN))
        self._sent.append(codes)

    def write(self, cells: list[Cell]) -> None:
        """Writes cells, on a row that holds them."""
        text, self.pen = _written(cells, self.pen)
        self._sent.append(text)
        if self.place:
            column = self.place.column + len(cells)
            # Behind the last column, terminals differ in where the cursor is.
            self.place = Place(column, self.place.row) if column < self._columns else None

    def _turn(self, pen: Pen) -> None:
        self._sent.append(turned(self.pen, pen))
        self.pen = pen

    def _reach(self, place: Place, row: list[Cell]) -> None:
        """Moves on to a cell, or writes what stands before it again where that is shorter."""
        if self.place and self.place.row == place.row and self.place.column < place.column:
            between, there = row[self.place.column : place.column], row[place.column]
            jumped = moved(self.place, place) + _written([there], self.pen)[0]
            again = _written([*between, there], self.pen)[0]
            if len(again.encode()) <= len(jumped.encode()):
                self.write(between)
        self.go(place)


def moved(old: Place | None, new: Place) -> str:
    """The shortest sequence that moves the cursor."""
    forms = [f"\x1b[{new.row + 1};{new.column + 1}H"]
    if not new.column:
        forms.append(f"\x1b[{new.row + 1}H" if new.row else "\x1b[H")
    if old and old.row == new.row:
        right = new.column - old.column
        forms += ["\r"] * (not new.column) + [_steps(right, "C", "D")] * bool(right)
    elif old and old.column == new.column:
        forms.append(_steps(new.row - old.row, "B", "A"))
    return min(forms, key=len)


def _steps(many: int, on: str, back: str) -> str:
    steps = abs(many)
    return f"\x1b[{steps if steps > 1 else ''}{on if many > 0 else back}"


def _written(cells: list[Cell], now: Pen) -> tuple[str, Pen]:
    """Cells as they are sent, and the pen after them."""
    sent = []
    for glyph, wanted in cells:
        pen = blanking(now, wanted) if glyph == " " else wanted
        sent.append(turned(now, pen) + glyph)
        now = pen
    return "".join(sent), now


def _stretches(before: list[Cell], after: list[Cell]) -> list[tuple[int, int]]:
    """The stretches of cells that differ; those of blanks alone, if long, by themselves."""
    found: list[tuple[int, int]] = []
    for x, (old, new) in enumerate(zip(before, after, strict=True)):
        if old == new:
            continue
        if found and found[-1][1] == x:
            found[-1] = (found[-1][0], x + 1)
        else:
            found.append((x, x + 1))
    return [part for first, end in found for part in _parts(after, first, end)]


def _parts(row: list[Cell], first: int, end: int) -> list[tuple[int, int]]:
    """A stretch cut where its blanks are erased."""
    parts, begin, x = [], first, first
    while x < end:
        until = x
        while until < end and row[until] == BLANK:
            until += 1
        if until - x >= ERASED:
            parts += [(begin, x)] * (begin < x) + [(x, until)]
            begin = until
        x = max(until, x + 1)
    return [*parts, *[(begin, end)] * (begin < end)]
