"""Figures F.3 to F.5 of the book: a start of 2048, and two slides."""

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from dmplay.core.arrays import Array
from dmplay.core.uniforms import NATURE_STREAM, generate_uniforms
from dmplay.draw.panels import BoardPanel, Plot, PlottedTile
from dmplay.game.plot_kinds import Figure
from dmplay.plots.plotted_problem import FIGURE_SEED, PlottedProblem, sample_start

from .rules import Game2048, slide_and_score
from .view import get_tile_style, iter_sliding_tiles

Cell = tuple[int, int]  # row and column

ACTION = "down"  # with FIGURE_SEED, no tiles of the start merge in this slide
MERGE_BOARD = ". . . 2/4 . . ./. . . ./4 2 . ."  # the example in figure F.5


def _draw_start(subject: PlottedProblem) -> Plot:
    """Return figure F.3: a random starting state of 2048."""
    board = sample_start(subject.problem)
    panel = BoardPanel("", len(board), _list_tiles(board))
    return Plot(f"{subject.title}: a random starting state (seed {FIGURE_SEED})", [panel])


def _draw_merge(subject: PlottedProblem) -> Plot:
    """Return figure F.5: a slide that merges two tiles."""
    board = subject.problem.parse_state(MERGE_BOARD)
    return _plot_slide(subject, board, f"a slide {ACTION} that merges two tiles")


def _plot_slide(subject: PlottedProblem, board: Array, what: str) -> Plot:
    """Return a board before a slide, after it, and with the new tile."""
    problem = subject.problem
    assert isinstance(problem, Game2048)
    action = int(problem.parse_action(0, ACTION))
    s, a = board[None], np.array([[action]])
    u = generate_uniforms(FIGURE_SEED, NATURE_STREAM, 1, rows=1, count=problem.uniform_counts.step)
    outcome = problem.step(s, a, u)
    (slid,), _ = slide_and_score(s, a[:, 0])
    (after,), reward = outcome.state, float(outcome.rewards[0, 0])
    ends = _find_slide_ends(board, action)
    merged = [end for end, count in Counter(ends.values()).items() if count > 1]
    panels = [
        BoardPanel("before", len(board), _list_tiles(board, ends=ends)),
        BoardPanel(f"reward {reward:g}", len(board), _list_tiles(slid, marked=merged)),
        BoardPanel("new tile", len(board), _list_tiles(after, marked=_list_marked(after != slid))),
    ]
    notes = [
        "marked: the merged tile, and the new tile" if merged else "marked: the new tile",
        f"the new tile is in a random cell, and a 2 with probability {problem.p_two:g}, else a 4",
    ]
    return Plot(f"{subject.title}: {what}", panels, columns=3, notes=notes)


def _find_slide_ends(board: Array, action: int) -> dict[Cell, Cell]:
    """Return the cell to which the tile of each cell slides."""
    starts, ends = (
        [(round(tile.row), round(tile.column)) for tile in iter_sliding_tiles(board, action, share)]
        for share in (0.0, 1.0)
    )
    return dict(zip(starts, ends, strict=True))


def _list_marked(mask: Array) -> list[Cell]:
    """Return the rows and columns of the marked cells."""
    return [(row, column) for row, column in np.argwhere(mask).tolist()]


def _list_tiles(
    board: Array, *, ends: Mapping[Cell, Cell] | None = None, marked: Sequence[Cell] = ()
) -> list[PlottedTile]:
    """Return the tiles of a board `[4, 4]` of exponents, with the cells that they slide to."""
    return [
        PlottedTile(
            *cell,
            2 ** int(board[cell]),
            get_tile_style(int(board[cell])),
            end=ends[cell] if ends and ends[cell] != cell else None,
            is_marked=cell in marked,
        )
        for cell in _list_marked(board > 0)
    ]


FIGURES = {
    "F.3": Figure("a random starting state of 2048", _draw_start),
    "F.4": Figure(
        "a slide in 2048, and its new tile",
        lambda subject: _plot_slide(subject, sample_start(subject.problem), f"a slide {ACTION}"),
    ),
    "F.5": Figure("a slide in 2048 that merges two tiles, with its reward", _draw_merge),
}
