"""Slide the tiles of a 4x4 board and merge equal ones; each slide adds a new 2 or 4.

Source: appendix F.2; 2048.jl. Decisions: A new tile is a 2 with probability 0.8, as in the package
(0.9 in the original game: `--set p_two=0.9`). A merge pays the value of the merged tile; nothing
else pays. A slide that moves no tile is not a legal action: it adds no tile and pays nothing. Two
tiles of 32768 merge to 65536. The game continues after 2048.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.chance import Categorical, Chance, DiscreteUniform
from dmplay.core.parameters import parameter
from dmplay.core.problem import AfterstateModel, Outcome, Problem
from dmplay.core.spaces import Labels

from . import afterstates, packed_boards
from .packed_boards import Cells

EMPTY_CELL = "."
LEGAL_SLIDE_MASKS = np.array([[[slides >> a & 1 for a in range(4)]] for slides in range(16)], bool)


def slide_and_score(board: Cells, a: Ints) -> tuple[Cells, Reals]:
    """Return the boards after slides `a` `[B]`, before a new tile appears, and the scores `[B]`."""
    result = packed_boards.slide_boards(board, a)
    return result.cells_with_tiles(result.after & 0), result.scores.astype(float)


@dataclass(frozen=True)
class Game2048(Problem):
    """Merging tiles on a 4x4 board, as long as a slide moves anything."""

    p_two: float = parameter(0.8, "probability that a new tile is a 2, else a 4", 0.0, 1.0)

    can_run_forever = False  # tiles only grow and the board is small, so every game ends
    actions = (Labels(("left", "down", "right", "up")),)
    state_count = math.inf
    illegal_reason = "moves no tile"

    @cached_property
    def _tile_chance(self) -> Chance:
        """The distribution of a new tile: 2 or 4."""
        return Categorical(np.array([[self.p_two]]))

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Return the distributions of two different cells and of their tiles."""
        first, second = (DiscreteUniform(np.full(rows, n), n) for n in (16, 15))
        return (first, second, self._tile_chance, self._tile_chance)

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """Return boards with two tiles; the second cell is counted without the first."""
        first_cell, second_cell, first_tile, second_tile = events
        board = np.zeros((rows, 16), np.uint8)
        row = np.arange(rows)
        board[row, first_cell] = first_tile + 1
        board[row, second_cell + (second_cell >= first_cell)] = second_tile + 1
        return board.reshape(rows, 4, 4)

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Return the distributions of the new tile's cell, an empty one, and of its value."""
        empty_counts = packed_boards.count_empty_after_slide(s, a.ravel())
        return DiscreteUniform(empty_counts, 16), self._tile_chance

    def resolve_events(self, s: Array, a: Array, events: Sequence[Array]) -> Outcome:
        """Return the outcome of a slide, with the new tile if anything moved."""
        result = packed_boards.slide_boards(s, a.ravel())
        cell, tile = (event.astype(np.uint64) for event in events)
        empty_cells = packed_boards.compute_empty_cell_bits(result.after)
        new_tile = packed_boards.select_nth_bit(empty_cells, cell) * (tile + 1)
        next_boards = result.cells_with_tiles(new_tile * (result.after != result.before))
        return Outcome(next_boards, result.scores.astype(float)[:, None], next_boards)

    afterstates = AfterstateModel(
        afterstates.TABLE_COUNT * afterstates.ENTRIES_PER_TABLE, afterstates.list_afterstates
    )

    def legal_actions_mask(self, s: Array) -> Bools:
        """Return a mask of the slides that move something."""
        return LEGAL_SLIDE_MASKS.take(packed_boards.compute_legal_slide_bits(s), axis=0)

    def terminal(self, s: Array) -> Bools:
        """Return whether no slide moves anything."""
        return packed_boards.mark_stuck_boards(s)

    def format_state(self, s: Array) -> str:
        """Return a board as rows of tile values, `.` for an empty cell: `2 4 . ./. . . ./...`."""
        return "/".join(" ".join(str(2 ** int(e)) if e else EMPTY_CELL for e in row) for row in s)

    def parse_state(self, text: str) -> Array:
        """Return the board that `format_state` wrote."""
        tile_texts = [row.replace(EMPTY_CELL, "1").split() for row in text.split("/")]
        return np.array(
            [[int(tile).bit_length() - 1 for tile in row] for row in tile_texts], np.uint8
        )
