"""Tests of the mountain-car view, frame by frame."""

import pytest

import dmplay
from dmplay.core.session import Session
from dmplay.draw.options import DrawOptions
from dmplay.views.protocol import fit_board, load_view_module
from tests.support.games import make_session_from_state

mountain_car = load_view_module(dmplay.load_problem("mountain-car"))


def make_rolling_game() -> Session:
    return make_session_from_state("mountain-car", [-0.9, -0.05], [1])


def test_a_rolling_car_is_described_with_its_goal() -> None:
    view = make_rolling_game().view(0)
    assert (
        mountain_car.describe_turn(view)
        == "coasted, now rolls left uphill at -0.0477, position -0.948."
    )
    assert mountain_car.describe_situation(view) == (
        "rolls left uphill at -0.0477, position -0.948. height -0.29. goal x >= 0.6."
    )


def test_the_description_says_that_a_car_is_at_its_goal() -> None:
    view = make_session_from_state("mountain-car", [0.58, 0.05], [2]).view(0)
    assert mountain_car.describe_turn(view) == "drove right, now at the goal, position +0.600."
    assert (
        mountain_car.describe_situation(view)
        == "at the goal, position +0.600. height +0.97. goal x >= 0.6."
    )


def test_a_car_at_the_left_wall_keeps_rolling() -> None:
    view = make_session_from_state("mountain-car", [-1.17, -0.06], [0]).view(0)
    assert (
        mountain_car.describe_turn(view)
        == "drove left, now at the left wall, until its speed, -0.0587, turns positive; "
        "driving right leaves it soonest."
    )
    assert mountain_car.describe_situation(view) == (
        "at the left wall, until its speed, -0.0587, turns positive; driving right leaves it "
        "soonest. height +0.44. goal x >= 0.6."
    )


def test_a_car_at_the_left_wall_of_gym_stops() -> None:
    view = make_session_from_state("mountain-car:gym", [-1.17, -0.06], [0]).view(0)
    assert (
        mountain_car.describe_turn(view)
        == "drove left, now at the left wall, stopped; driving right leaves it soonest."
    )
    assert mountain_car.describe_situation(view) == (
        "at the left wall, stopped; driving right leaves it soonest. "
        "height +0.44. goal x >= 0.5 and v >= 0."
    )


def test_the_panel_shows_the_state() -> None:
    view = make_session_from_state("mountain-car:gym", [-1.17, -0.06], [0]).view(0)
    assert mountain_car.panel_rows(view) == [
        ("position", "-1.200"), ("speed", "+0.0000"), ("height", "+0.44"), ("last", "left"),
    ]  # fmt: skip


FRAMES = {
    "the car rolls up the hill behind it": (make_rolling_game().view(0), DrawOptions(80, 24), """
│                                                           F
│                                                           │
│                                                  ▂▄▅▆▇████▇
│                                              ▁▃▆███████████
│▄▁                                          ▃▆██████████████
│██▆▃                                     ▁▅█████████████████
│████▇▄▁                                ▃▆███████████████████
│███████▅●                           ▁▄██████████████████████
│█████████▇·▁                      ▃▆████████████████████████
│████████████▇▄▂               ▁▃▆███████████████████████████
│███████████████▇▆▄▃▂▁▁▁▁▁▁▂▃▅▇██████████████████████████████
-1.2                 -0.52                           goal 0.6
 ├┄┄┄┄┄┄┄┄●┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┼┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┤
-0.07                         v                         +0.07

x -0.948  v -0.0477  last: coast   goal x >= 0.6"""),
    "the car in ascii is unlike its hill": (
        make_rolling_game().view(0),
        DrawOptions(80, 24, ascii=True),
        """
|                                                           F
|                                                           |
|                                                  _-==######
|                                              _-=###########
|-_                                          -=##############
|##=-                                     _=#################
|#####-_                                -=###################
|#######=*                           _-######################
|##########._                      -=########################
|#############-_               _-=###########################
|################=--________-=###############################
-1.2                 -0.52                           goal 0.6
 +--------*-------------------+----------------------------+
-0.07                         v                         +0.07

x -0.948  v -0.0477  last: coast   goal x >= 0.6""",
    ),
    "the car in a small room": (make_rolling_game().view(0), DrawOptions(40, 12), """
│                                     F
│                                     │
│                              ▂▄▆▇███▇
│▅▂                         ▃▅█████████
│██▇▄▁●                  ▂▅████████████
│█████▇·▁             ▂▄▇██████████████
│████████▇▅▃▂▁▁▁▁▁▂▃▅▇█████████████████
x -0.948  v -0.0477  goal x >= 0.6"""),
    "the car in a small room in ascii": (
        make_rolling_game().view(0),
        DrawOptions(40, 12, ascii=True),
        """
|                                     F
|                                     |
|                              _-=#####
|=_                         -=#########
|###-_*                  _=############
|######._             _-###############
|#########=-_______-=##################
x -0.948  v -0.0477  goal x >= 0.6""",
    ),
    "the car at its flag": (
        make_session_from_state("mountain-car", [0.58, 0.05], [2]).view(0),
        DrawOptions(80, 24),
        """
│                                                           F
│                                                          ·●
│                                                  ▂▄▅▆▇████▇
│                                              ▁▃▆███████████
│▄▁                                          ▃▆██████████████
│██▆▃                                     ▁▅█████████████████
│████▇▄▁                                ▃▆███████████████████
│███████▅▂                           ▁▄██████████████████████
│█████████▇▄▁                      ▃▆████████████████████████
│████████████▇▄▂               ▁▃▆███████████████████████████
│███████████████▇▆▄▃▂▁▁▁▁▁▁▂▃▅▇██████████████████████████████
-1.2                 -0.52                           goal 0.6
 ├┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┼┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄●┄┄┄┄┄┄┄┤
-0.07                         v                         +0.07

x +0.600  v +0.0514  last: right   goal x >= 0.6""",
    ),
    "the flag of gym stands before the end and its wall stops the car": (
        make_session_from_state("mountain-car:gym", [-1.17, -0.06], [0]).view(0),
        DrawOptions(40, 12),
        """
│                                   F
│                                   │
│●                             ▂▄▆▇███▇
│▅·                         ▃▅█████████
│██▇▄▁                   ▂▅████████████
│█████▇▄▁             ▂▄▇██████████████
│████████▇▅▃▂▁▁▁▁▁▂▃▅▇█████████████████
x -1.200  v +0.0000  goal x >= 0.5""",
    ),
    "the car at its flag in six rows": (
        make_session_from_state("mountain-car", [0.58, 0.05], [2]).view(0),
        DrawOptions(40, 6),
        """
│                                     ●
│                             ▁▃▅▆▇████
│▇▅▃                      ▁▃▅▇█████████
│████▆▄▂               ▂▄▆█████████████
│███████▇▆▄▃▁▁▁▁▁▁▂▃▄▆█████████████████
x +0.600  v +0.0514  goal x >= 0.6""",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", FRAMES)
def test_a_car_on_its_hill_is_drawn(case: str) -> None:
    view, options, expected = FRAMES[case]
    assert fit_board(mountain_car, view, options).plain == expected[1:]
