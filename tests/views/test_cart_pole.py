"""What a person sees of a cart and its pole, frame by frame."""

import pytest

import dmplay
from dmplay.problems.cart_pole import CartPole
from dmplay.session import Session, View
from dmplay.views.style import DrawOptions, fit_board, load_view_module
from tests.support.games import started

cart_pole = load_view_module(dmplay.load_problem("cart-pole"))


def leaning() -> Session:
    return started("cart-pole", [1.0, 0.4, 0.18, 0.6], [1])


@pytest.mark.parametrize(
    ("view", "fate", "push", "numbers"),
    [
        (leaning().view(0), "stands", "right",
         "place +1.01 m, speed +0.59 m/s, lean +11.0 deg, swing +21 deg/s"),
        (started("cart-pole", [1.0, 0.4, -0.2, -0.6], [1]).view(0), "fell to the left", "right",
         "place +1.01 m, speed +0.60 m/s, lean -12.1 deg, swing -54 deg/s"),
        (started("cart-pole:gym", [2.39, 1.0, 0.05, 0.6], [1]).view(0),
         "off the track on the right", "right",
         "place +2.41 m, speed +1.19 m/s, lean +3.6 deg, swing +19 deg/s"),
    ],
)  # fmt: skip
def test_how_the_pole_fares_is_told_first_and_its_limits_last(
    view: View[CartPole], fate: str, push: str, numbers: str
) -> None:
    assert cart_pole.describe_turn(view) == f"{fate}. pushed {push}. {numbers}."
    assert cart_pole.describe_situation(view) == f"{fate}. {numbers}. fails past 2.4 m or 12 deg."


def test_the_panel_has_units_and_how_long_the_pole_stood() -> None:
    view = leaning().view(0)
    assert cart_pole.panel_rows(view) == [
        ("place", "+1.01 m"), ("speed", "+0.59 m/s"), ("lean", "+11.0 deg"),
        ("swings", "+21 deg/s"), ("stood", "0.02 s"), ("last", "right"), ("force", "10 N"),
    ]  # fmt: skip


FRAMES = {
    "cart pole leans to its right": (leaning().view(0), DrawOptions(80, 24), """
                                           ●
                                           │
                                           ╱
                                          │
                                          ╱
                                         │
                                       ┌─┴─┐
                                      →└o─o┘
   ╋━━━━━━━━━━━━━━━━━━━━━━━━━━┷━━━━━━━━━━━━━━━━━━━━━━━━━━╋
-2.4                          x                        +2.4 m
   ├┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┼┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄●┄┤
-12                         theta                     +12 deg

x +1.01/2.4 m  v +0.59 m/s  th +11.0/12 deg  om +21 deg/s"""),
    "cart pole in ascii is still a cart": (leaning().view(0), DrawOptions(80, 24, ascii=True), """
                                           *
                                           |
                                           /
                                          |
                                          /
                                         |
                                       +-+-+
                                      >+o-o+
   #==========================^==========================#
-2.4                          x                        +2.4 m
   +--------------------------+------------------------*-+
-12                         theta                     +12 deg

x +1.01/2.4 m  v +0.59 m/s  th +11.0/12 deg  om +21 deg/s"""),
    "cart pole in a small room": (leaning().view(0), DrawOptions(40, 12), """

                           ●
                           ╱
                          │
                        ┌─┴─┐
                       →└o─o┘
   ╋━━━━━━━━━━━━━━━┷━━━━━━━━━━━━━━━╋
x +1.01/2.4 v +0.59 th +11.0/12 om +21"""),
    "cart pole in a small room in ascii": (leaning().view(0), DrawOptions(40, 12, ascii=True), """

                           *
                           /
                          |
                        +-+-+
                       >+o-o+
   #===============^===============#
x +1.01/2.4 v +0.59 th +11.0/12 om +21"""),
    "cart pole in six rows": (leaning().view(0), DrawOptions(40, 6), """
                           ●
                          │
                        ┌─┴─┐
                       →└o─o┘
   ╋━━━━━━━━━━━━━━━┷━━━━━━━━━━━━━━━╋
x +1.01/2.4 v +0.59 th +11.0/12 om +21"""),
    "a pole that fell is crossed out at its limit": (
        started("cart-pole", [1.0, 0.4, -0.2, -0.6], [1]).view(0), DrawOptions(80, 24), """
                                      ●
                                       │
                                       ╲
                                        │
                                        ╲
                                         │
                                       ┌─┴─┐
                                      →└o─o┘
   ╋━━━━━━━━━━━━━━━━━━━━━━━━━━┷━━━━━━━━━━━━━━━━━━━━━━━━━━╋
-2.4                          x                        +2.4 m
   ✗┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┼┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┤
-12                         theta                     +12 deg

x +1.01/2.4 m  v +0.60 m/s  th -12.1>12 deg  om -54 deg/s"""),
    "a cart that left its track stands beyond it": (
        started("cart-pole", [-2.39, -1.0, -0.05, -0.6], [0]).view(0), DrawOptions(40, 12), """

  ●
  │
  │
┌─┴─┐
└o─o┘←
   ✗━━━━━━━━━━━━━━━┷━━━━━━━━━━━━━━━╋
x -2.41>2.4 v -1.19 th -3.6/12 om -19"""),
}  # fmt: skip


@pytest.mark.parametrize("what", FRAMES)
def test_a_cart_and_its_pole_are_drawn(what: str) -> None:
    view, look, board = FRAMES[what]
    assert fit_board(cart_pole, view, look).plain == board[1:]
