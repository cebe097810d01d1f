"""Short paths to a terminal state of a deterministic problem with continuous states.

A breadth-first search keeps the first state that reaches each cell of a grid. Its paths are real,
so the result is an upper bound; a finer grid may find a shorter path.
"""

import numpy as np

from dmplay.core.arrays import Array, Ints, Reals
from dmplay.core.problem import Problem
from dmplay.core.tabular import joint_actions


def fewest_turns(
    problem: Problem, start: Reals, *, low: Reals, high: Reals, cells: tuple[int, ...]
) -> int | None:
    """Return the number of turns of the shortest path found from a state `[d]`, or None.

    `low` and `high` `[d]` bound the states; `cells` is the number of cells in each dimension.
    """
    choices = joint_actions(problem)
    visited = np.zeros(int(np.prod(cells)), bool)
    frontier = start[None]
    turns = 0
    while len(frontier):
        if problem.terminal(frontier).any():
            return turns
        s = np.repeat(frontier, len(choices), axis=0)
        after = problem.step(s, np.tile(choices, (len(frontier), 1)), np.zeros((len(s), 0))).state
        cell = _cell(after, low, high, cells)
        reached_cells, first_rows = np.unique(cell, return_index=True)
        is_new = ~visited[reached_cells]
        visited[reached_cells] = True
        frontier = after[first_rows[is_new]]
        turns += 1
    return None


def _cell(s: Array, low: Reals, high: Reals, cells: tuple[int, ...]) -> Ints:
    """Return the index of the cell of each state `[B]`."""
    cell_counts = np.array(cells)
    coordinates = ((s - low) / (high - low) * cell_counts).astype(np.int64)
    return np.asarray(
        np.ravel_multi_index(tuple(np.minimum(coordinates, cell_counts - 1).T), cells)
    )
