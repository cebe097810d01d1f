from functools import partial

import numpy as np

import dmplay
from dmplay.draw.canvas import Canvas
from dmplay.draw.options import DrawOptions
from dmplay.problems.machine_replacement.view import _draw_small_triangle
from dmplay.views.protocol import fit_board, load_view_module
from tests.support import games

machine_replacement = load_view_module(dmplay.load_problem("machine-replacement"))

make_view_after = partial(games.make_view_after, "machine-replacement")


def test_the_board_at_the_start() -> None:
    board = fit_board(machine_replacement, make_view_after(), DrawOptions(80, 24)).plain
    assert (
        board
        == """\
saw  nothing yet                                0 ●
                                                ╱   ╲
0 failed  ████████████████████ 1.000          ╱       ╲
1 failed  ···················· 0.000        ╱           ╲
2 failed  ···················· 0.000    1 ╱───────────────╲ 2
chance of failed parts, turn by turn ▁

average pay now
m manufacture +0.90
e examine     +0.65
i interrupt   -0.50
r replace     -2.00"""
    )


def test_a_defect_moves_the_dot_down_the_triangle() -> None:
    board = fit_board(
        machine_replacement,
        make_view_after(*["manufacture"] * 6, "examine", seed=11),
        DrawOptions(80, 24, ascii=True),
    ).plain
    assert (
        board
        == r"""
saw  defective                                    0
                                                /   \
0 failed  .................... 0.000          /       \
1 failed  ###########......... 0.550        /           \
2 failed  #########........... 0.450    1 /------*--------\ 2
chance of failed parts, turn by turn _.:-=++#

average pay now
m manufacture +0.37
e examine     +0.12
i interrupt   -1.95
r replace     -2.00"""[1:]
    )


def test_a_small_board_with_the_true_state() -> None:
    board = fit_board(
        machine_replacement,
        make_view_after("manufacture", "manufacture"),
        DrawOptions(40, 8, revealed_state=np.array(1)),
    ).plain
    assert (
        board
        == """\
saw  nondefective (no clue: unexamined)
0 failed  █████████████▏······ 0.656
1 failed  ██████▏············· 0.308
2 failed  ▊··················· 0.036
m +0.75  e +0.50  i -0.88  r -2.00
true state: 1 failed"""
    )


def test_the_corners_of_the_triangle_are_certain_beliefs() -> None:
    canvas = Canvas()
    _draw_small_triangle(canvas, 0, np.array([0.0, 1.0, 0.0]))
    _draw_small_triangle(canvas, 25, np.array([0.0, 0.0, 1.0]))
    assert canvas.to_text().plain.split("\n")[4] == "1 ●───────────────╲ 2    1 ╱───────────────● 2"


def test_descriptions_include_the_belief_and_the_expected_rewards() -> None:
    view = make_view_after("manufacture")
    assert machine_replacement.describe_turn(view) == (
        "chose manufacture, saw nondefective (no clue: unexamined). "
        "belief: 0 failed 0.810, 1 failed 0.180, 2 failed 0.010."
    )
    assert machine_replacement.describe_situation(make_view_after()) == (
        "saw nothing yet. belief: 0 failed 1.000, 1 failed 0.000, 2 failed 0.000. expected reward "
        "now: manufacture 0.90, examine 0.65, interrupt -0.50, replace -2.00."
    )


def test_the_board_has_the_probability_of_a_failure_and_of_a_defective_product() -> None:
    board = fit_board(
        machine_replacement, make_view_after(), DrawOptions(80, 24, allow_large=True)
    ).plain
    assert "a working part fails: 10% (m, e)" in board
    assert "e: defective 50%, 75% with 1, 2 failed" in board
