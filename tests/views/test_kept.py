"""What a view makes of a game, kept: it is what the view would say now, and is seldom asked."""

from rich.text import Text

import dmplay
from dmplay.dice import SeededUniforms
from dmplay.finding.names import problem_names
from dmplay.session import Session
from dmplay.views.kept import ARRAY_FIELDS, HASHABLE_FIELDS, SeatSnapshot, ViewCache
from dmplay.views.style import DrawOptions, fit_board, load_view_module
from tests.support.cases import random_play

LOOK = DrawOptions(80, 24)


def test_what_is_kept_is_what_the_view_says_now() -> None:
    for name in problem_names():
        problem = dmplay.load_problem(name)
        kept, style = ViewCache(problem), load_view_module(problem)
        game = Session(problem, SeededUniforms(1), random_play(problem))
        for _ in range(5):
            now = SeatSnapshot(game, 0)
            assert kept.panel_rows(now) == style.panel_rows(now.view), name
            assert not now.turn or kept.describe_turn(now) == style.describe_turn(now.view), name
            drawn, anew = kept.fit_board(now, LOOK), fit_board(style, now.view, LOOK)
            assert (drawn, drawn.spans) == (anew, anew.spans), name
            if not game.over:
                game.advance()


def test_a_game_that_comes_to_a_place_again_looks_the_same_and_no_view_of_it_is_made() -> None:
    problem = dmplay.load_problem("hexworld", rewards=[])
    game, kept = Session(problem, SeededUniforms(1), random_play(problem)), ViewCache(problem)
    drawn: dict[int, Text] = {}
    asked = 0
    for _ in range(300):
        now = SeatSnapshot(game, 0)
        board = kept.fit_board(now, LOOK)
        assert drawn.setdefault(int(game.state), board) is board
        asked += "view" in vars(now)
        game.advance()
    assert asked <= len(drawn) + 2 < 30


def test_a_view_that_looks_further_back_than_the_last_turn_is_asked_anew() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    game, kept = Session(problem, SeededUniforms(1)), ViewCache(problem)
    boards = []
    for _ in range(3):
        game.advance([0, 0])
        boards.append(kept.fit_board(SeatSnapshot(game, 0), LOOK).plain)
    assert len({*boards}) == 3


def test_every_part_of_a_look_tells_drawings_apart() -> None:
    assert {*HASHABLE_FIELDS, *ARRAY_FIELDS, "keys_by_action"} == {*DrawOptions._fields}
