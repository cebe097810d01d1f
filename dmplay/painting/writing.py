"""What a terminal is sent: characters, moves of the cursor and changes of the pen, as few bytes
as do.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import cache, lru_cache
from itertools import groupby, zip_longest
from typing import NamedTuple

from dmplay.painting.pen import PLAIN, Pen, blanking, ground, turned

Cell = tuple[str, Pen]  # a character and its pen; a blank's, what is seen of it
BLANK: Cell = (" ", PLAIN)
ERASED = 6  # blanks from which on they are erased, not written


class Place(NamedTuple):
    """A cell of the screen, from 0."""

    column: int
    row: int


class Change(NamedTuple):
    """A row of the screen as it is and as it is to be, without the blanks at its end."""

    before: tuple[Cell, ...]
    after: tuple[Cell, ...]


class Stretch(NamedTuple):
    """Cells of a row to be written, of one ground; none where the rest is to be erased."""

    column: int
    cells: tuple[Cell, ...]
    ground: Pen  # the colour behind them
    blank: bool  # whether they may as well be erased


class Run(NamedTuple):
    """A stretch where it stands on the screen."""

    place: Place
    stretch: Stretch

    def going_on(self, waiting: dict[Place, "Run"]) -> "Run | None":
        """The run below, taken from those that wait, where it is of the same block."""
        if not (self.stretch.ground or self.stretch.blank):
            return None
        below = Place(self.place.column, self.place.row + 1)
        other = waiting.get(below)
        if other is None or other.stretch.ground != self.stretch.ground:
            return None
        return waiting.pop(below)


class Writing:
    """What is to be sent, and what state the terminal is in then."""

    def __init__(self, columns: int, pen: Pen = PLAIN, *, fills: bool = False) -> None:
        self.pen = pen
        self._columns = columns
        self._fills = fills  # whether what is erased takes the pen's colour
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

    def rows(self, changed: Mapping[int, Change]) -> None:
        """Writes what differs in rows: what has no colour behind it from left to right, then colour
        after colour, block after block, so that each is set once.
        """
        runs = [
            Run(Place(stretch.column, y), stretch)
            for y, row in changed.items()
            for stretch in _stretches(row)
        ]
        runs.sort(key=lambda run: _order(run.stretch.ground))
        waiting = {run.place: run for run in runs}
        for first in runs:
            run = waiting.pop(first.place, None)
            while run:
                self._run(run, changed[run.place.row].after)
                run = run.going_on(waiting)

    def _run(self, run: Run, row: Sequence[Cell]) -> None:
        self._reach(run.place, row)
        _, cells, ground, blank = run.stretch
        if not cells:
            self.erase("\x1b[K")
        elif blank and (self._fills or not ground):
            self.erase(f"\x1b[{len(cells)}X", ground)
        else:
            self.write(cells)

    def erase(self, codes: str, ground: Pen = PLAIN) -> None:
        """Erases by a sequence that leaves the cursor where it is."""
        self._turn(blanking(self.pen, ground))
        self._sent.append(codes)

    def write(self, cells: Sequence[Cell]) -> None:
        """Writes cells, on a row that holds them."""
        text, self.pen = _written(cells, self.pen)
        self._sent.append(text)
        if self.place:
            column = self.place.column + len(cells)
            # Behind the last column, terminals differ in where the cursor is.
            self.place = Place(column, self.place.row) if column < self._columns else None

    def whole(self, y: int, cells: Sequence[Cell]) -> None:
        """Writes a row of which nobody knows how many columns it takes."""
        self.go(Place(0, y))
        self.erase("\x1b[K")
        self.write(cells)
        self.place = None

    def _turn(self, pen: Pen) -> None:
        self._sent.append(turned(self.pen, pen))
        self.pen = pen

    def _reach(self, place: Place, row: Sequence[Cell]) -> None:
        """Moves on to a cell, or writes what stands before it again where that is shorter."""
        if self.place == place:
            return
        codes = moved(self.place, place)
        column = place.column
        if self.place and self.place.row == place.row and self.place.column < column:
            between, there = row[self.place.column : column], row[column : column + 1]
            jump = len((codes + _written(there, self.pen)[0]).encode())
            if len(between) <= jump:
                again, pen = _written(between, self.pen)
                if len((again + _written(there, pen)[0]).encode()) <= jump:
                    self.write(between)
                    return
        self.send(codes, place)


@lru_cache(4000)
def moved(old: Place | None, new: Place) -> str:
    """The shortest sequence that moves the cursor."""
    column = f";{new.column + 1}" if new.column else ""
    forms = [f"\x1b[{new.row + 1}{column}H"]
    if old and old.row == new.row:
        forms += [_steps(new.column - old.column, ("\x1b[C", "C"), ("\b", "D"))]
        forms += ["\r"] * (not new.column)
    elif old and old.column == new.column:
        forms += [_steps(new.row - old.row, ("\x1bD", "B"), ("\x1bM", "A"))]
    return min(forms, key=len)


@cache
def _order(ground: Pen) -> list[str]:
    """Where among the colours its ground comes."""
    return sorted(ground)


def _steps(many: int, on: tuple[str, str], back: tuple[str, str]) -> str:
    """A move of so many columns or rows: what moves by one, and what ends the move by several."""
    one, end = on if many > 0 else back
    return one if abs(many) == 1 else f"\x1b[{abs(many)}{end}"


@lru_cache(4000)
def _written(cells: Sequence[Cell], now: Pen) -> tuple[str, Pen]:
    """Cells as they are sent, and the pen after them."""
    sent = []
    for glyph, wanted in cells:
        pen = blanking(now, wanted) if glyph == " " else wanted
        if pen != now:
            sent.append(turned(now, pen))
            now = pen
        sent.append(glyph)
    return "".join(sent), now


@lru_cache(4000)
def _stretches(row: Change) -> Sequence[Stretch]:
    """The stretches of cells that differ, of one ground each; where many are blank, by themselves;
    at last what is to be erased up to the end.
    """
    before, after = row
    both = enumerate(zip_longest(before[: len(after)], after, fillvalue=BLANK))
    differ = [x for x, (old, new) in both if old != new]
    found = []
    for (_, behind), near in groupby(
        enumerate(differ), lambda at: (at[1] - at[0], ground(after[at[1]][1]))
    ):
        places = [x for _, x in near]
        for first, end in _parts(after, places[0], places[-1] + 1):
            cells = after[first:end]
            blank = end - first >= ERASED and all(cell == (" ", behind) for cell in cells)
            found.append(Stretch(first, cells, behind, blank))
    if any(cell != BLANK for cell in before[len(after) :]):
        found.append(Stretch(len(after), (), PLAIN, blank=False))
    return found


def _parts(row: Sequence[Cell], first: int, end: int) -> Iterator[tuple[int, int]]:
    """A stretch cut where it is blank for long."""
    for blank, near in groupby(range(first, end), lambda x: row[x][0] == " "):
        places = [*near]
        if blank and len(places) >= ERASED:
            if first < places[0]:
                yield first, places[0]
            yield places[0], places[-1] + 1
            first = places[-1] + 1
    if first < end:
        yield first, end
