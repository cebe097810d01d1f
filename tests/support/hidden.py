"""Hidden problems of the literature, made from their definitions."""

from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import prod
from typing import TypeVar

import numpy as np

from dmplay.core import Labels
from dmplay.files.problem import FileProblem, MarkovModel
from dmplay.rows import SparseMatrix
from dmplay.tabular import SparseTables, Tables

S = TypeVar("S", bound=Hashable)
Shares = dict[S, float]
Cell = tuple[int, int]
Chase = tuple[Cell, Cell | None]  # the robot, and who flees unless tagged
Parts = tuple[int, ...]  # how worn each is
Pose = tuple[Cell, int]  # and the way it looks
Rover = tuple[Cell, tuple[bool, ...]] | None  # and which rocks are good, unless gone
NORTH, EAST, SOUTH, WEST = WAYS = ((0, 1), (1, 0), (0, -1), (-1, 0))
TURNS = {  # how likely a quarter, a half, three quarters of a turn to the right
    "stay": (1.0, 0.0, 0.0, 0.0),
    "right": (0.1, 0.7, 0.1, 0.1),
    "around": (0.1, 0.15, 0.6, 0.15),
    "left": (0.1, 0.1, 0.1, 0.7),
}
# Where a step goes and where it looks then, as turns to the right, and how likely.
SLIPS = ((0, 0, 0.8), (1, 1, 0.05), (3, 3, 0.05), (2, 0, 0.025), (2, 2, 0.025))


@dataclass(frozen=True)
class Listing(FileProblem):
    """One that cannot be told from others, as it holds a list."""

    notes: list[str] = field(default_factory=list, kw_only=True)


def made(  # noqa: PLR0913, PLR0917 - the six parts of a definition
    discount: float,
    start: Shares[S],
    actions: Sequence[str],
    move: Callable[[S, str], tuple[float, Shares[S]]],  # the reward, and where to
    observations: Sequence[str],
    sense: Callable[[str, S], Shares[str]],
) -> FileProblem:
    """The problem whose states are those that can be reached."""
    states = [*start]
    moves = []
    for state in states:
        for action in actions:
            moves.append(move(state, action))
            states += [one for one in moves[-1][1] if one not in states]
    place = {state: number for number, state in enumerate(states)}
    flow = [{place[one]: p for one, p in after.items()} for _, after in moves]
    seen = [
        {observations.index(one): p for one, p in sense(action, state).items()}
        for action, state in product(actions, states)
    ]
    rewards = np.array([[reward] for reward, _ in moves])
    belief = np.zeros(len(states))
    belief[[place[one] for one in start]] = [*start.values()]
    model = MarkovModel(
        ("agent",),
        (Labels(actions),),
        (Labels(observations),),
        tuple(map(str, states)),
        belief,
        SparseTables(_rows(flow), rewards, _rows(seen)),
        "",
    )
    return FileProblem(discount, model=model)


def _rows(each: Sequence[dict[int, float]]) -> SparseMatrix:
    """The rows of these columns and numbers."""
    kept = [sorted((column, p) for column, p in row.items() if p > 0) for row in each]
    starts = np.cumsum([0, *map(len, kept)])
    columns, values = zip(*(pair for row in kept for pair in row), strict=True)
    return SparseMatrix(starts, np.array(columns), np.array(values))


def uniform(states: Sequence[S]) -> Shares[S]:
    """Any of these, each as likely."""
    return dict.fromkeys(states, 1 / len(states))


def _summed(pairs: Iterable[tuple[S, float]]) -> Shares[S]:
    """Each of these once."""
    found: Shares[S] = {}
    for one, p in pairs:
        found[one] = found.get(one, 0.0) + p
    return found


def _stepped(cells: Sequence[Cell], cell: Cell, way: Cell) -> Cell:
    """A step, unless something is in the way."""
    there = cell[0] + way[0], cell[1] + way[1]
    return there if there in cells else cell


def tag() -> FileProblem:
    """Tag: find who flees, and tag it (Pineau, Gordon and Thrun, 2003)."""
    cells = [(x, y) for y in (0, 1) for x in range(10)]
    cells += [(x, y) for y in (2, 3, 4) for x in (5, 6, 7)]
    ways = dict(zip(("north", "east", "south", "west"), WAYS, strict=True))

    def flight(robot: Cell, other: Cell) -> Iterator[tuple[Cell, float]]:
        yield other, 0.2
        for axis, pair in enumerate(((WEST, EAST), (SOUTH, NORTH))):
            apart = other[axis] - robot[axis]
            for way in (pair[apart > 0],) if apart else pair:
                yield _stepped(cells, other, way), 0.4 if apart else 0.2

    def move(state: Chase, action: str) -> tuple[float, Shares[Chase]]:
        robot, other = state
        if other is None:
            return 0.0, {state: 1.0}
        if action == "tag" and robot == other:
            return 10.0, {(robot, None): 1.0}
        there = robot if action == "tag" else _stepped(cells, robot, ways[action])
        reward = -10.0 if action == "tag" else -1.0
        return reward, _summed(((there, one), p) for one, p in flight(robot, other))

    def sense(action: str, state: Chase) -> Shares[str]:
        robot, other = state
        return {"same" if robot == other else f"{robot[0]}-{robot[1]}": 1.0}

    seen = [*(f"{x}-{y}" for x, y in cells), "same"]
    start: Shares[Chase] = uniform([*product(cells, cells)])
    return made(0.95, start, [*ways, "tag"], move, seen, sense)


def rock_sample(size: int, rocks: Sequence[Cell], start: Cell, half: float = 20.0) -> FileProblem:
    """Rock sample: take the good rocks and leave by the east (Smith and Simmons, 2004).

    A check is half as sure where the rock is so far away.
    """
    cells = [(x, y) for x in range(size) for y in range(size)]
    ways = dict(zip(("north", "east", "south", "west"), WAYS, strict=True))
    checks = {f"check{number}": number for number in range(len(rocks))}

    def move(state: Rover, action: str) -> tuple[float, Shares[Rover]]:
        if state is None:
            return 0.0, {None: 1.0}
        cell, good = state
        if action in checks:
            return 0.0, {state: 1.0}
        if action in ways:
            there = _stepped(cells, cell, ways[action])
            out = there == cell
            east = out and action == "east"
            return -100.0 * out + 110.0 * east, {None if out else (there, good): 1.0}
        if cell not in rocks:
            return -100.0, {None: 1.0}
        rock = rocks.index(cell)
        left = (*good[:rock], False, *good[rock + 1 :])
        return (10.0 if good[rock] else -10.0), {(cell, left): 1.0}

    def sense(action: str, state: Rover) -> Shares[str]:
        if state is None or action not in checks:
            return {"none": 1.0}
        cell, good = state
        rock = rocks[checks[action]]
        far = float(np.hypot(cell[0] - rock[0], cell[1] - rock[1]))
        right = (1 + 2 ** (-far / half)) / 2
        told = "good" if good[checks[action]] else "bad"
        return {told: right, {"good": "bad", "bad": "good"}[told]: 1 - right}

    kinds = product((True, False), repeat=len(rocks))
    starts: Shares[Rover] = uniform([(start, good) for good in kinds])
    return made(0.95, starts, [*ways, "sample", *checks], move, ["none", "good", "bad"], sense)


def four_by_three(discount: float = 0.95) -> FileProblem:
    """The world of four by three (Russell and Norvig; Parr and Russell, 1995), begun anew."""
    cells = [(x, y) for y in range(3) for x in range(4) if (x, y) != (1, 1)]
    ends = {(3, 2): 1.0, (3, 1): -1.0}
    inner = [cell for cell in cells if cell not in ends]
    ways = dict(zip(("n", "e", "s", "w"), WAYS, strict=True))

    def move(cell: Cell, action: str) -> tuple[float, Shares[Cell]]:
        if cell in ends:
            return ends[cell], uniform(inner)
        turn = WAYS.index(ways[action])
        ahead = ((0, 0.8), (1, 0.1), (-1, 0.1))
        return -0.04, _summed((_stepped(cells, cell, WAYS[(turn + by) % 4]), p) for by, p in ahead)

    def sense(action: str, cell: Cell) -> Shares[str]:
        if cell in ends:
            return {"good" if ends[cell] > 0 else "bad": 1.0}
        left, right = (_stepped(cells, cell, way) == cell for way in (WEST, EAST))
        return {
            {(1, 0): "left", (0, 1): "right", (0, 0): "neither", (1, 1): "both"}[
                int(left), int(right)
            ]: 1.0
        }

    seen = ["left", "right", "neither", "both", "good", "bad"]
    return made(discount, uniform(inner), [*ways], move, seen, sense)


def cheese() -> FileProblem:
    """The cheese maze (McCallum, 1992): walls alone tell where one is."""
    cells = [(x, 2) for x in range(5)] + [(x, y) for y in (1, 0) for x in (0, 2, 4)]
    goal = (2, 0)
    inner = [cell for cell in cells if cell != goal]
    ways = dict(zip(("n", "e", "s", "w"), WAYS, strict=True))

    def move(cell: Cell, action: str) -> tuple[float, Shares[Cell]]:
        if cell == goal:
            return 0.0, uniform(inner)
        there = _stepped(cells, cell, ways[action])
        return float(there == goal), {there: 1.0}

    def sense(action: str, cell: Cell) -> Shares[str]:
        if cell == goal:
            return {"goal": 1.0}
        walls = [_stepped(cells, cell, way) == cell for way in WAYS]
        return {"".join(str(int(wall)) for wall in walls): 1.0}

    seen = sorted({str(one) for cell in cells for one in sense("n", cell)})
    return made(0.95, uniform(inner), [*ways], move, seen, sense)


def hallway(
    maze: Sequence[str], *, signs: Sequence[Pose] = (), start: Sequence[Pose] = ()
) -> FileProblem:
    """A robot that slips and sees walls badly (Littman, Cassandra and Kaelbling, 1995).

    The rows of a maze have a `*` where a cell is, `+` where a goal is and `-` a trap. A sign is
    seen by who stands and looks so; games begin anywhere unless it is said where.
    """
    marks = {(x, -y): mark for y, row in enumerate(maze) for x, mark in enumerate(row)}
    cells = [cell for cell, mark in marks.items() if mark != " "]
    starts = uniform(
        start or [(cell, way) for cell in cells for way in range(4) if marks[cell] != "+"]
    )
    worth = {"*": 0.0, "+": 1.0, "-": -1.0}

    def shift(pose: Pose, action: str) -> Iterator[tuple[Pose, float]]:
        cell, way = pose
        for turn, p in enumerate(TURNS.get(action, ())):
            yield (cell, (way + turn) % 4), p
        if action == "forward":
            yield pose, 0.05
            for side, turn, p in SLIPS:
                there = _stepped(cells, cell, WAYS[(way + side) % 4])
                yield ((there, (way + turn) % 4) if there != cell else pose), p

    def move(pose: Pose, action: str) -> tuple[float, Shares[Pose]]:
        after = starts if marks[pose[0]] == "+" else _summed(shift(pose, action))
        return sum(p * worth[marks[cell]] for (cell, _), p in after.items()), after

    def sense(action: str, pose: Pose) -> Shares[str]:
        cell, way = pose
        if marks[cell] == "+":
            return {"goal": 1.0}
        if pose in signs:
            return {f"sign{signs.index(pose)}": 1.0}
        likely = [
            0.9 if _stepped(cells, cell, WAYS[(way + turn) % 4]) == cell else 0.05
            for turn in range(4)
        ]
        return {
            "".join(map(str, walls)): prod(
                p if wall else 1 - p for wall, p in zip(walls, likely, strict=True)
            )
            for walls in product((0, 1), repeat=4)
        }

    seen = ["".join(map(str, walls)) for walls in product((0, 1), repeat=4)]
    seen += ["goal", *(f"sign{number}" for number in range(len(signs)))]
    return made(0.95, starts, [*TURNS, "forward"], move, seen, sense)


def machine() -> FileProblem:
    """Four parts that wear out in four steps, whose state shows in what is made: 256 states."""
    wear, worth = (0.1, 0.15, 0.2, 0.0), (1.0, 0.9, 0.6, 0.1)
    costs = {"run": (1.0, 0.0), "inspect": (0.8, 0.05), "repair": (0.0, 1.0), "replace": (0.0, 4.0)}

    def part(worn: int, action: str) -> Shares[int]:
        if action == "replace":
            return {0: 1.0}
        if action == "repair":
            return {max(worn - 1, 0): 0.9, worn: 0.1} if worn else {0: 1.0}
        p = wear[worn] * (1.0 if action == "run" else 0.3)
        return {worn: 1 - p, min(worn + 1, 3): p} if worn < 3 else {3: 1.0}

    def move(parts: Parts, action: str) -> tuple[float, Shares[Parts]]:
        share, cost = costs[action]
        each = [part(one, action).items() for one in parts]
        after: Shares[Parts] = {
            tuple(one for one, _ in drawn): prod(p for _, p in drawn) for drawn in product(*each)
        }
        return share * prod(worth[one] for one in parts) - cost, after

    def sense(action: str, parts: Parts) -> Shares[str]:
        right = {"run": 0.6, "inspect": 0.95}.get(action, 0.5)
        bad = [right * one / 3 + (1 - right) * (1 - one / 3) for one in parts]
        return {
            "".join(map(str, shown)): prod(
                p if one else 1 - p for one, p in zip(shown, bad, strict=True)
            )
            for shown in product((0, 1), repeat=4)
        }

    seen = ["".join(map(str, shown)) for shown in product((0, 1), repeat=4)]
    start: Shares[Parts] = {(0, 0, 0, 0): 1.0}
    return made(0.97, start, [*costs], move, seen, sense)


def tiger(discount: float = 0.95) -> FileProblem:
    """The tiger (Kaelbling, Littman and Cassandra, 1998)."""

    def move(state: str, action: str) -> tuple[float, Shares[str]]:
        if action == "listen":
            return -1.0, {state: 1.0}
        return (-100.0 if action == state else 10.0), uniform(["left", "right"])

    def sense(action: str, state: str) -> Shares[str]:
        if action != "listen":
            return uniform(["left", "right"])
        return {one: 0.85 if one == state else 0.15 for one in ("left", "right")}

    sides = ["left", "right"]
    return made(discount, uniform(sides), ["listen", *sides], move, sides, sense)


def drawn(seed: int, discount: float) -> FileProblem:
    """A small problem drawn at random: two actions, two observations, two to five states."""
    random = np.random.default_rng(seed)
    states = int(random.integers(2, 6))
    tables = Tables(
        random.dirichlet(np.full(states, 0.5), (states, 2)),
        np.round(random.normal(size=(states, 2, 1)), 1),
        random.dirichlet(np.ones(2), (2, states)),
    )
    names = tuple(map(str, range(states)))
    two = (Labels(("a", "b")),)
    seen = (Labels(("x", "y")),)
    start = random.dirichlet(np.ones(states))
    model = MarkovModel(("agent",), two, seen, names, start, tables.sparse_tables, "")
    return FileProblem(discount, model=model)
