"""The results of a tournament, saved in a file so that an interrupted tournament can resume."""

import json
from collections.abc import Collection, Iterator, Mapping
from itertools import chain
from pathlib import Path

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.safe_files import read_complete_lines, write_at_offset, write_file
from dmplay.errors import BadParameter
from dmplay.transcript.line_parser import JSON_DECODER

MAX_RETURN = 1e100  # larger than any return of a game, and its square is finite


class TournamentCheckpoint(dict[tuple[int, ...], Reals]):
    """The returns of each seating, also in a file with one line of JSON per seating.

    Each line is written as soon as its seating is played.
    """

    def __init__(
        self,
        path: Path,
        description: Mapping[str, object],
        seatings: Collection[tuple[int, ...]],
        episodes: int,
        return_bounds: tuple[float, float] = (-MAX_RETURN, MAX_RETURN),
    ) -> None:
        """Read the seatings of the tournament with this description that the file contains.

        Each has the returns `[E, n]` of E `episodes` and n seats, within `return_bounds`.
        The file is created with the first new seating. Raise BadParameter if the file is not of
        this tournament, or if it cannot be read.
        """
        super().__init__()
        self._path, self._byte_count = path, 0
        self._seatings, self._episodes, self._return_bounds = seatings, episodes, return_bounds
        self._header = f"{json.dumps(description)}\n"
        for number, row in enumerate(self._iter_rows(), 1):
            if number == 1 and row != self._header:
                advice = "got a file of another tournament; name another file, or remove it"
                raise BadParameter(f"{path}: {advice}")
            if number > 1:
                self._read_row(number, row)
            self._byte_count += len(row.encode())
        if not self._byte_count and path.exists() and path.stat().st_size:
            raise BadParameter(f"{path}: not a tournament file; name another file, or remove it")

    def _iter_rows(self) -> Iterator[str]:
        """Yield the complete lines of the file, if it exists; raise BadParameter on failure."""
        try:
            if self._path.exists():
                yield from read_complete_lines(self._path)
        except OSError as error:
            raise BadParameter(f"{self._path}: {error.strerror}") from None

    def _read_row(self, number: int, row: str) -> None:
        """Read one seating from a line of the file; raise BadParameter if it is malformed."""
        try:
            data = JSON_DECODER.decode(row)
            seating, returns = tuple(data["seats"]), np.array(data["returns"], float)
            if not all(type(entrant) is int for entrant in seating):
                raise ValueError
        except (ValueError, TypeError, KeyError, OverflowError, RecursionError):
            raise self._row_error(number, "not a seating") from None
        if seating not in self._seatings:
            raise self._row_error(number, f"the seating {[*seating]} is not in this tournament")
        if seating in self:
            raise self._row_error(number, f"the seating {[*seating]} occurs twice")
        if returns.shape != (self._episodes, len(seating)):
            expected = f"expected {self._episodes} games of {len(seating)} seats"
            raise self._row_error(number, f"got returns of shape {[*returns.shape]}, {expected}")
        if not {*map(type, chain.from_iterable(data["returns"]))} <= {int, float}:
            values = [value for game in data["returns"] for value in game]
            invalid = next(value for value in values if type(value) not in (int, float))
            message = f"got the return {json.dumps(invalid)}, expected a number"
            raise self._row_error(number, message)
        low, high = self._return_bounds
        for value in (returns.min(), returns.max()):
            if not low <= value <= high:
                expected = f"expected a number from {low:g} to {high:g}"
                raise self._row_error(number, f"got the return {value:g}, {expected}")
        super().__setitem__(seating, returns)

    def _row_error(self, number: int, explanation: str) -> BadParameter:
        """Return the error for a line of the file."""
        return BadParameter(f"{self._path}:{number}: {explanation}; remove the line")

    def __setitem__(self, seating: tuple[int, ...], returns: Reals) -> None:
        """Store the returns of a seating, and append them to the file."""
        super().__setitem__(seating, returns)
        if not self._byte_count:
            write_file(self._path, [self._header], continues=True)
            self._byte_count = len(self._header.encode())
        row = json.dumps({"seats": seating, "returns": returns.tolist()})
        self._byte_count = write_at_offset(self._path, self._byte_count, f"{row}\n")
