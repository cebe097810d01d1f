"""Tests of the cart-pole view, frame by frame."""

import pytest

import dmplay
from dmplay.core.session import Session, View
from dmplay.draw.options import DrawOptions
from dmplay.problems.cart_pole.rules import CartPole
from dmplay.views.protocol import fit_board, load_view_module
from tests.support.games import make_session_from_state

cart_pole = load_view_module(dmplay.load_problem("cart-pole"))


def make_leaning_game() -> Session:
    return make_session_from_state("cart-pole", [1.0, 0.4, 0.18, 0.6], [1])


@pytest.mark.parametrize(
    ("view", "outcome", "danger", "push", "numbers"),
    [
        (make_leaning_game().view(0), "the pole still stands",
         ", but falls right fast: past the limit in about 3 turns", "right",
         "position +1.01 m, speed +0.59 m/s, angle +11.0 deg, swing +21 deg/s"),
        (make_session_from_state("cart-pole", [1.0, 0.4, -0.2, -0.6], [1]).view(0),
         "the pole fell to the left", "", "right",
         "position +1.01 m, speed +0.60 m/s, angle -12.1 deg, swing -54 deg/s"),
        (make_session_from_state("cart-pole:gym", [2.39, 1.0, 0.05, 0.6], [1]).view(0),
         "the cart left the track on the right", "", "right",
         "position +2.41 m, speed +1.19 m/s, angle +3.6 deg, swing +19 deg/s"),
    ],
)  # fmt: skip
def test_the_push_is_described_before_the_pole_and_the_limits_are_last(
    view: View[CartPole], outcome: str, danger: str, push: str, numbers: str
) -> None:
    assert cart_pole.describe_turn(view) == f"pushed {push}: {outcome}{danger}. {numbers}."
    assert (
        cart_pole.describe_situation(view)
        == f"{outcome}. {numbers}. the game ends beyond 2.4 m or 12 deg."
    )


def test_the_panel_shows_units_and_the_balanced_time() -> None:
    view = make_leaning_game().view(0)
    assert cart_pole.panel_rows(view) == [
        ("x", "+1.01 m"), ("speed", "+0.59 m/s"), ("angle", "+11.0 deg"),
        ("swing", "+21 deg/s"), ("time", "0.02 s"), ("last", "right"), ("force", "10 N"),
    ]  # fmt: skip


FRAMES = {
    "cart pole leans to its right": (make_leaning_game().view(0), DrawOptions(80, 24), """
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
    "cart pole in ascii is still a cart": (
        make_leaning_game().view(0),
        DrawOptions(80, 24, ascii=True),
        """
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

x +1.01/2.4 m  v +0.59 m/s  th +11.0/12 deg  om +21 deg/s""",
    ),
    "cart pole in a small room": (make_leaning_game().view(0), DrawOptions(40, 12), """

                           ●
                           ╱
                          │
                        ┌─┴─┐
                       →└o─o┘
   ╋━━━━━━━━━━━━━━━┷━━━━━━━━━━━━━━━╋
x +1.01/2.4 v +0.59 th +11.0/12 om +21"""),
    "cart pole in a small room in ascii": (
        make_leaning_game().view(0),
        DrawOptions(40, 12, ascii=True),
        """

                           *
                           /
                          |
                        +-+-+
                       >+o-o+
   #===============^===============#
x +1.01/2.4 v +0.59 th +11.0/12 om +21""",
    ),
    "cart pole in six rows": (make_leaning_game().view(0), DrawOptions(40, 6), """
                           ●
                          │
                        ┌─┴─┐
                       →└o─o┘
   ╋━━━━━━━━━━━━━━━┷━━━━━━━━━━━━━━━╋
x +1.01/2.4 v +0.59 th +11.0/12 om +21"""),
    "a pole that fell is crossed out at its limit": (
        make_session_from_state("cart-pole", [1.0, 0.4, -0.2, -0.6], [1]).view(0),
        DrawOptions(80, 24),
        """
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

x +1.01/2.4 m  v +0.60 m/s  th -12.1>12 deg  om -54 deg/s""",
    ),
    "a cart that left its track stands beyond it": (
        make_session_from_state("cart-pole", [-2.39, -1.0, -0.05, -0.6], [0]).view(0),
        DrawOptions(40, 12),
        """

  ●
  │
  │
┌─┴─┐
└o─o┘←
   ✗━━━━━━━━━━━━━━━┷━━━━━━━━━━━━━━━╋
x -2.41>2.4 v -1.19 th -3.6/12 om -19""",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", FRAMES)
def test_a_cart_and_its_pole_are_drawn(case: str) -> None:
    view, options, expected = FRAMES[case]
    assert fit_board(cart_pole, view, options).plain == expected[1:]
