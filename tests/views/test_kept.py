"""What a view makes of a game, kept: it is what the view would say now, and is seldom asked."""

from rich.text import Text

import dmplay
from dmplay.dice import Dice
from dmplay.finding.names import problem_names
from dmplay.session import Session
from dmplay.views.kept import ARRAYS, PLAIN, Kept, Moment
from dmplay.views.style import Look, fit, style_of
from tests.support.cases import random_play

LOOK = Look(80, 24)


def test_what_is_kept_is_what_the_view_says_now() -> None:
    for name in problem_names():
        problem = dmplay.load(name)
        kept, style = Kept(problem), style_of(problem)
        game = Session(problem, Dice(1), random_play(problem))
        for _ in range(5):
            now = Moment(game, 0)
            assert kept.panel(now) == style.panel(now.view), name
            assert not now.turn or kept.told(now) == style.told(now.view), name
            drawn, anew = kept.fit(now, LOOK), fit(style, now.view, LOOK)
            assert (drawn, drawn.spans) == (anew, anew.spans), name
            if not game.over:
                game.advance()


def test_a_game_that_comes_to_a_place_again_looks_the_same_and_no_view_of_it_is_made() -> None:
    problem = dmplay.load("hexworld", rewards=[])
    game, kept = Session(problem, Dice(1), random_play(problem)), Kept(problem)
    drawn: dict[int, Text] = {}
    asked = 0
    for _ in range(300):
        now = Moment(game, 0)
        board = kept.fit(now, LOOK)
        assert drawn.setdefault(int(game.state), board) is board
        asked += "view" in vars(now)
        game.advance()
    assert asked <= len(drawn) + 2 < 30


def test_a_view_that_looks_further_back_than_the_last_turn_is_asked_anew() -> None:
    problem = dmplay.load("prisoners-dilemma")
    game, kept = Session(problem, Dice(1)), Kept(problem)
    boards = []
    for _ in range(3):
        game.advance([0, 0])
        boards.append(kept.fit(Moment(game, 0), LOOK).plain)
    assert len({*boards}) == 3


def test_every_part_of_a_look_tells_drawings_apart() -> None:
    assert {*PLAIN, *ARRAYS, "names"} == {*Look._fields}
