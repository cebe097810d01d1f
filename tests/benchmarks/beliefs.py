"""Compute value bounds of POMDPs from the literature and of your own files.

Those of `tests.support.literature_pomdps` are created from their definitions; the environment
variable DMPLAY_CORPUS can name a folder with further `.pomdp` files.
"""

import os
from collections.abc import Iterator
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np

import dmplay
from dmplay.core.problem import Problem
from dmplay.errors import DmplayError
from dmplay.solvers.pomdp import point_based
from tests.support import literature_pomdps

RELATIVE_GAP = 0.001  # relative gap between the bounds at which the solver stops
SENSOR_HALF_DISTANCE = float(np.log(2))  # which makes the efficiency of a check exp(-distance)
ROCKS_4_4 = [(3, 1), (2, 1), (1, 3), (1, 0)]
ROCKS_5_7 = [(1, 0), (2, 1), (1, 2), (2, 2), (4, 2), (0, 3), (3, 4)]
HALLWAY_MAP = ("***********", "  * * * +  ")
HALLWAY_SIGNS = [((x, 0), 2) for x in (2, 4, 6, 8)]  # visible when facing south
HALLWAY2_MAP = (" ***** ", "** * **", " * * * ", "** * *+", " ***** ")
TIGER_GRID_MAP = ("-*+*-", "** **")
TIGER_GRID_STARTS = [((x, -1), 0) for x in (1, 3)]
GAPMIN_SOURCE = "Poupart, Kim and Kim, Closing the gap (2011)"
HSVI2_SOURCE = "Smith and Simmons, HSVI2 (2005)"
SARSOP_SOURCE = "Kurniawati, Hsu and Lee, SARSOP (2008)"


class PublishedValue(NamedTuple):
    """A published value and its source."""

    value: str
    source: str


UNPUBLISHED = PublishedValue("", "")
TIGER_VALUE = PublishedValue("19.3713683744", "pomdp-solve, exact")
PUBLISHED_VALUES = {  # by prefix of the file name
    "tiger.95": TIGER_VALUE,
    "tag": PublishedValue("-6.13", SARSOP_SOURCE),
    "4x3.95": PublishedValue("1.90", GAPMIN_SOURCE),
    "cheese": PublishedValue("3.48", GAPMIN_SOURCE),
    "tiger-grid": PublishedValue("2.30", HSVI2_SOURCE),
    "hallway2": PublishedValue("0.4", GAPMIN_SOURCE),
    "hallway": PublishedValue("1.0", GAPMIN_SOURCE),
    "rocksample_4_4": PublishedValue("18.0", HSVI2_SOURCE),
}


def report(runs: int) -> None:
    """Print a line for each problem."""
    for name, problem, published in _iter_problems():
        start_time = process_time()
        try:
            solution = point_based.solve_point_based(problem, None, RELATIVE_GAP)
            bounds = (
                f"lower bound {solution.lower_bound:.4f}, upper bound {solution.upper_bound:.4f}"
            )
        except DmplayError as error:
            bounds = str(error)
        reference = f"; published {published.value} ({published.source})" if published.value else ""
        size_and_time = f"{problem.state_count} states, {process_time() - start_time:.1f} s"
        print(f"- {name}, {size_and_time}: {bounds}{reference}", flush=True)


def _iter_problems() -> Iterator[tuple[str, Problem, PublishedValue]]:
    """Yield the problems from their definitions, then those of the folder."""
    yield "tiger", literature_pomdps.make_tiger(), TIGER_VALUE
    yield "4x3", literature_pomdps.make_four_by_three(), PUBLISHED_VALUES["4x3.95"]
    yield "cheese maze", literature_pomdps.make_cheese_maze(), PUBLISHED_VALUES["cheese"]
    yield (
        "tiger-grid",
        literature_pomdps.make_hallway(TIGER_GRID_MAP, start=TIGER_GRID_STARTS),
        PUBLISHED_VALUES["tiger-grid"],
    )
    yield (
        "hallway",
        literature_pomdps.make_hallway(HALLWAY_MAP, signs=HALLWAY_SIGNS),
        PUBLISHED_VALUES["hallway"],
    )
    yield "hallway2", literature_pomdps.make_hallway(HALLWAY2_MAP), PUBLISHED_VALUES["hallway2"]
    yield "tag", literature_pomdps.make_tag(), PUBLISHED_VALUES["tag"]
    yield (
        "rock sample [4,4]",
        literature_pomdps.make_rock_sample(4, ROCKS_4_4, (0, 2), SENSOR_HALF_DISTANCE),
        PUBLISHED_VALUES["rocksample_4_4"],
    )
    yield "rock sample [5,7]", literature_pomdps.make_rock_sample(5, ROCKS_5_7, (0, 2)), UNPUBLISHED
    yield "a machine of four parts", literature_pomdps.make_machine(), UNPUBLISHED
    folder = os.environ.get("DMPLAY_CORPUS", "")
    files = sorted(Path(folder).rglob("*")) if folder else []
    for file in files:
        if file.suffix.lower() == ".pomdp":
            yield from _read_problem_file(file)


def _read_problem_file(file: Path) -> Iterator[tuple[str, Problem, PublishedValue]]:
    """Yield the problem of a file if it is a POMDP with a discount below 1."""
    try:
        problem = dmplay.load_problem(str(file))
    except DmplayError:
        return
    if problem.partially_observable and problem.discount < 1.0:
        name = file.name.lower()
        matches = (
            published for prefix, published in PUBLISHED_VALUES.items() if name.startswith(prefix)
        )
        yield file.name, problem, next(matches, UNPUBLISHED)
