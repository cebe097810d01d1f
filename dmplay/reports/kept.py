"""What of a tournament is played, kept in a file so that it goes on after it was stopped."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from dmplay.chance import Reals
from dmplay.disk import read_complete_lines, write_at_offset, write_file
from dmplay.errors import BadParameter


class TournamentCheckpoint(dict[tuple[int, ...], Reals]):
    """The returns of each seating, a line of JSON a seating; written as soon as one is played."""

    def __init__(self, path: Path, description: Mapping[str, object]) -> None:
        """What a file holds of this tournament, to be added to.

        Raises BadParameter for a file of something else, and OSError.
        """
        super().__init__()
        self._path, self._byte_count = path, 0
        self._header = f"{json.dumps(description)}\n"
        for number, row in enumerate(read_complete_lines(path) if path.exists() else (), 1):
            if number == 1 and row != self._header:
                what = "of another tournament; name another file, or remove it"
                raise BadParameter(f"{path}: {what}")
            if number > 1:
                self._read_row(number, row)
            self._byte_count += len(row.encode())
        if not self._byte_count and path.exists() and path.stat().st_size:
            raise BadParameter(f"{path}: of no tournament; name another file, or remove it")

    def _read_row(self, number: int, row: str) -> None:
        try:
            told = json.loads(row)
            super().__setitem__(tuple(told["seats"]), np.array(told["returns"], float))
        except (ValueError, TypeError, KeyError):
            raise BadParameter(f"{self._path}:{number}: not a seating; remove the line") from None

    def __setitem__(self, seating: tuple[int, ...], returns: Reals) -> None:
        super().__setitem__(seating, returns)
        if not self._byte_count:
            write_file(self._path, [self._header], force=True)
            self._byte_count = len(self._header.encode())
        row = json.dumps({"seats": seating, "returns": returns.tolist()})
        self._byte_count = write_at_offset(self._path, self._byte_count, f"{row}\n")
