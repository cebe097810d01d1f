"""Tests of tile boards: slides compared with a literal implementation of the rules."""

import numpy as np
import pytest

from dmplay.core.arrays import Array
from dmplay.problems.game_2048 import packed_boards
from dmplay.problems.game_2048.rules import Game2048, slide_and_score

GAME = Game2048()


def slide_line(line: list[int]) -> tuple[list[int], int]:
    """Slide a line to its first cell, merging each tile once; return the line and the score."""
    cells: list[int] = []
    score = 0
    can_merge = False  # whether the last tile may still merge
    for tile in filter(None, line):
        if can_merge and cells[-1] == tile:
            cells[-1] += 1
            score += 2 ** cells[-1]
            can_merge = False
        else:
            cells.append(tile)
            can_merge = True
    return cells + [0] * (4 - len(cells)), score


def slide_board(board: Array, a: int) -> tuple[list[list[int]], int]:
    """Slide a board line by line; return the board and the score."""
    lines = board.T if a in (packed_boards.UP, packed_boards.DOWN) else board
    step = -1 if a in (packed_boards.DOWN, packed_boards.RIGHT) else 1
    slid_lines = [slide_line(line[::step].tolist()) for line in lines]
    result = np.array([line[::step] for line, _ in slid_lines])
    return (result.T if a in (packed_boards.UP, packed_boards.DOWN) else result).tolist(), sum(
        p for _, p in slid_lines
    )


@pytest.fixture(scope="module")
def boards() -> Array:
    """Boards with few and many tiles, small ones and ones up to 65536; the first is empty."""
    rng = np.random.default_rng(5)
    samples = np.concatenate([rng.integers(0, top, (30, 4, 4)) for top in (3, 5, 12, 17)])
    samples[rng.random(samples.shape) < 0.3] = 0
    samples[90:] = np.where(
        rng.random((30, 4, 4)) < 0.5, np.maximum(samples[90:], 14), samples[90:]
    )
    samples[0] = 0
    return samples.astype(np.uint8)


def test_a_turn_follows_the_rules_for_one_board_and_for_many(boards: Array) -> None:
    u = np.random.default_rng(6).random((len(boards), 2))
    for a in range(4):
        actions = np.full((len(boards), 1), a)
        whole = GAME.step(boards, actions, u)
        moves = GAME.legal_actions_mask(boards)[:, 0, a]
        for row, board in enumerate(boards):
            row_slice = slice(row, row + 1)
            expected, score = slide_board(board, a)
            expected_board = np.array(expected)
            assert (
                moves[row]
                == (expected_board != board).any()
                == GAME.legal_actions_mask(boards[row_slice])[0, 0, a]
            )
            if moves[row]:
                holes = np.argwhere(expected_board == 0)
                hole = holes[int(u[row, 0] * len(holes))]
                expected_board[tuple(hole)] = 1 + (u[row, 1] >= GAME.p_two)
            for outcome, index in (
                (whole, row),
                (GAME.step(boards[row_slice], actions[row_slice], u[row_slice]), 0),
            ):
                assert (outcome.state[index] == expected_board).all(), (board, a)
                assert outcome.rewards[index, 0] == score


def test_a_board_is_terminal_if_no_slide_changes_it(boards: Array) -> None:
    # full, and no equal tiles are adjacent
    striped = np.tile([[1, 2], [2, 1]], (2, 2)).astype(np.uint8)
    mergeable = striped.copy()
    mergeable[0, 0] = 2
    for batch in (
        np.concatenate([boards, [striped, mergeable]]),
        boards[1:4],
        striped[None],
        mergeable[None],
    ):
        assert (
            GAME.terminal(batch).tolist()
            == (~GAME.legal_actions_mask(batch).any(axis=(1, 2))).tolist()
        )
    assert GAME.terminal(np.stack([striped, mergeable])).tolist() == [True, False]


def test_slides_equal_the_slides_of_a_turn(boards: Array) -> None:
    for a in range(4):
        moved, scores = slide_and_score(boards, np.full(len(boards), a))
        expected = [slide_board(board, a) for board in boards]
        assert moved.tolist() == [board for board, _ in expected]
        assert scores.tolist() == [score for _, score in expected]


def test_a_board_is_packed_without_loss_up_to_its_largest_tile() -> None:
    cells = np.random.default_rng(1).integers(0, 15, (5, 4, 4)).astype(np.uint8)
    packed = packed_boards.pack_boards(cells)
    assert (packed_boards.unpack_boards(packed) == cells).all()
