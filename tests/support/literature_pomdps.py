"""Partially observable problems of the literature, built from their definitions."""

from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import prod
from typing import TypeVar

import numpy as np

from dmplay.core.spaces import Labels
from dmplay.core.sparse_matrix import SparseMatrix
from dmplay.core.tabular import SparseTables, Tables
from dmplay.formats.file_problems import FileProblem, MarkovModel

S = TypeVar("S", bound=Hashable)
Distribution = dict[S, float]
Cell = tuple[int, int]
TagState = tuple[Cell, Cell | None]  # robot, and opponent unless tagged
WearLevels = tuple[int, ...]  # wear level of each part
Pose = tuple[Cell, int]  # cell and direction
# cell, and whether each rock is good; None after leaving
RockSampleState = tuple[Cell, tuple[bool, ...]] | None
NORTH_STEP, EAST_STEP, SOUTH_STEP, WEST_STEP = STEPS = ((0, 1), (1, 0), (0, -1), (-1, 0))
TURN_PROBABILITIES = {  # probabilities of 0, 1, 2 and 3 quarter turns to the right
    "stay": (1.0, 0.0, 0.0, 0.0),
    "right": (0.1, 0.7, 0.1, 0.1),
    "around": (0.1, 0.15, 0.6, 0.15),
    "left": (0.1, 0.1, 0.1, 0.7),
}
# Quarter turns to the right of the step, of the new direction, and the probability.
FORWARD_SLIPS = ((0, 0, 0.8), (1, 1, 0.05), (3, 3, 0.05), (2, 0, 0.025), (2, 2, 0.025))


@dataclass(frozen=True)
class UnhashableProblem(FileProblem):
    """A problem that cannot be hashed because it holds a list."""

    notes: list[str] = field(default_factory=list, kw_only=True)


def build_problem(  # noqa: PLR0913, PLR0917 - the six parts of a definition
    discount: float,
    start: Distribution[S],
    actions: Sequence[str],
    # the reward and the distribution of the next state
    move: Callable[[S, str], tuple[float, Distribution[S]]],
    observations: Sequence[str],
    sense: Callable[[str, S], Distribution[str]],
) -> FileProblem:
    """Build the problem whose states are those reachable from the start."""
    states = [*start]
    results = []
    for state in states:
        for action in actions:
            results.append(move(state, action))
            states += [outcome for outcome in results[-1][1] if outcome not in states]
    state_index = {state: number for number, state in enumerate(states)}
    transition_rows = [
        {state_index[outcome]: p for outcome, p in after.items()} for _, after in results
    ]
    observation_rows = [
        {observations.index(outcome): p for outcome, p in sense(action, state).items()}
        for action, state in product(actions, states)
    ]
    rewards = np.array([[reward] for reward, _ in results])
    belief = np.zeros(len(states))
    belief[[state_index[outcome] for outcome in start]] = [*start.values()]
    model = MarkovModel(
        ("agent",),
        (Labels(actions),),
        (Labels(observations),),
        tuple(map(str, states)),
        belief,
        SparseTables(
            _build_sparse_matrix(transition_rows), rewards, _build_sparse_matrix(observation_rows)
        ),
        "",
    )
    return FileProblem(discount, model=model)


def _build_sparse_matrix(entries: Sequence[dict[int, float]]) -> SparseMatrix:
    """Build a sparse matrix from rows of column indices and values, without the zeros."""
    nonzero = [sorted((column, p) for column, p in row.items() if p > 0) for row in entries]
    starts = np.cumsum([0, *map(len, nonzero)])
    columns, values = zip(*(pair for row in nonzero for pair in row), strict=True)
    return SparseMatrix(starts, np.array(columns), np.array(values))


def make_uniform(states: Sequence[S]) -> Distribution[S]:
    """Return the uniform distribution over these states."""
    return dict.fromkeys(states, 1 / len(states))


def _sum_by_state(pairs: Iterable[tuple[S, float]]) -> Distribution[S]:
    """Sum the probabilities of equal states."""
    distribution: Distribution[S] = {}
    for state, p in pairs:
        distribution[state] = distribution.get(state, 0.0) + p
    return distribution


def _step_or_stay(cells: Sequence[Cell], cell: Cell, step: Cell) -> Cell:
    """Return the cell after a step, or the same cell if it is blocked."""
    target = cell[0] + step[0], cell[1] + step[1]
    return target if target in cells else cell


def make_tag() -> FileProblem:
    """Build Tag: find the fleeing opponent and tag it (Pineau, Gordon and Thrun, 2003)."""
    cells = [(x, y) for y in (0, 1) for x in range(10)]
    cells += [(x, y) for y in (2, 3, 4) for x in (5, 6, 7)]
    steps = dict(zip(("north", "east", "south", "west"), STEPS, strict=True))

    def flight(robot: Cell, other: Cell) -> Iterator[tuple[Cell, float]]:
        yield other, 0.2
        for axis, pair in enumerate(((WEST_STEP, EAST_STEP), (SOUTH_STEP, NORTH_STEP))):
            distance = other[axis] - robot[axis]
            for step in (pair[distance > 0],) if distance else pair:
                yield _step_or_stay(cells, other, step), 0.4 if distance else 0.2

    def move(state: TagState, action: str) -> tuple[float, Distribution[TagState]]:
        robot, other = state
        if other is None:
            return 0.0, {state: 1.0}
        if action == "tag" and robot == other:
            return 10.0, {(robot, None): 1.0}
        target = robot if action == "tag" else _step_or_stay(cells, robot, steps[action])
        reward = -10.0 if action == "tag" else -1.0
        return reward, _sum_by_state(((target, cell), p) for cell, p in flight(robot, other))

    def sense(action: str, state: TagState) -> Distribution[str]:
        robot, other = state
        return {"same" if robot == other else f"{robot[0]}-{robot[1]}": 1.0}

    observations = [*(f"{x}-{y}" for x, y in cells), "same"]
    start: Distribution[TagState] = make_uniform([*product(cells, cells)])
    return build_problem(0.95, start, [*steps, "tag"], move, observations, sense)


def make_rock_sample(
    size: int, rocks: Sequence[Cell], start: Cell, half_efficiency_distance: float = 20.0
) -> FileProblem:
    """Build RockSample: take the good rocks and leave to the east (Smith and Simmons, 2004).

    At `half_efficiency_distance` a check is half as informative as on the rock.
    """
    cells = [(x, y) for x in range(size) for y in range(size)]
    steps = dict(zip(("north", "east", "south", "west"), STEPS, strict=True))
    checks = {f"check{number}": number for number in range(len(rocks))}

    def move(state: RockSampleState, action: str) -> tuple[float, Distribution[RockSampleState]]:
        if state is None:
            return 0.0, {None: 1.0}
        cell, good = state
        if action in checks:
            return 0.0, {state: 1.0}
        if action in steps:
            target = _step_or_stay(cells, cell, steps[action])
            blocked = target == cell
            leaves = blocked and action == "east"
            return -100.0 * blocked + 110.0 * leaves, {None if blocked else (target, good): 1.0}
        if cell not in rocks:
            return -100.0, {None: 1.0}
        rock = rocks.index(cell)
        remaining = (*good[:rock], False, *good[rock + 1 :])
        return (10.0 if good[rock] else -10.0), {(cell, remaining): 1.0}

    def sense(action: str, state: RockSampleState) -> Distribution[str]:
        if state is None or action not in checks:
            return {"none": 1.0}
        cell, good = state
        rock = rocks[checks[action]]
        distance = float(np.hypot(cell[0] - rock[0], cell[1] - rock[1]))
        p_correct = (1 + 2 ** (-distance / half_efficiency_distance)) / 2
        reading = "good" if good[checks[action]] else "bad"
        return {reading: p_correct, {"good": "bad", "bad": "good"}[reading]: 1 - p_correct}

    kinds = product((True, False), repeat=len(rocks))
    starts: Distribution[RockSampleState] = make_uniform([(start, good) for good in kinds])
    return build_problem(
        0.95, starts, [*steps, "sample", *checks], move, ["none", "good", "bad"], sense
    )


def make_four_by_three(discount: float = 0.95) -> FileProblem:
    """Build the 4 x 3 world (Parr and Russell, 1995), which restarts after a terminal cell."""
    cells = [(x, y) for y in range(3) for x in range(4) if (x, y) != (1, 1)]
    ends = {(3, 2): 1.0, (3, 1): -1.0}
    inner = [cell for cell in cells if cell not in ends]
    steps = dict(zip(("n", "e", "s", "w"), STEPS, strict=True))

    def move(cell: Cell, action: str) -> tuple[float, Distribution[Cell]]:
        if cell in ends:
            return ends[cell], make_uniform(inner)
        direction = STEPS.index(steps[action])
        slips = ((0, 0.8), (1, 0.1), (-1, 0.1))
        return -0.04, _sum_by_state(
            (_step_or_stay(cells, cell, STEPS[(direction + quarter_turns) % 4]), p)
            for quarter_turns, p in slips
        )

    def sense(action: str, cell: Cell) -> Distribution[str]:
        if cell in ends:
            return {"good" if ends[cell] > 0 else "bad": 1.0}
        left, right = (_step_or_stay(cells, cell, step) == cell for step in (WEST_STEP, EAST_STEP))
        return {
            {(1, 0): "left", (0, 1): "right", (0, 0): "neither", (1, 1): "both"}[
                int(left), int(right)
            ]: 1.0
        }

    observations = ["left", "right", "neither", "both", "good", "bad"]
    return build_problem(discount, make_uniform(inner), [*steps], move, observations, sense)


def make_cheese_maze() -> FileProblem:
    """Build the cheese maze (McCallum, 1992): the agent observes only the walls around it."""
    cells = [(x, 2) for x in range(5)] + [(x, y) for y in (1, 0) for x in (0, 2, 4)]
    goal = (2, 0)
    inner = [cell for cell in cells if cell != goal]
    steps = dict(zip(("n", "e", "s", "w"), STEPS, strict=True))

    def move(cell: Cell, action: str) -> tuple[float, Distribution[Cell]]:
        if cell == goal:
            return 0.0, make_uniform(inner)
        target = _step_or_stay(cells, cell, steps[action])
        return float(target == goal), {target: 1.0}

    def sense(action: str, cell: Cell) -> Distribution[str]:
        if cell == goal:
            return {"goal": 1.0}
        walls = [_step_or_stay(cells, cell, step) == cell for step in STEPS]
        return {"".join(str(int(wall)) for wall in walls): 1.0}

    observations = sorted({str(observation) for cell in cells for observation in sense("n", cell)})
    return build_problem(0.95, make_uniform(inner), [*steps], move, observations, sense)


def make_hallway(
    maze: Sequence[str], *, signs: Sequence[Pose] = (), start: Sequence[Pose] = ()
) -> FileProblem:
    """Build a maze with a robot that slips and senses walls badly (Littman et al., 1995).

    The rows of a maze have `*` for a cell, `+` for a goal and `-` for a trap. A sign is observed in
    its pose; games start in any pose that is not at a goal unless `start` lists the poses.
    """
    marks = {(x, -y): mark for y, row in enumerate(maze) for x, mark in enumerate(row)}
    cells = [cell for cell, mark in marks.items() if mark != " "]
    starts = make_uniform(
        start
        or [(cell, direction) for cell in cells for direction in range(4) if marks[cell] != "+"]
    )
    rewards = {"*": 0.0, "+": 1.0, "-": -1.0}

    def shift(pose: Pose, action: str) -> Iterator[tuple[Pose, float]]:
        cell, direction = pose
        for quarter_turns, p in enumerate(TURN_PROBABILITIES.get(action, ())):
            yield (cell, (direction + quarter_turns) % 4), p
        if action == "forward":
            yield pose, 0.05
            for step_turns, quarter_turns, p in FORWARD_SLIPS:
                target = _step_or_stay(cells, cell, STEPS[(direction + step_turns) % 4])
                yield ((target, (direction + quarter_turns) % 4) if target != cell else pose), p

    def move(pose: Pose, action: str) -> tuple[float, Distribution[Pose]]:
        after = starts if marks[pose[0]] == "+" else _sum_by_state(shift(pose, action))
        return sum(p * rewards[marks[cell]] for (cell, _), p in after.items()), after

    def sense(action: str, pose: Pose) -> Distribution[str]:
        cell, direction = pose
        if marks[cell] == "+":
            return {"goal": 1.0}
        if pose in signs:
            return {f"sign{signs.index(pose)}": 1.0}
        wall_probabilities = [
            0.9
            if _step_or_stay(cells, cell, STEPS[(direction + quarter_turns) % 4]) == cell
            else 0.05
            for quarter_turns in range(4)
        ]
        return {
            "".join(map(str, walls)): prod(
                p if wall else 1 - p for wall, p in zip(walls, wall_probabilities, strict=True)
            )
            for walls in product((0, 1), repeat=4)
        }

    observations = ["".join(map(str, walls)) for walls in product((0, 1), repeat=4)]
    observations += ["goal", *(f"sign{number}" for number in range(len(signs)))]
    return build_problem(0.95, starts, [*TURN_PROBABILITIES, "forward"], move, observations, sense)


def make_machine() -> FileProblem:
    """Build a machine of four parts with four wear levels, observed in its product: 256 states."""
    wear, quality = (0.1, 0.15, 0.2, 0.0), (1.0, 0.9, 0.6, 0.1)
    costs = {"run": (1.0, 0.0), "inspect": (0.8, 0.05), "repair": (0.0, 1.0), "replace": (0.0, 4.0)}

    def part(level: int, action: str) -> Distribution[int]:
        if action == "replace":
            return {0: 1.0}
        if action == "repair":
            return {max(level - 1, 0): 0.9, level: 0.1} if level else {0: 1.0}
        p = wear[level] * (1.0 if action == "run" else 0.3)
        return {level: 1 - p, min(level + 1, 3): p} if level < 3 else {3: 1.0}

    def move(parts: WearLevels, action: str) -> tuple[float, Distribution[WearLevels]]:
        output, cost = costs[action]
        part_distributions = [part(level, action).items() for level in parts]
        after: Distribution[WearLevels] = {
            tuple(level for level, _ in combination): prod(p for _, p in combination)
            for combination in product(*part_distributions)
        }
        return output * prod(quality[level] for level in parts) - cost, after

    def sense(action: str, parts: WearLevels) -> Distribution[str]:
        p_correct = {"run": 0.6, "inspect": 0.95}.get(action, 0.5)
        p_defect = [p_correct * value / 3 + (1 - p_correct) * (1 - value / 3) for value in parts]
        return {
            "".join(map(str, signals)): prod(
                p if value else 1 - p for value, p in zip(signals, p_defect, strict=True)
            )
            for signals in product((0, 1), repeat=4)
        }

    observations = ["".join(map(str, signals)) for signals in product((0, 1), repeat=4)]
    start: Distribution[WearLevels] = {(0, 0, 0, 0): 1.0}
    return build_problem(0.97, start, [*costs], move, observations, sense)


def make_tiger(discount: float = 0.95) -> FileProblem:
    """Build the tiger problem (Kaelbling, Littman and Cassandra, 1998)."""

    def move(state: str, action: str) -> tuple[float, Distribution[str]]:
        if action == "listen":
            return -1.0, {state: 1.0}
        return (-100.0 if action == state else 10.0), make_uniform(["left", "right"])

    def sense(action: str, state: str) -> Distribution[str]:
        if action != "listen":
            return make_uniform(["left", "right"])
        return {side: 0.85 if side == state else 0.15 for side in ("left", "right")}

    sides = ["left", "right"]
    return build_problem(discount, make_uniform(sides), ["listen", *sides], move, sides, sense)


def make_random_problem(seed: int, discount: float) -> FileProblem:
    """Build a small random problem with two actions, two observations and two to five states."""
    generator = np.random.default_rng(seed)
    states = int(generator.integers(2, 6))
    tables = Tables(
        generator.dirichlet(np.full(states, 0.5), (states, 2)),
        np.round(generator.normal(size=(states, 2, 1)), 1),
        generator.dirichlet(np.ones(2), (2, states)),
    )
    names = tuple(map(str, range(states)))
    actions = (Labels(("a", "b")),)
    observations = (Labels(("x", "y")),)
    start = generator.dirichlet(np.ones(states))
    model = MarkovModel(("agent",), actions, observations, names, start, tables.sparse_tables, "")
    return FileProblem(discount, model=model)
