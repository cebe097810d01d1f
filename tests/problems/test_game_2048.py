"""Expectimax: the same values as the plain recursion, and how far it gets."""

import time
from itertools import product

import numpy as np
import pytest

import dmplay
from dmplay.budget import report_progress_to
from dmplay.core import enumerate_outcomes
from dmplay.errors import BadParameter
from dmplay.policies.game_2048 import Expectimax
from dmplay.problems.game_2048 import Game2048, slide_and_score
from dmplay.solvers import expectimax_2048, worth_2048
from dmplay.tiles import DOWN, LEFT, RIGHT, UP, pack_boards
from dmplay.transcript.format import resolve_turn_limit

GAME = Game2048()
EARLY = "2 . . 4/. 2 . ./. . 8 ./4 . . 2"
LATE = "2 4 2 8/4 8 16 64/2 32 512 128/. 2 1024 16"
BIG = "65536 32768 2 4/4 8 16 64/2 32 512 128/4 2 8 16"
TIGHT = "2 4 2 8/4 8 16 64/2 32 512 128/4 1024 1024 16"
PAIR = "32768 32768 2 4/4 8 16 64/2 32 512 128/4 2 8 16"
ROW = "1024 512 256 128/. . 4 64/. . . 32/. . . 2"
LARGE = "16384 8192 4096 2048/128 256 512 1024/64 . . ./. . . 2"
DEAD = "2 4 2 4/4 2 4 2/2 4 2 4/4 2 4 2"


PLACES = np.arange(16).reshape(4, 4)
TURNED = [np.rot90(way, k).reshape(-1) for way in (PLACES, PLACES.T) for k in range(4)]
PATTERNS = [np.array(list(pattern.replace(" ", ""))) == "x" for pattern in worth_2048.PATTERNS]
LOOKED_AT = np.array([[way[: len(cells)][cells] for way in TURNED] for cells in PATTERNS])


def board(text: str) -> np.ndarray:
    return GAME.parse_state(text)[None]


def worth(s: np.ndarray) -> float:
    """The sum over all ways to turn and mirror one board of what its patterns are worth."""
    numbers = worth_2048.load_pattern_tables(2 * bool((s >= 13).any()) + bool((s == 12).any()))
    filled = s.reshape(-1)[LOOKED_AT] @ 16 ** np.arange(5)
    return float(
        np.take_along_axis(numbers, filled, axis=1).sum(dtype=int) * worth_2048.POINTS_PER_UNIT
    )


def slide_worth(game: Game2048, s: np.ndarray, a: int, depth: int) -> float:
    """What a slide is worth by the definition: one board, one tile, at a time."""
    after, pay = slide_and_score(s[None], np.array([a]))
    if (after[0] == s).all():
        return -np.inf
    if depth == 1:
        return float(pay[0]) + worth(after[0])
    p, outcome = enumerate_outcomes(game, s[None], np.array([[a]]))
    each = [best_worth(game, s2, max(depth - 2, 1)) for s2 in outcome.state[0]]
    return float(pay[0] + np.dot(p[0], each))


def best_worth(game: Game2048, s: np.ndarray, depth: int) -> float:
    found = max(slide_worth(game, s, a, depth) for a in range(4))
    return found if found > -np.inf else 0.0


@pytest.mark.parametrize("text", [EARLY, LATE, ROW, LARGE])
def test_a_board_is_worth_what_its_patterns_are_however_it_is_turned(text: str) -> None:
    s = board(text)[0]
    turned = s.reshape(-1)[np.array(TURNED)].reshape(8, 4, 4)
    assert worth_2048.evaluate_boards(pack_boards(turned)).tolist() == [worth(s)] * 8


def test_a_board_far_on_is_searched_as_a_like_one_of_smaller_tiles() -> None:
    given = [LARGE, "32768 8192 4 2/2 4 8 16/. . . ./. . . .", "8192 2 . ./. . . ./. . . ./. . . ."]
    like = [LARGE, "8192 4096 4 2/2 4 8 16/. . . ./. . . .", "8192 2 . ./. . . ./. . . ./. . . ."]
    far = np.concatenate([board(text) for text in given])
    wanted = np.concatenate([board(text) for text in like])
    assert (expectimax_2048.downgrade_tiles(far) == wanted).all()
    found, same = (
        expectimax_2048.compute_action_values(boards, 0.8, 2) for boards in (far, wanted)
    )
    assert (found == same).all()


@pytest.mark.parametrize(
    ("text", "depth", "p_two"),
    [
        *product((EARLY, LATE), (1, 2), (0.8, 0.0, 1.0)),
        *product((LATE, TIGHT), (3,), (0.8, 0.0, 1.0)),
        pytest.param(TIGHT, 4, 0.8, marks=pytest.mark.slow),
    ],
)
def test_the_values_are_those_of_the_plain_recursion(
    monkeypatch: pytest.MonkeyPatch, text: str, depth: int, p_two: float
) -> None:
    monkeypatch.setattr(expectimax_2048, "MIN_PATH_PROBABILITY", 0.0)
    monkeypatch.setattr(expectimax_2048, "MAX_POINT_DEFICIT", np.inf)
    game = Game2048(p_two=p_two)
    s = board(text)
    found = expectimax_2048.compute_action_values(s, p_two, depth)[0]
    wanted = [slide_worth(game, s[0], a, depth) for a in range(4)]
    np.testing.assert_allclose(found, wanted, rtol=1e-9)


def test_smaller_tiles_slide_as_the_large_ones_do() -> None:
    tiles = [0, 1, 2, 3, 4, 5, 6, 8, 9, 12, 13, 15, 17]
    far = np.random.default_rng(1).choice(tiles, (200, 4, 4)).astype(np.uint8)
    like = expectimax_2048.downgrade_tiles(far)
    assert (like != far).any(axis=(1, 2)).mean() > 0.9
    assert like.max() < 14
    for a in range(4):
        (given, _), (found, _) = (
            slide_and_score(boards, np.full(200, a)) for boards in (far, like)
        )
        assert ((given > 0) == (found > 0)).all()


def test_only_a_likely_path_is_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        expectimax_2048, "MIN_PATH_PROBABILITY", 0.1
    )  # a 2 in one cell of EARLY: 0.8 / 10
    near, far = (
        expectimax_2048.compute_action_values(
            np.concatenate([board(EARLY), board(LATE)]), 0.8, depth
        )
        for depth in (4, 6)
    )
    assert (near[0] == far[0]).all()
    assert (near[1] != far[1]).any()


@pytest.mark.parametrize(("p_two", "certain"), [(0.8, 1.0), (0.3, 0.0)])
def test_a_tile_that_is_not_likely_counts_as_the_other(
    monkeypatch: pytest.MonkeyPatch, p_two: float, certain: float
) -> None:
    alone = expectimax_2048.compute_action_values(board(EARLY), certain, 3)
    assert (expectimax_2048.compute_action_values(board(EARLY), p_two, 3) != alone).any()
    monkeypatch.setattr(
        expectimax_2048, "MIN_PATH_PROBABILITY", 0.05
    )  # in one cell 0.8 / 11, and 0.2 / 11
    found = expectimax_2048.compute_action_values(board(EARLY), p_two, 3)
    np.testing.assert_allclose(found, alone, rtol=1e-12)


def test_where_no_tile_is_likely_a_board_counts_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(expectimax_2048, "MIN_PATH_PROBABILITY", 2.0)
    boards = np.concatenate([board(EARLY), board(LATE)])
    near, far = (expectimax_2048.compute_action_values(boards, 0.8, depth) for depth in (1, 6))
    assert (near == far).all()


def test_a_slide_that_leaves_a_far_worse_board_is_not_followed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    boards = np.concatenate([board(text) for text in (LATE, TIGHT, ROW)])
    found = []
    for margin in (0.0, expectimax_2048.MAX_POINT_DEFICIT, np.inf):
        monkeypatch.setattr(expectimax_2048, "MAX_POINT_DEFICIT", margin)
        found.append(expectimax_2048.compute_action_values(boards, 0.8, 6))
    best_only, usual, all_slides = found
    assert (best_only <= all_slides).all()
    assert (best_only < all_slides).any()
    assert (usual.argmax(axis=1) == all_slides.argmax(axis=1)).all()


def test_two_of_the_largest_tiles_of_a_search_still_merge() -> None:
    values = expectimax_2048.compute_action_values(
        np.concatenate([board(PAIR), board(BIG)]), 0.8, 4
    )
    assert np.isfinite(values).tolist() == [[True, False, True, False], [False] * 4]


@pytest.mark.parametrize(
    ("text", "slide"),
    [
        (ROW, "left"),
        ("2 . . ./32 . . ./64 4 . ./128 256 512 1024", "right"),
    ],
)
def test_the_row_of_large_tiles_stays_at_its_wall(text: str, slide: str) -> None:
    agent = dmplay.load_agent(GAME, 0, "expectimax")
    chosen = agent.choose(agent.initial_memory(board(text)), None, np.zeros((1, 0)))
    assert GAME.actions[0][int(chosen[0])] == slide


def test_a_slide_that_moves_nothing_is_worth_minus_infinity() -> None:
    for text in (EARLY, LATE, BIG, DEAD):
        values = expectimax_2048.compute_action_values(board(text), 0.8, 2)[0]
        assert ((values > -np.inf) == GAME.legal_actions_mask(board(text))[0, 0]).all()


def test_a_time_limit_is_kept_and_said() -> None:
    agent = Expectimax(GAME, 0, milliseconds=100.0)
    assert agent.depends_on_clock
    assert not Expectimax(GAME, 0).depends_on_clock
    began = time.process_time()
    values = agent.action_values(agent.initial_memory(board(EARLY)))
    assert time.process_time() - began < 5.0  # a slice ends before the search does
    assert values is not None
    assert np.isfinite(values).all()


def test_time_for_two_plies_there_always_is() -> None:
    in_no_time = expectimax_2048.search_by_iterative_deepening(board(EARLY), 0.8, 20, 0.0)
    assert (in_no_time == expectimax_2048.compute_action_values(board(EARLY), 0.8, 2)).all()


def test_who_watches_is_heard_within_a_layer_of_boards(monkeypatch: pytest.MonkeyPatch) -> None:
    values, told = expectimax_2048.compute_action_values(board(EARLY), 0.8, 2), list[float]()
    monkeypatch.setattr(expectimax_2048, "BOARDS_PER_EVALUATION", 10)  # of some two hundred
    with report_progress_to(told.append):
        assert (expectimax_2048.compute_action_values(board(EARLY), 0.8, 2) == values).all()
    assert len(told) > 10


@pytest.mark.parametrize("given", ["depth=0", "depth=21", "milliseconds=-1"])
def test_expectimax_refuses_numbers_out_of_bounds(given: str) -> None:
    with pytest.raises(BadParameter, match=f"{given.partition('=')[0]}: got"):
        dmplay.load_agent(GAME, 0, f"expectimax:{given}")


def test_a_game_of_agents_has_no_limit_of_turns_as_it_ends_by_itself() -> None:
    assert resolve_turn_limit(GAME, ["corner"], None) is None
    assert resolve_turn_limit(dmplay.load_problem("hexworld"), ["random"], None) == 10_000


@pytest.mark.slow
def test_expectimax_reaches_2048_in_every_game_when_it_looks_one_tile_ahead() -> None:
    agent = dmplay.load_agent(GAME, 0, "expectimax:depth=2")
    boards = dmplay.rollout(GAME, [agent], episodes=20, turn_limit=1200, seed=1).final_states
    assert (boards.reshape(20, -1).max(axis=1) >= 11).all()


def test_the_corner_goes_left_and_down_in_turn_and_elsewhere_when_both_are_stuck() -> None:
    corner = dmplay.load_agent(GAME, 0, "corner")
    legal = (np.arange(1, 16)[:, None] >> np.arange(4) & 1).astype(bool)
    for due, other in ((LEFT, DOWN), (DOWN, LEFT)):
        chosen = corner.choose((np.full(15, due),), legal, np.zeros((15, 0)))
        wanted = [next(a for a in (due, other, RIGHT, UP) if able[a]) for able in legal]
        assert chosen.tolist() == wanted
