"""Short ways to the end of a deterministic problem with a continuous state.

Breadth first from one state, keeping in each cell of a grid the first state that comes there: real
courses, so what is found can be done; a finer grid may find a shorter one.
"""

import numpy as np

from dmplay.chance import Array, Ints, Reals
from dmplay.core import Problem
from dmplay.tabular import joint_actions


def fewest_turns(
    problem: Problem, start: Reals, *, low: Reals, high: Reals, cells: tuple[int, ...]
) -> int | None:
    """How many turns a search over this grid needs from a state `[d]`; None where it finds no end.

    `low` and `high` `[d]` bound the states and `cells` divides the span of each number.
    """
    choices = joint_actions(problem)
    seen = np.zeros(int(np.prod(cells)), bool)
    frontier = start[None]
    turns = 0
    while len(frontier):
        if problem.terminal(frontier).any():
            return turns
        s = np.repeat(frontier, len(choices), axis=0)
        after = problem.step(s, np.tile(choices, (len(frontier), 1)), np.zeros((len(s), 0))).state
        cell = _cell(after, low, high, cells)
        fresh, first = np.unique(cell, return_index=True)
        new = ~seen[fresh]
        seen[fresh] = True
        frontier = after[first[new]]
        turns += 1
    return None


def _cell(s: Array, low: Reals, high: Reals, cells: tuple[int, ...]) -> Ints:
    """The cell `[B]` that each state is in."""
    many = np.array(cells)
    place = ((s - low) / (high - low) * many).astype(np.int64)
    return np.asarray(np.ravel_multi_index(tuple(np.minimum(place, many - 1).T), cells))
