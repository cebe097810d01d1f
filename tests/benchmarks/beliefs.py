"""How close two bounds of hidden problems come: of the literature's, and of files of your own.

Those of `tests.support.hidden` are made from their definitions; a folder that DMPLAY_CORPUS names
adds its `.pomdp` files.
"""

import os
from collections.abc import Iterator
from pathlib import Path
from time import process_time
from typing import NamedTuple

import dmplay
from dmplay.core import Problem
from dmplay.errors import DmplayError
from dmplay.solvers import point_based
from tests.support import hidden

GAP = 0.001  # share of the value at which it is done
FOUR = [(3, 1), (2, 1), (1, 3), (1, 0)]
FIVE = [(1, 0), (2, 1), (1, 2), (2, 2), (4, 2), (0, 3), (3, 4)]
LONG = [*((x, 0) for x in range(11)), (2, 1), (4, 1), (6, 1), (8, 1)]
WIDE = [
    *((x, y) for x in (0, 4) for y in range(5)),
    *((x, y) for x in (1, 2, 3) for y in (0, 2, 4)),
    *((2, 1), (2, 3), (5, 2), (6, 2)),
]
GAPS = "Poupart, Kim and Kim, Closing the gap (2011)"
SARSOP = "Kurniawati, Hsu and Lee, SARSOP (2008)"


class Published(NamedTuple):
    """A value in print."""

    value: str
    source: str


NONE = Published("", "")
TIGER = Published("19.3713683744", "pomdp-solve, exact")
KNOWN = {  # by the beginnings of the names of files
    "tiger.95": TIGER,
    "tag": Published("-6.13", SARSOP),
    "4x3.95": Published("1.90", GAPS),
    "cheese": Published("3.48", GAPS),
    "hallway2": Published("0.4", GAPS),
    "hallway": Published("1.0", GAPS),
    "rocksample_4_4": Published("18.04", "Smith and Simmons, HSVI2 (2005)"),
}


def report(runs: int) -> None:
    """Prints a line for each problem."""
    for name, problem, published in _problems():
        begun = process_time()
        try:
            found = point_based.solved(problem, None, GAP)
            bounds = f"lower bound {found.at_least:.4f}, upper bound {found.at_most:.4f}"
        except DmplayError as error:
            bounds = str(error)
        known = f"; published {published.value} ({published.source})" if published.value else ""
        spent = f"{problem.states} states, {process_time() - begun:.1f} s"
        print(f"- {name}, {spent}: {bounds}{known}", flush=True)


def _problems() -> Iterator[tuple[str, Problem, Published]]:
    """Those that are made, and those of the folder."""
    yield "tiger", hidden.tiger(), TIGER
    yield "4x3", hidden.four_by_three(), KNOWN["4x3.95"]
    yield "cheese maze", hidden.cheese(), KNOWN["cheese"]
    yield "a hallway of 15 cells", hidden.hallway(LONG, (8, 1)), NONE
    yield "a hallway of 23 cells", hidden.hallway(WIDE, (6, 2)), NONE
    yield "tag", hidden.tag(), KNOWN["tag"]
    yield "rock sample [4,4], a map", hidden.rock_sample(4, FOUR, (0, 2)), NONE
    yield "rock sample [5,7], a map", hidden.rock_sample(5, FIVE, (0, 2)), NONE
    yield "a machine of four parts", hidden.machine(), NONE
    folder = os.environ.get("DMPLAY_CORPUS", "")
    files = sorted(Path(folder).rglob("*")) if folder else []
    for file in files:
        if file.suffix.lower() == ".pomdp":
            yield from _read(file)


def _read(file: Path) -> Iterator[tuple[str, Problem, Published]]:
    """A file, if it holds a problem that has a value."""
    try:
        problem = dmplay.load(str(file))
    except DmplayError:
        return
    if problem.hidden and problem.discount < 1.0:
        name = file.name.lower()
        known = (one for begins, one in KNOWN.items() if name.startswith(begins))
        yield file.name, problem, next(known, NONE)
