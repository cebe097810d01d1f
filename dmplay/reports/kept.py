"""What of a tournament is played, kept in a file so that it goes on after it was stopped."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from dmplay.chance import Reals
from dmplay.disk import content, write
from dmplay.errors import BadParameter


class Kept(dict[tuple[int, ...], Reals]):
    """The returns of each seating, a line of JSON a seating; written as soon as one is played."""

    def __init__(self, path: Path, told: Mapping[str, object]) -> None:
        """What a file holds of this tournament, to be added to.

        Raises BadParameter for a file of something else, and OSError.
        """
        super().__init__()
        self._path, head = path, json.dumps(told)
        rows = content(path).decode().splitlines() if path.exists() else []
        if rows and rows[0] != head:
            raise BadParameter(f"{path}: of another tournament; name another file, or remove it")
        self._rows = rows or [head]
        for row in map(json.loads, rows[1:]):
            super().__setitem__(tuple(row["seats"]), np.array(row["returns"]))

    def __setitem__(self, seating: tuple[int, ...], returns: Reals) -> None:
        super().__setitem__(seating, returns)
        self._rows.append(json.dumps({"seats": seating, "returns": returns.tolist()}))
        write(self._path, (f"{row}\n" for row in self._rows), force=True)
