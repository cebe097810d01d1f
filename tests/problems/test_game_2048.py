"""Tests of expectimax for 2048: values against a plain recursion, pruning and strength."""

import time
from itertools import product

import numpy as np
import pytest

import dmplay
from dmplay.core.problem import enumerate_outcomes
from dmplay.core.work_budget import report_progress_to
from dmplay.errors import BadParameter
from dmplay.problems.game_2048 import expectimax, ntuple_network
from dmplay.problems.game_2048.agents import Expectimax
from dmplay.problems.game_2048.packed_boards import DOWN, LEFT, RIGHT, UP, pack_boards
from dmplay.problems.game_2048.rules import Game2048, slide_and_score
from dmplay.transcript.format import resolve_turn_limit

GAME = Game2048()
EARLY_BOARD = "2 . . 4/. 2 . ./. . 8 ./4 . . 2"
LATE_BOARD = "2 4 2 8/4 8 16 64/2 32 512 128/. 2 1024 16"
BIG_TILE_BOARD = "65536 32768 2 4/4 8 16 64/2 32 512 128/4 2 8 16"
TIGHT_BOARD = "2 4 2 8/4 8 16 64/2 32 512 128/4 1024 1024 16"
BIG_PAIR_BOARD = "32768 32768 2 4/4 8 16 64/2 32 512 128/4 2 8 16"
ORDERED_ROW_BOARD = "1024 512 256 128/. . 4 64/. . . 32/. . . 2"
LARGE_TILES_BOARD = "16384 8192 4096 2048/128 256 512 1024/64 . . ./. . . 2"
LOST_BOARD = "2 4 2 4/4 2 4 2/2 4 2 4/4 2 4 2"


CELL_INDICES = np.arange(16).reshape(4, 4)
SYMMETRIES = [
    np.rot90(symmetry, k).reshape(-1)
    for symmetry in (CELL_INDICES, CELL_INDICES.T)
    for k in range(4)
]
PATTERNS = [np.array(list(pattern.replace(" ", ""))) == "x" for pattern in ntuple_network.PATTERNS]
PATTERN_CELLS = np.array(
    [[symmetry[: len(cells)][cells] for symmetry in SYMMETRIES] for cells in PATTERNS]
)


def parse_board(text: str) -> np.ndarray:
    return GAME.parse_state(text)[None]


def compute_board_value(s: np.ndarray) -> float:
    """Return the sum of the pattern values of a board over all of its symmetries."""
    numbers = ntuple_network.load_pattern_tables(2 * bool((s >= 13).any()) + bool((s == 12).any()))
    indices = s.reshape(-1)[PATTERN_CELLS] @ 16 ** np.arange(5)
    return float(
        np.take_along_axis(numbers, indices, axis=1).sum(dtype=int) * ntuple_network.POINTS_PER_UNIT
    )


def compute_slide_value(game: Game2048, s: np.ndarray, a: int, depth: int) -> float:
    """Return the value of a slide by the definition: one board and one tile at a time."""
    next_boards, rewards = slide_and_score(s[None], np.array([a]))
    if (next_boards[0] == s).all():
        return -np.inf
    if depth == 1:
        return float(rewards[0]) + compute_board_value(next_boards[0])
    p, outcome = enumerate_outcomes(game, s[None], np.array([[a]]))
    values = [compute_best_value(game, s2, max(depth - 2, 1)) for s2 in outcome.state[0]]
    return float(rewards[0] + np.dot(p[0], values))


def compute_best_value(game: Game2048, s: np.ndarray, depth: int) -> float:
    value = max(compute_slide_value(game, s, a, depth) for a in range(4))
    return value if value > -np.inf else 0.0


@pytest.mark.parametrize("text", [EARLY_BOARD, LATE_BOARD, ORDERED_ROW_BOARD, LARGE_TILES_BOARD])
def test_all_symmetries_of_a_board_have_the_value_of_its_patterns(text: str) -> None:
    s = parse_board(text)[0]
    symmetric_boards = s.reshape(-1)[np.array(SYMMETRIES)].reshape(8, 4, 4)
    assert (
        ntuple_network.evaluate_boards(pack_boards(symmetric_boards)).tolist()
        == [compute_board_value(s)] * 8
    )


def test_boards_with_large_tiles_are_searched_like_boards_with_smaller_tiles() -> None:
    large_texts = [
        LARGE_TILES_BOARD,
        "32768 8192 4 2/2 4 8 16/. . . ./. . . .",
        "8192 2 . ./. . . ./. . . ./. . . .",
    ]
    small_texts = [
        LARGE_TILES_BOARD,
        "8192 4096 4 2/2 4 8 16/. . . ./. . . .",
        "8192 2 . ./. . . ./. . . ./. . . .",
    ]
    large_boards = np.concatenate([parse_board(text) for text in large_texts])
    small_boards = np.concatenate([parse_board(text) for text in small_texts])
    assert (expectimax.downgrade_tiles(large_boards) == small_boards).all()
    large_values, small_values = (
        expectimax.compute_action_values(boards, 0.8, 2) for boards in (large_boards, small_boards)
    )
    assert (large_values == small_values).all()


@pytest.mark.parametrize(
    ("text", "depth", "p_two"),
    [
        *product((EARLY_BOARD, LATE_BOARD), (1, 2), (0.8, 0.0, 1.0)),
        *product((LATE_BOARD, TIGHT_BOARD), (3,), (0.8, 0.0, 1.0)),
        pytest.param(TIGHT_BOARD, 4, 0.8, marks=pytest.mark.slow),
    ],
)
def test_the_values_are_those_of_the_plain_recursion(
    monkeypatch: pytest.MonkeyPatch, text: str, depth: int, p_two: float
) -> None:
    monkeypatch.setattr(expectimax, "MIN_PATH_PROBABILITY", 0.0)
    monkeypatch.setattr(expectimax, "MAX_POINT_DEFICIT", np.inf)
    game = Game2048(p_two=p_two)
    s = parse_board(text)
    values = expectimax.compute_action_values(s, p_two, depth)[0]
    expected = [compute_slide_value(game, s[0], a, depth) for a in range(4)]
    np.testing.assert_allclose(values, expected, rtol=1e-9)


def test_reduced_tiles_slide_like_the_large_ones() -> None:
    tiles = [0, 1, 2, 3, 4, 5, 6, 8, 9, 12, 13, 15, 17]
    large_boards = np.random.default_rng(1).choice(tiles, (200, 4, 4)).astype(np.uint8)
    reduced_boards = expectimax.downgrade_tiles(large_boards)
    assert (reduced_boards != large_boards).any(axis=(1, 2)).mean() > 0.9
    assert reduced_boards.max() < 14
    for a in range(4):
        (large_slides, _), (reduced_slides, _) = (
            slide_and_score(boards, np.full(200, a)) for boards in (large_boards, reduced_boards)
        )
        assert ((large_slides > 0) == (reduced_slides > 0)).all()


def test_unlikely_paths_are_pruned(monkeypatch: pytest.MonkeyPatch) -> None:
    # in EARLY_BOARD, a 2 in one cell has probability 0.8 / 10
    monkeypatch.setattr(expectimax, "MIN_PATH_PROBABILITY", 0.1)
    shallow_values, deep_values = (
        expectimax.compute_action_values(
            np.concatenate([parse_board(EARLY_BOARD), parse_board(LATE_BOARD)]), 0.8, depth
        )
        for depth in (4, 6)
    )
    assert (shallow_values[0] == deep_values[0]).all()
    assert (shallow_values[1] != deep_values[1]).any()


@pytest.mark.parametrize(("p_two", "likely_p_two"), [(0.8, 1.0), (0.3, 0.0)])
def test_an_unlikely_tile_counts_as_the_likely_one(
    monkeypatch: pytest.MonkeyPatch, p_two: float, likely_p_two: float
) -> None:
    expected = expectimax.compute_action_values(parse_board(EARLY_BOARD), likely_p_two, 3)
    assert (expectimax.compute_action_values(parse_board(EARLY_BOARD), p_two, 3) != expected).any()
    # in one cell 0.8 / 11 or 0.2 / 11
    monkeypatch.setattr(expectimax, "MIN_PATH_PROBABILITY", 0.05)
    values = expectimax.compute_action_values(parse_board(EARLY_BOARD), p_two, 3)
    np.testing.assert_allclose(values, expected, rtol=1e-12)


def test_a_search_without_likely_tiles_evaluates_the_board_itself(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(expectimax, "MIN_PATH_PROBABILITY", 2.0)
    boards = np.concatenate([parse_board(EARLY_BOARD), parse_board(LATE_BOARD)])
    shallow_values, deep_values = (
        expectimax.compute_action_values(boards, 0.8, depth) for depth in (1, 6)
    )
    assert (shallow_values == deep_values).all()


def test_slides_to_much_worse_boards_are_pruned(monkeypatch: pytest.MonkeyPatch) -> None:
    boards = np.concatenate(
        [parse_board(text) for text in (LATE_BOARD, TIGHT_BOARD, ORDERED_ROW_BOARD)]
    )
    values = []
    for margin in (0.0, expectimax.MAX_POINT_DEFICIT, np.inf):
        monkeypatch.setattr(expectimax, "MAX_POINT_DEFICIT", margin)
        values.append(expectimax.compute_action_values(boards, 0.8, 6))
    best_only, usual, all_slides = values
    assert (best_only <= all_slides).all()
    assert (best_only < all_slides).any()
    assert (usual.argmax(axis=1) == all_slides.argmax(axis=1)).all()


def test_two_of_the_largest_tiles_of_a_search_still_merge() -> None:
    values = expectimax.compute_action_values(
        np.concatenate([parse_board(BIG_PAIR_BOARD), parse_board(BIG_TILE_BOARD)]), 0.8, 4
    )
    assert np.isfinite(values).tolist() == [[True, False, True, False], [False] * 4]


@pytest.mark.parametrize(
    ("text", "slide"),
    [(ORDERED_ROW_BOARD, "left"), ("2 . . ./32 . . ./64 4 . ./128 256 512 1024", "right")],
)
def test_a_row_of_large_tiles_stays_at_its_edge(text: str, slide: str) -> None:
    agent = dmplay.load_agent(GAME, 0, "expectimax")
    chosen = agent.choose(agent.initial_memory(parse_board(text)), None, np.zeros((1, 0)))
    assert GAME.actions[0][int(chosen[0])] == slide


def test_a_slide_that_moves_nothing_is_worth_minus_infinity() -> None:
    for text in (EARLY_BOARD, LATE_BOARD, BIG_TILE_BOARD, LOST_BOARD):
        values = expectimax.compute_action_values(parse_board(text), 0.8, 2)[0]
        assert ((values > -np.inf) == GAME.legal_actions_mask(parse_board(text))[0, 0]).all()


def test_a_time_limit_is_respected_and_reported() -> None:
    agent = Expectimax(GAME, 0, milliseconds=100.0)
    assert agent.depends_on_clock
    assert not Expectimax(GAME, 0).depends_on_clock
    start_seconds = time.process_time()
    values = agent.action_values(agent.initial_memory(parse_board(EARLY_BOARD)))
    assert time.process_time() - start_seconds < 5.0  # a slice ends before the search does
    assert values is not None
    assert np.isfinite(values).all()


def test_two_plies_are_searched_even_without_time() -> None:
    values = expectimax.search_by_iterative_deepening(parse_board(EARLY_BOARD), 0.8, 20, 0.0)
    assert (values == expectimax.compute_action_values(parse_board(EARLY_BOARD), 0.8, 2)).all()


def test_progress_is_reported_within_a_layer_of_boards(monkeypatch: pytest.MonkeyPatch) -> None:
    values = expectimax.compute_action_values(parse_board(EARLY_BOARD), 0.8, 2)
    reports = list[float]()
    monkeypatch.setattr(expectimax, "BOARDS_PER_EVALUATION", 10)  # of about two hundred boards
    with report_progress_to(reports.append):
        assert (expectimax.compute_action_values(parse_board(EARLY_BOARD), 0.8, 2) == values).all()
    assert len(reports) > 10


@pytest.mark.parametrize("setting", ["depth=0", "depth=21", "milliseconds=-1"])
def test_expectimax_refuses_numbers_out_of_bounds(setting: str) -> None:
    with pytest.raises(BadParameter, match=f"{setting.partition('=')[0]}: got"):
        dmplay.load_agent(GAME, 0, f"expectimax:{setting}")


def test_a_problem_that_always_ends_has_no_default_turn_limit() -> None:
    assert resolve_turn_limit(GAME, ["corner"], None) is None
    assert resolve_turn_limit(dmplay.load_problem("hexworld"), ["random"], None) == 10_000


@pytest.mark.slow
def test_expectimax_reaches_2048_in_every_game_when_it_looks_one_tile_ahead() -> None:
    agent = dmplay.load_agent(GAME, 0, "expectimax:depth=2")
    boards = dmplay.rollout(GAME, [agent], episodes=20, turn_limit=1200, seed=1).final_states
    assert (boards.reshape(20, -1).max(axis=1) >= 11).all()


def test_corner_alternates_left_and_down_unless_both_are_illegal() -> None:
    corner = dmplay.load_agent(GAME, 0, "corner")
    legal = (np.arange(1, 16)[:, None] >> np.arange(4) & 1).astype(bool)
    for preferred, other in ((LEFT, DOWN), (DOWN, LEFT)):
        chosen = corner.choose((np.full(15, preferred),), legal, np.zeros((15, 0)))
        expected = [next(a for a in (preferred, other, RIGHT, UP) if mask[a]) for mask in legal]
        assert chosen.tolist() == expected
