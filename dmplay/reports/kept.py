"""What of a tournament is played, kept in a file so that it goes on after it was stopped."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from dmplay.chance import Reals
from dmplay.disk import put, rows, write
from dmplay.errors import BadParameter


class Kept(dict[tuple[int, ...], Reals]):
    """The returns of each seating, a line of JSON a seating; written as soon as one is played."""

    def __init__(self, path: Path, told: Mapping[str, object]) -> None:
        """What a file holds of this tournament, to be added to.

        Raises BadParameter for a file of something else, and OSError.
        """
        super().__init__()
        self._path, self._size = path, 0
        self._head = f"{json.dumps(told)}\n"
        for number, row in enumerate(rows(path) if path.exists() else (), 1):
            if number == 1 and row != self._head:
                what = "of another tournament; name another file, or remove it"
                raise BadParameter(f"{path}: {what}")
            if number > 1:
                self._read(number, row)
            self._size += len(row.encode())
        if not self._size and path.exists() and path.stat().st_size:
            raise BadParameter(f"{path}: of no tournament; name another file, or remove it")

    def _read(self, number: int, row: str) -> None:
        try:
            told = json.loads(row)
            super().__setitem__(tuple(told["seats"]), np.array(told["returns"], float))
        except (ValueError, TypeError, KeyError):
            raise BadParameter(f"{self._path}:{number}: not a seating; remove the line") from None

    def __setitem__(self, seating: tuple[int, ...], returns: Reals) -> None:
        super().__setitem__(seating, returns)
        if not self._size:
            write(self._path, [self._head], force=True)
            self._size = len(self._head.encode())
        row = json.dumps({"seats": seating, "returns": returns.tolist()})
        self._size = put(self._path, self._size, f"{row}\n")
