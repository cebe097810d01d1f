"""Tests of every view: its board, its fit in the viewport, and its plain-text descriptions."""

import re
from functools import cache

import numpy as np
import pytest
from wcwidth import wcswidth

import dmplay
from dmplay.core.problem import Problem
from dmplay.core.session import Session
from dmplay.core.tabular import tabulate
from dmplay.core.uniforms import SeededUniforms
from dmplay.draw.options import DrawOptions, Overlay
from dmplay.game.action_input import find_action_by_key
from dmplay.problems.game_2048 import view as tiles
from dmplay.problems.hexworld import view as exits
from dmplay.registry import problems
from dmplay.registry.builtin_names import problem_names
from dmplay.solvers.mdp import mdp_values
from dmplay.terminal.styles import palette_rgb
from dmplay.views import generic
from dmplay.views.protocol import fit_board, load_view_module
from tests.formats.sources import read_ballet, read_team
from tests.support.games import make_session
from tests.support.glyphs import ASCII_CHARACTERS, GLYPHS
from tests.support.literature_pomdps import make_cheese_maze
from tests.support.view_options import forecast_action

game_2048 = load_view_module(dmplay.load_problem("2048"))
hexworld = load_view_module(dmplay.load_problem("hexworld"))

VIEWPORT_SIZES = [(80, 24), (80, 12), (50, 14), (40, 8), (12, 2)]
MAX_GOAL_COLUMNS = 48  # fits a screen of 50 columns


PROBLEM_VARIANTS = [
    pytest.param(problem, id=f"{name}:{variant}" if variant else name)
    for name in problem_names()
    for variant, problem in problems.load_variants(name).items()
]


@cache
def play_randomly(problem: Problem, turns: int) -> Session:
    """Play a game of random agents; it is cached, and tests must not play it further."""
    agents = [dmplay.load_agent(problem, seat, "random") for seat in range(len(problem.agents))]
    game = Session(problem, SeededUniforms(5), agents)
    while len(game.turns) < turns and not game.over:
        game.advance()
    return game


def test_hexworld_in_compact_ascii_with_its_policy() -> None:
    problem = dmplay.load_problem("hexworld")
    q = mdp_values.compute_optimal_q(tabulate(problem), problem.discount)
    view = make_session("hexworld", [0.55], [0.0]).view(0)
    board = fit_board(hexworld, view, DrawOptions(50, 8, ascii=True, overlay=Overlay("policy", q)))
    assert (
        board.plain
        == r"""
 / \ / \ / \ / \ / \ / \ / \ / \ / \ / \
| SE| SW| SW| W | E | E | @ | E | SE| SW|
 \ / \ / \ / \ / \ / \ / \ / \ / \ / \ /
  | +5| W | NW| % | NE| %   % | E | SE|
 / \ / \ / \ / \   \ / \ / \ / \ / \ / \
| NE| NW|-10| NW| % | E | E | NE| % |+10|
 \ / \ / \ / \ /     \ / \ / \ /     \ /"""[1:]
    )


def test_hexworld_in_three_rows_of_dots() -> None:
    view = make_session("hexworld", [0.55], [0.0]).view(0)
    assert (
        fit_board(hexworld, view, DrawOptions(40, 3)).plain
        == """\
 .   .   .   .   .   .   @   .   .   .
   +5  .   .       .           .   .
 .   .  -10  .       .   .   .      +10"""
    )


def test_2048_with_its_new_tile_underlined() -> None:
    game = make_session("2048", [0.0, 0.0, 0.0, 0.9], [0.0, 0.0])
    game.advance([1])
    board = fit_board(game_2048, game.view(0), DrawOptions(80, 24))
    assert (
        board.plain
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
    underlined = [board.plain[s.start : s.end] for s in board.spans if "underline" in str(s.style)]
    assert underlined == ["2"]
    assert (
        fit_board(game_2048, game.view(0), DrawOptions(20, 4)).plain
        == """\
    2    ·    ·    ·
    ·    ·    ·    ·
    ·    ·    ·    ·
    2    4    ·    ·"""
    )


@pytest.mark.parametrize("problem", PROBLEM_VARIANTS)
@pytest.mark.parametrize("is_ascii", [False, True])
def test_every_view_fits_every_viewport_and_uses_allowed_glyphs(
    problem: Problem, is_ascii: bool
) -> None:
    view_module = load_view_module(problem)
    for turns in (0, 9):
        game = play_randomly(problem, turns)
        for seat in range(len(problem.agents)):
            view = game.view(seat)
            for width, height in VIEWPORT_SIZES[:: 1 + is_ascii]:
                options = DrawOptions(width, height, ascii=is_ascii, show_keys=True)
                board = fit_board(view_module, view, options)
                rows = board.plain.split("\n")
                assert max(map(len, rows)) <= width
                assert len(rows) <= height
                glyphs = {glyph for glyph in board.plain if not glyph.isascii()}
                assert not glyphs if is_ascii else glyphs <= GLYPHS
                assert all(wcswidth(glyph) == 1 for glyph in glyphs)


@pytest.mark.parametrize("problem", PROBLEM_VARIANTS)
@pytest.mark.parametrize("is_ascii", [False, True])
def test_hints_fit_every_viewport_and_use_allowed_glyphs(problem: Problem, is_ascii: bool) -> None:
    view_module, game = load_view_module(problem), play_randomly(problem, 3)
    for seat, actions in enumerate(problem.actions):
        view = game.view(seat)
        action_count = len(actions.labels)
        regret = np.where(
            view.legal_actions_mask is None or view.legal_actions_mask,
            np.arange(action_count) / 7,
            np.nan,
        )
        has_forecast = bool(action_count) and len(problem.agents) == 1 and not game.over
        large_options = DrawOptions(0, 0, ascii=is_ascii, allow_large=True)
        option_sets = (
            [large_options, large_options._replace(regret=regret)]
            if action_count
            else [large_options]
        )
        if has_forecast:
            first_legal = int(np.argmin(np.isnan(regret)))
            option_sets.append(large_options._replace(forecast=forecast_action(game, first_legal)))
        for options in option_sets:
            for width, height in VIEWPORT_SIZES[:: 1 + is_ascii]:
                board = fit_board(
                    view_module, view, options._replace(width=width, height=height)
                ).plain
                rows = board.split("\n")
                assert max(map(len, rows)) <= width
                assert len(rows) <= height
                assert {*board} - {"\n"} <= (
                    ASCII_CHARACTERS if is_ascii else ASCII_CHARACTERS | GLYPHS
                )


@pytest.mark.parametrize("problem", PROBLEM_VARIANTS)
def test_every_view_draws_a_board_in_common_terminal_sizes(problem: Problem) -> None:
    view_module = load_view_module(problem)
    view = play_randomly(problem, 3).view(0)
    for width, height in ((80, 18), (50, 9), (40, 8)):
        assert "need" not in fit_board(view_module, view, DrawOptions(width, height)).plain


@pytest.mark.parametrize("problem", PROBLEM_VARIANTS)
def test_a_view_lists_the_most_important_goal_first(problem: Problem) -> None:
    view = play_randomly(problem, 0).view(0)
    clauses = load_view_module(problem).goal_lines(view)
    advice = "see goal_lines in the view of the problem"
    assert len(clauses[0]) <= MAX_GOAL_COLUMNS, (
        f"the first goal has {len(clauses[0])} characters, expected at most {MAX_GOAL_COLUMNS}: "
        f"{clauses[0]!r}; {advice}"
    )
    for clause in clauses:
        assert clause.isascii(), f"not ASCII: {clause!r}; {advice}"
        assert clause.strip(" .;") == clause, (
            f"a goal is a clause without a full stop or spaces around it: {clause!r}; {advice}"
        )


def test_text_on_filled_cells_has_enough_contrast() -> None:
    def light(number: int) -> float:
        channels = [channel / 255 for channel in palette_rgb(number)]
        linear = [x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4 for x in channels]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    styles = {
        exits.POSITIVE_EXIT_STYLE,
        exits.NEGATIVE_EXIT_STYLE,
        *map(tiles.get_tile_style, range(1, 18)),
    }
    for style in styles:
        text_color, fill_color = map(int, re.findall(r"color\((\d+)\)", style))
        darker, lighter = sorted([light(text_color), light(fill_color)])
        assert (lighter + 0.05) / (darker + 0.05) >= 4.5, style  # minimum contrast ratio of WCAG 2


def test_the_goal_depends_on_the_parameters_and_the_seat() -> None:
    def describe_start(name: str, seat: int = 0, **parameters: object) -> str:
        problem = dmplay.load_problem(name, **parameters)
        return "; ".join(
            load_view_module(problem).goal_lines(Session(problem, SeededUniforms(1)).view(seat))
        )

    assert describe_start("hexworld") == (
        "reach exit +10 or +5; avoid exit -10; a bump costs 1; 30% of steps slip"
    )
    assert describe_start("hexworld", slip=0.0, bump_cost=2.5, rewards=[[[0, 0], 3]]) == (
        "reach exit +3; a bump costs 2.5"
    )
    for seat, costs in enumerate(("feeding 2.5, singing 0.5", "feeding 5, singing 0.25")):
        assert costs in describe_start("multicaregiver-crying-baby", seat)
    assert describe_start("predator-prey", 1, slip=0.0) == (
        "avoid predators: being caught costs 100; moves and bumps into walls are free; "
        "once caught, you reappear on a random hex"
    )


@pytest.mark.parametrize("problem", PROBLEM_VARIANTS)
def test_descriptions_are_plain_ascii_sentences(problem: Problem) -> None:
    view_module = load_view_module(problem)
    for turns in (0, 1, 5):
        game = play_randomly(problem, turns)
        for seat in range(len(problem.agents)):
            view = game.view(seat)
            sentences = [
                view_module.describe_situation(view),
                *(label + value for label, value in view_module.panel_rows(view)),
            ]
            sentences += [view_module.describe_turn(view)] if view.turns_played else []
            for sentence in sentences:
                assert "\n" not in sentence
                assert sentence.isascii()
            assert view_module.describe_situation(view).endswith(".")


@pytest.mark.parametrize("problem", PROBLEM_VARIANTS)
def test_every_action_has_a_key_and_every_key_an_action(problem: Problem) -> None:
    view_module = load_view_module(problem)
    for seat, labels in enumerate(problem.actions):
        if not isinstance(labels, tuple) or not isinstance(labels[0], str):
            continue
        if len(labels) > 10:
            continue  # the player types a number
        assert set(view_module.KEYS.values()) <= set(labels)
        for number in range(1, len(labels) + 1):
            assert find_action_by_key(problem, seat, str(number % 10)) == number - 1
        for key, label in view_module.KEYS.items():
            assert find_action_by_key(problem, seat, key) == labels.index(label)


def test_a_user_defined_game_describes_only_actions_that_a_seat_observes() -> None:
    game = Session(read_ballet(), SeededUniforms(1))
    first, second = game.problem.agents
    assert generic.describe_situation(game.view(0)).startswith("actions: ")
    game.advance([0, 1])
    names = [game.problem.format_action(seat, action) for seat, action in enumerate((0, 1))]
    description = f"{first} chose {names[0]}; {second} chose {names[1]}."
    assert (generic.describe_turn(game.view(0)), generic.describe_turn(game.view(1))) == (
        description,
        description,
    )
    team_game = Session(read_team(), SeededUniforms(1))
    team_game.advance([0, 1])
    assert generic.describe_turn(team_game.view(0)).count("chose") == 1


def test_a_large_belief_is_described_by_its_likeliest_states() -> None:
    view = Session(make_cheese_maze(), SeededUniforms(1)).view(0)
    likeliest = "(0, 2) 0.100, (1, 2) 0.100, (2, 2) 0.100, ..."
    assert (
        generic.describe_situation(view) == f"nothing yet. belief: {likeliest} actions: n, e, s, w."
    )


def test_a_problem_without_a_description_has_a_default_goal() -> None:
    problem = type(
        "Silent", (type(dmplay.load_problem("crying-baby")),), {"description": lambda self: ""}
    )()
    view = Session(problem, SeededUniforms(7), turn_limit=1).view(0)
    assert generic.goal_lines(view) == [
        "get the largest sum of rewards",
        "in 1 turn",
        "a reward one turn later counts 0.9 times as much",
    ]
    assert "You want the largest sum of rewards" in generic.lesson(view)
