"""Tests of the view cache: its results equal those of the view, which it rarely calls."""

from rich.text import Text

import dmplay
from dmplay.registry.builtin_names import problem_names
from dmplay.session import Session
from dmplay.uniforms import SeededUniforms
from dmplay.views.protocol import DrawOptions, fit_board, load_view_module
from dmplay.views.view_cache import ARRAY_FIELDS, HASHABLE_FIELDS, SeatSnapshot, ViewCache
from tests.support.problem_cases import make_random_policies

OPTIONS = DrawOptions(80, 24)


def test_cached_results_equal_those_of_the_view() -> None:
    for name in problem_names():
        problem = dmplay.load_problem(name)
        cache, view_module = ViewCache(problem), load_view_module(problem)
        game = Session(problem, SeededUniforms(1), make_random_policies(problem))
        for _ in range(5):
            snapshot = SeatSnapshot(game, 0)
            assert cache.panel_rows(snapshot) == view_module.panel_rows(snapshot.view), name
            assert not snapshot.turn or cache.describe_turn(snapshot) == view_module.describe_turn(
                snapshot.view
            ), name
            cached_board, board = (
                cache.fit_board(snapshot, OPTIONS),
                fit_board(view_module, snapshot.view, OPTIONS),
            )
            assert (cached_board, cached_board.spans) == (board, board.spans), name
            if not game.over:
                game.advance()


def test_a_revisited_state_reuses_its_board_without_a_new_view() -> None:
    problem = dmplay.load_problem("hexworld", rewards=[])
    game, cache = (
        Session(problem, SeededUniforms(1), make_random_policies(problem)),
        ViewCache(problem),
    )
    boards_by_state: dict[int, Text] = {}
    view_count = 0
    for _ in range(300):
        snapshot = SeatSnapshot(game, 0)
        board = cache.fit_board(snapshot, OPTIONS)
        assert boards_by_state.setdefault(int(game.state), board) is board
        view_count += "view" in vars(snapshot)
        game.advance()
    assert view_count <= len(boards_by_state) + 2 < 30


def test_a_view_that_reads_the_full_history_is_called_every_turn() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    game, cache = Session(problem, SeededUniforms(1)), ViewCache(problem)
    boards = []
    for _ in range(3):
        game.advance([0, 0])
        boards.append(cache.fit_board(SeatSnapshot(game, 0), OPTIONS).plain)
    assert len({*boards}) == 3


def test_every_draw_option_is_part_of_the_cache_key() -> None:
    assert {*HASHABLE_FIELDS, *ARRAY_FIELDS, "keys_by_action"} == {*DrawOptions._fields}
