"""How close two bounds of hidden problems come: of the literature's, and of files of your own.

Those of `tests.support.hidden` are made from their definitions; a folder that DMPLAY_CORPUS names
adds its `.pomdp` files.
"""

import os
from collections.abc import Iterator
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np

import dmplay
from dmplay.core import Problem
from dmplay.errors import DmplayError
from dmplay.solvers import point_based
from tests.support import hidden

GAP = 0.001  # share of the value at which it is done
NEAR = float(np.log(2))  # so that a check is surer by a factor e where a rock is 1 nearer
FOUR = [(3, 1), (2, 1), (1, 3), (1, 0)]
FIVE = [(1, 0), (2, 1), (1, 2), (2, 2), (4, 2), (0, 3), (3, 4)]
HALLWAY = ("***********", "  * * * +  ")
SIGNS = [((x, 0), 2) for x in (2, 4, 6, 8)]  # who looks south there
HALLWAY2 = (" ***** ", "** * **", " * * * ", "** * *+", " ***** ")
TIGERS = ("-*+*-", "** **")
BEHIND = [((x, -1), 0) for x in (1, 3)]
GAPS = "Poupart, Kim and Kim, Closing the gap (2011)"
HSVI2 = "Smith and Simmons, HSVI2 (2005)"
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
    "tiger-grid": Published("2.30", HSVI2),
    "hallway2": Published("0.4", GAPS),
    "hallway": Published("1.0", GAPS),
    "rocksample_4_4": Published("18.0", HSVI2),
}


def report(runs: int) -> None:
    """Prints a line for each problem."""
    for name, problem, published in _problems():
        begun = process_time()
        try:
            found = point_based.solve_point_based(problem, None, GAP)
            bounds = f"lower bound {found.lower_bound:.4f}, upper bound {found.upper_bound:.4f}"
        except DmplayError as error:
            bounds = str(error)
        known = f"; published {published.value} ({published.source})" if published.value else ""
        spent = f"{problem.state_count} states, {process_time() - begun:.1f} s"
        print(f"- {name}, {spent}: {bounds}{known}", flush=True)


def _problems() -> Iterator[tuple[str, Problem, Published]]:
    """Those that are made, and those of the folder."""
    yield "tiger", hidden.tiger(), TIGER
    yield "4x3", hidden.four_by_three(), KNOWN["4x3.95"]
    yield "cheese maze", hidden.cheese(), KNOWN["cheese"]
    yield "tiger-grid", hidden.hallway(TIGERS, start=BEHIND), KNOWN["tiger-grid"]
    yield "hallway", hidden.hallway(HALLWAY, signs=SIGNS), KNOWN["hallway"]
    yield "hallway2", hidden.hallway(HALLWAY2), KNOWN["hallway2"]
    yield "tag", hidden.tag(), KNOWN["tag"]
    yield "rock sample [4,4]", hidden.rock_sample(4, FOUR, (0, 2), NEAR), KNOWN["rocksample_4_4"]
    yield "rock sample [5,7]", hidden.rock_sample(5, FIVE, (0, 2)), NONE
    yield "a machine of four parts", hidden.machine(), NONE
    folder = os.environ.get("DMPLAY_CORPUS", "")
    files = sorted(Path(folder).rglob("*")) if folder else []
    for file in files:
        if file.suffix.lower() == ".pomdp":
            yield from _read(file)


def _read(file: Path) -> Iterator[tuple[str, Problem, Published]]:
    """A file, if it holds a problem that has a value."""
    try:
        problem = dmplay.load_problem(str(file))
    except DmplayError:
        return
    if problem.partially_observable and problem.discount < 1.0:
        name = file.name.lower()
        known = (one for begins, one in KNOWN.items() if name.startswith(begins))
        yield file.name, problem, next(known, NONE)
