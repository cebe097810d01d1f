"""What a person sees, board by board, and that it fits and can be read by everyone."""

import re
from functools import cache

import numpy as np
import pytest
from wcwidth import wcswidth

import dmplay
from dmplay.core import Problem
from dmplay.dice import SeededUniforms
from dmplay.finding import problems
from dmplay.finding.names import problem_names
from dmplay.keys.keyboard import find_action_by_key
from dmplay.session import Session
from dmplay.solvers import value_iteration
from dmplay.styles import palette_rgb
from dmplay.tabular import tabulate
from dmplay.views import game_2048 as tiles
from dmplay.views import generic
from dmplay.views import hexworld as exits
from dmplay.views.style import DrawOptions, Overlay, fit_board, load_view_module
from tests.files.sources import ballet, team
from tests.support.games import session
from tests.support.glyphs import GLYPHS, PLAIN
from tests.support.hidden import cheese
from tests.support.looks import foreseen

game_2048 = load_view_module(dmplay.load_problem("2048"))
hexworld = load_view_module(dmplay.load_problem("hexworld"))

SIZES = [(80, 24), (80, 12), (50, 14), (40, 8), (12, 2)]


EVERYTHING = [
    pytest.param(problem, id=f"{name}:{variant}" if variant else name)
    for name in problem_names()
    for variant, problem in problems.load_variants(name).items()
]


@cache
def played(problem: Problem, turns: int) -> Session:
    """A game of random agents, which nobody plays on with."""
    agents = [dmplay.load_agent(problem, seat, "random") for seat in range(len(problem.agents))]
    game = Session(problem, SeededUniforms(5), agents)
    while len(game.turns) < turns and not game.over:
        game.advance()
    return game


def test_hexworld_in_compact_ascii_with_its_policy() -> None:
    problem = dmplay.load_problem("hexworld")
    q = value_iteration.compute_optimal_q(tabulate(problem), problem.discount)
    view = session("hexworld", [0.55], [0.0]).view(0)
    drawn = fit_board(hexworld, view, DrawOptions(50, 8, ascii=True, overlay=Overlay("policy", q)))
    assert (
        drawn.plain
        == r"""
 / \ / \ / \ / \ / \ / \ / \ / \ / \ / \
| SE| SW| SW| W | E | E | @ | E | SE| SW|
 \ / \ / \ / \ / \ / \ / \ / \ / \ / \ /
  | + | W | NW|   | NE|       | E | SE|
 / \ / \ / \ / \   \ / \ / \ / \ / \ / \
| NE| NW| x | NW|   | E | E | NE|   | + |
 \ / \ / \ / \ /     \ / \ / \ /     \ /"""[1:]
    )


def test_hexworld_in_three_rows_of_dots() -> None:
    view = session("hexworld", [0.55], [0.0]).view(0)
    assert (
        fit_board(hexworld, view, DrawOptions(40, 3)).plain
        == """\
 .   .   .   .   .   .   @   .   .   .
   +5  .   .       .           .   .
 .   .  -10  .       .   .   .      +10"""
    )


def test_2048_with_its_new_tile_underlined() -> None:
    game = session("2048", [0.0, 0.0, 0.0, 0.9], [0.0, 0.0])
    game.advance([1])
    drawn = fit_board(game_2048, game.view(0), DrawOptions(80, 24))
    assert (
        drawn.plain
        == """\
┌──────┬──────┬──────┬──────┐
│  2   │  ·   │  ·   │  ·   │
├──────┼──────┼──────┼──────┤
│  ·   │  ·   │  ·   │  ·   │
├──────┼──────┼──────┼──────┤
│  ·   │  ·   │  ·   │  ·   │
├──────┼──────┼──────┼──────┤
│  2   │  4   │  ·   │  ·   │
└──────┴──────┴──────┴──────┘"""
    )
    underlined = [drawn.plain[s.start : s.end] for s in drawn.spans if "underline" in str(s.style)]
    assert underlined == ["2"]
    assert (
        fit_board(game_2048, game.view(0), DrawOptions(20, 4)).plain
        == """\
    2    ·    ·    ·
    ·    ·    ·    ·
    ·    ·    ·    ·
    2    4    ·    ·"""
    )


@pytest.mark.parametrize("problem", EVERYTHING)
@pytest.mark.parametrize("plain", [False, True])
def test_every_view_fits_every_room_in_allowed_glyphs(problem: Problem, plain: bool) -> None:
    style = load_view_module(problem)
    for turns in (0, 9):
        game = played(problem, turns)
        for seat in range(len(problem.agents)):
            view = game.view(seat)
            for width, height in SIZES[:: 1 + plain]:
                look = DrawOptions(width, height, ascii=plain, show_keys=True)
                drawn = fit_board(style, view, look)
                rows = drawn.plain.split("\n")
                assert max(map(len, rows)) <= width
                assert len(rows) <= height
                glyphs = {glyph for glyph in drawn.plain if not glyph.isascii()}
                assert not glyphs if plain else glyphs <= GLYPHS
                assert all(wcswidth(glyph) == 1 for glyph in glyphs)


@pytest.mark.parametrize("problem", EVERYTHING)
@pytest.mark.parametrize("plain", [False, True])
def test_what_is_advised_fits_every_room_in_allowed_glyphs(problem: Problem, plain: bool) -> None:
    style, game = load_view_module(problem), played(problem, 3)
    for seat, actions in enumerate(problem.actions):
        view = game.view(seat)
        many = len(actions.labels)
        regret = np.where(
            view.legal_actions_mask is None or view.legal_actions_mask, np.arange(many) / 7, np.nan
        )
        listed = bool(many) and len(problem.agents) == 1 and not game.over
        large = DrawOptions(0, 0, ascii=plain, allow_large=True)
        looks = [large, large._replace(regret=regret)] if many else [large]
        if listed:
            first = int(np.argmin(np.isnan(regret)))
            looks.append(large._replace(forecast=foreseen(game, first)))
        for look in looks:
            for width, height in SIZES[:: 1 + plain]:
                drawn = fit_board(style, view, look._replace(width=width, height=height)).plain
                rows = drawn.split("\n")
                assert max(map(len, rows)) <= width
                assert len(rows) <= height
                assert {*drawn} - {"\n"} <= (PLAIN if plain else PLAIN | GLYPHS)


@pytest.mark.parametrize("problem", EVERYTHING)
def test_every_view_fits_the_common_terminals_with_a_board(problem: Problem) -> None:
    style = load_view_module(problem)
    view = played(problem, 3).view(0)
    for width, height in ((80, 18), (50, 9), (40, 8)):
        assert "need" not in fit_board(style, view, DrawOptions(width, height)).plain


@pytest.mark.parametrize("problem", EVERYTHING)
def test_a_view_says_what_to_aim_for_the_most_important_first(problem: Problem) -> None:
    view = played(problem, 0).view(0)
    clauses = load_view_module(problem).goal_lines(view)
    assert len(clauses[0]) <= 48
    assert all(clause.isascii() and clause.strip(" .;") == clause for clause in clauses)


def test_what_is_written_on_a_filling_is_read_on_any_terminal() -> None:
    def light(number: int) -> float:
        shares = [share / 255 for share in palette_rgb(number)]
        each = [x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4 for x in shares]
        return 0.2126 * each[0] + 0.7152 * each[1] + 0.0722 * each[2]

    styles = {
        exits.POSITIVE_EXIT_STYLE,
        exits.NEGATIVE_EXIT_STYLE,
        *map(tiles.get_tile_style, range(1, 18)),
    }
    for style in styles:
        written, filling = map(int, re.findall(r"color\((\d+)\)", style))
        low, high = sorted([light(written), light(filling)])
        assert (high + 0.05) / (low + 0.05) >= 4.5, style  # the contrast of WCAG 2


def test_the_goal_is_of_the_problems_own_parameters_and_of_the_seat() -> None:
    def said(name: str, seat: int = 0, **changed: object) -> str:
        problem = dmplay.load_problem(name, **changed)
        return "; ".join(
            load_view_module(problem).goal_lines(Session(problem, SeededUniforms(1)).view(seat))
        )

    assert said("hexworld") == (
        "reach +10 or +5; keep off -10; a bump costs 1; 30% of steps slip aside"
    )
    assert said("hexworld", slip=0.0, bump_cost=2.5, rewards=[[[0, 0], 3]]) == (
        "reach +3; a bump costs 2.5"
    )
    assert "feeding 2.5; singing 0.5" in said("multicaregiver-crying-baby", 0)
    assert "feeding 5; singing 0.25" in said("multicaregiver-crying-baby", 1)
    assert said("predator-prey", 1, slip=0.0) == (
        "keep away: to be caught costs 100; moving is free"
    )


@pytest.mark.parametrize("problem", EVERYTHING)
def test_a_view_says_itself_in_plain_sentences(problem: Problem) -> None:
    style = load_view_module(problem)
    for turns in (0, 1, 5):
        game = played(problem, turns)
        for seat in range(len(problem.agents)):
            view = game.view(seat)
            words = [
                style.describe_situation(view),
                *(label + value for label, value in style.panel_rows(view)),
            ]
            words += [style.describe_turn(view)] if view.turns_played else []
            for sentence in words:
                assert "\n" not in sentence
                assert sentence.isascii()
            assert style.describe_situation(view).endswith(".")


@pytest.mark.parametrize("problem", EVERYTHING)
def test_every_action_has_a_key_and_every_key_an_action(problem: Problem) -> None:
    style = load_view_module(problem)
    for seat, labels in enumerate(problem.actions):
        if not isinstance(labels, tuple) or not isinstance(labels[0], str):
            continue
        if len(labels) > 10:
            continue  # a number is typed
        assert set(style.KEYS.values()) <= set(labels)
        for number in range(1, len(labels) + 1):
            assert find_action_by_key(problem, seat, str(number % 10)) == number - 1
        for key, label in style.KEYS.items():
            assert find_action_by_key(problem, seat, key) == labels.index(label)


def test_a_brought_game_tells_what_all_did_where_they_see_it_and_no_state_where_there_is_one() -> (
    None
):
    game = Session(ballet(), SeededUniforms(1))
    first, second = game.problem.agents
    assert generic.describe_situation(game.view(0)).startswith("actions: ")
    game.advance([0, 1])
    names = [game.problem.format_action(seat, action) for seat, action in enumerate((0, 1))]
    told = f"{first} chose {names[0]}; {second} chose {names[1]}."
    assert (generic.describe_turn(game.view(0)), generic.describe_turn(game.view(1))) == (
        told,
        told,
    )
    unseen = Session(team(), SeededUniforms(1))
    unseen.advance([0, 1])
    assert generic.describe_turn(unseen.view(0)).count("chose") == 1


def test_a_belief_in_many_states_is_told_of_the_likeliest_and_goes_on() -> None:
    view = Session(cheese(), SeededUniforms(1)).view(0)
    likeliest = "(0, 2) 0.100, (1, 2) 0.100, (2, 2) 0.100, ..."
    assert (
        generic.describe_situation(view) == f"nothing yet. belief: {likeliest} actions: n, e, s, w."
    )


def test_a_problem_without_a_word_of_its_own_has_a_goal_all_the_same() -> None:
    silent = type(
        "Silent", (type(dmplay.load_problem("crying-baby")),), {"description": lambda self: ""}
    )()
    view = Session(silent, SeededUniforms(7), turn_limit=1).view(0)
    assert generic.goal_lines(view) == [
        "gather the largest sum of rewards",
        "in 1 turn",
        "what comes a turn later counts 0.9 as much",
    ]
    assert "You want the largest sum of rewards" in generic.lesson(view)
