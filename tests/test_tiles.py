"""Boards of tiles: what slides do, beside a literal reading of the rules."""

import numpy as np
import pytest

from dmplay import tiles
from dmplay.chance import Array
from dmplay.problems.game_2048 import Game2048, slide_and_score

GAME = Game2048()


def slid(line: list[int]) -> tuple[list[int], int]:
    """A line after a slide to its first cell, and the pay: each tile merges once."""
    done: list[int] = []
    pay = 0
    free = False  # whether the last tile may still merge
    for tile in filter(None, line):
        if free and done[-1] == tile:
            done[-1] += 1
            pay += 2 ** done[-1]
            free = False
        else:
            done.append(tile)
            free = True
    return done + [0] * (4 - len(done)), pay


def after(board: Array, a: int) -> tuple[list[list[int]], int]:
    """A board after a slide, and the pay, line by line."""
    lines = board.T if a in (tiles.UP, tiles.DOWN) else board
    back = -1 if a in (tiles.DOWN, tiles.RIGHT) else 1
    ends = [slid(line[::back].tolist()) for line in lines]
    found = np.array([line[::back] for line, _ in ends])
    return (found.T if a in (tiles.UP, tiles.DOWN) else found).tolist(), sum(p for _, p in ends)


@pytest.fixture(scope="module")
def boards() -> Array:
    """Boards with few and many tiles, small ones and ones up to 65536; the first is empty."""
    rng = np.random.default_rng(5)
    found = np.concatenate([rng.integers(0, top, (30, 4, 4)) for top in (3, 5, 12, 17)])
    found[rng.random(found.shape) < 0.3] = 0
    found[90:] = np.where(rng.random((30, 4, 4)) < 0.5, np.maximum(found[90:], 14), found[90:])
    found[0] = 0
    return found.astype(np.uint8)


def test_a_turn_is_what_the_rules_say_of_one_board_and_of_many(boards: Array) -> None:
    u = np.random.default_rng(6).random((len(boards), 2))
    for a in range(4):
        actions = np.full((len(boards), 1), a)
        whole = GAME.step(boards, actions, u)
        moves = GAME.legal_actions_mask(boards)[:, 0, a]
        for row, board in enumerate(boards):
            one = slice(row, row + 1)
            expected, pay = after(board, a)
            wanted = np.array(expected)
            assert (
                moves[row]
                == (wanted != board).any()
                == GAME.legal_actions_mask(boards[one])[0, 0, a]
            )
            if moves[row]:
                holes = np.argwhere(wanted == 0)
                hole = holes[int(u[row, 0] * len(holes))]
                wanted[tuple(hole)] = 1 + (u[row, 1] >= GAME.p_two)
            for outcome, at in ((whole, row), (GAME.step(boards[one], actions[one], u[one]), 0)):
                assert (outcome.state[at] == wanted).all(), (board, a)
                assert outcome.rewards[at, 0] == pay


def test_a_board_is_over_where_no_slide_moves_anything(boards: Array) -> None:
    striped = np.tile([[1, 2], [2, 1]], (2, 2)).astype(np.uint8)  # full, and no two alike meet
    met = striped.copy()
    met[0, 0] = 2
    for some in (np.concatenate([boards, [striped, met]]), boards[1:4], striped[None], met[None]):
        assert (
            GAME.terminal(some).tolist()
            == (~GAME.legal_actions_mask(some).any(axis=(1, 2))).tolist()
        )
    assert GAME.terminal(np.stack([striped, met])).tolist() == [True, False]


def test_slides_alone_are_those_of_the_turn(boards: Array) -> None:
    for a in range(4):
        moved, pay = slide_and_score(boards, np.full(len(boards), a))
        expected = [after(board, a) for board in boards]
        assert moved.tolist() == [board for board, _ in expected]
        assert pay.tolist() == [paid for _, paid in expected]


def test_a_board_is_packed_without_loss_up_to_its_largest_tile() -> None:
    cells = np.random.default_rng(1).integers(0, 15, (5, 4, 4)).astype(np.uint8)
    many = tiles.pack_boards(cells)
    assert (tiles.unpack_boards(many) == cells).all()
    assert [tiles.unpack_boards(board)[0].tolist() for board in many.tolist()] == cells.tolist()
