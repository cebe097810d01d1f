"""The results of a tournament, saved in a file so that an interrupted tournament can resume."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from dmplay.chance import Reals
from dmplay.errors import BadParameter
from dmplay.safe_files import read_complete_lines, write_at_offset, write_file


class TournamentCheckpoint(dict[tuple[int, ...], Reals]):
    """The returns of each seating, also in a file with one line of JSON per seating.

    Each line is written as soon as its seating is played.
    """

    def __init__(self, path: Path, description: Mapping[str, object]) -> None:
        """Read the seatings that a file holds of the tournament with this description.

        The file is created with the first new seating. Raise BadParameter if the file is not of
        this tournament, and OSError if it cannot be read.
        """
        super().__init__()
        self._path, self._byte_count = path, 0
        self._header = f"{json.dumps(description)}\n"
        for number, row in enumerate(read_complete_lines(path) if path.exists() else (), 1):
            if number == 1 and row != self._header:
                advice = "of another tournament; name another file, or remove it"
                raise BadParameter(f"{path}: {advice}")
            if number > 1:
                self._read_row(number, row)
            self._byte_count += len(row.encode())
        if not self._byte_count and path.exists() and path.stat().st_size:
            raise BadParameter(f"{path}: of no tournament; name another file, or remove it")

    def _read_row(self, number: int, row: str) -> None:
        """Read one seating from a line of the file; raise BadParameter if it is malformed."""
        try:
            data = json.loads(row)
            super().__setitem__(tuple(data["seats"]), np.array(data["returns"], float))
        except (ValueError, TypeError, KeyError):
            raise BadParameter(f"{self._path}:{number}: not a seating; remove the line") from None

    def __setitem__(self, seating: tuple[int, ...], returns: Reals) -> None:
        """Store the returns of a seating, and append them to the file."""
        super().__setitem__(seating, returns)
        if not self._byte_count:
            write_file(self._path, [self._header], force=True)
            self._byte_count = len(self._header.encode())
        row = json.dumps({"seats": seating, "returns": returns.tolist()})
        self._byte_count = write_at_offset(self._path, self._byte_count, f"{row}\n")
