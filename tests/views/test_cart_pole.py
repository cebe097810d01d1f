"""What a person sees of a cart and its pole, frame by frame."""

import dmplay
from dmplay.session import Session
from dmplay.views.style import Look, fit, style_of
from tests.support.games import started

cart_pole = style_of(dmplay.load("cart-pole"))


def leaning() -> Session:
    return started("cart-pole", [1.0, 0.4, 0.18, 0.6], [1])


def test_cart_pole_leans_to_its_right() -> None:
    view = leaning().view(0)
    assert (
        fit(cart_pole, view, Look(80, 24)).plain
        == """
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

x +1.01/2.4 m  v +0.59 m/s  th +11.0/12 deg  om +21 deg/s"""[1:]
    )


def test_cart_pole_in_ascii_is_still_a_cart() -> None:
    view = leaning().view(0)
    assert (
        fit(cart_pole, view, Look(80, 24, ascii=True)).plain
        == """
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

x +1.01/2.4 m  v +0.59 m/s  th +11.0/12 deg  om +21 deg/s"""[1:]
    )


def test_cart_pole_in_a_small_room() -> None:
    view = leaning().view(0)
    assert (
        fit(cart_pole, view, Look(40, 12)).plain
        == """

                           ●
                           ╱
                          │
                        ┌─┴─┐
                       →└o─o┘
   ╋━━━━━━━━━━━━━━━┷━━━━━━━━━━━━━━━╋
x +1.01/2.4 v +0.59 th +11.0/12 om +21"""[1:]
    )


def test_cart_pole_in_a_small_room_in_ascii() -> None:
    view = leaning().view(0)
    assert (
        fit(cart_pole, view, Look(40, 12, ascii=True)).plain
        == """

                           *
                           /
                          |
                        +-+-+
                       >+o-o+
   #===============^===============#
x +1.01/2.4 v +0.59 th +11.0/12 om +21"""[1:]
    )


def test_cart_pole_in_six_rows() -> None:
    view = leaning().view(0)
    assert (
        fit(cart_pole, view, Look(40, 6)).plain
        == """
                           ●
                          │
                        ┌─┴─┐
                       →└o─o┘
   ╋━━━━━━━━━━━━━━━┷━━━━━━━━━━━━━━━╋
x +1.01/2.4 v +0.59 th +11.0/12 om +21"""[1:]
    )


def test_a_pole_that_fell_is_crossed_out_at_its_limit() -> None:
    view = started("cart-pole", [1.0, 0.4, -0.2, -0.6], [1]).view(0)
    assert (
        fit(cart_pole, view, Look(80, 24)).plain
        == """
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

x +1.01/2.4 m  v +0.60 m/s  th -12.1>12 deg  om -54 deg/s"""[1:]
    )


def test_a_cart_that_left_its_track_stands_beyond_it() -> None:
    view = started("cart-pole", [-2.39, -1.0, -0.05, -0.6], [0]).view(0)
    assert (
        fit(cart_pole, view, Look(40, 12)).plain
        == """

  ●
  │
  │
┌─┴─┐
└o─o┘←
   ✗━━━━━━━━━━━━━━━┷━━━━━━━━━━━━━━━╋
x -2.41>2.4 v -1.19 th -3.6/12 om -19"""[1:]
    )


def test_a_standing_pole_is_told_with_its_limits() -> None:
    view = leaning().view(0)
    assert cart_pole.told(view) == (
        "stands. pushed right. x +1.01 m, v +0.59 m/s, theta +11.0 deg, omega +21 deg/s."
    )
    assert cart_pole.situation(view) == (
        "stands. x +1.01 m, v +0.59 m/s, theta +11.0 deg, omega +21 deg/s. fails past 2.4"
        " m or 12 deg."
    )


def test_a_fallen_pole_is_told_first() -> None:
    view = started("cart-pole", [1.0, 0.4, -0.2, -0.6], [1]).view(0)
    assert cart_pole.told(view) == (
        "fell to the left. pushed right. x +1.01 m, v +0.60 m/s, theta -12.1 deg, omega -54 deg/s."
    )
    assert cart_pole.situation(view) == (
        "fell to the left. x +1.01 m, v +0.60 m/s, theta -12.1 deg, omega -54 deg/s. "
        "fails past 2.4 m or 12 deg."
    )


def test_a_cart_off_its_track_is_told_first() -> None:
    view = started("cart-pole:gym", [2.39, 1.0, 0.05, 0.6], [1]).view(0)
    assert cart_pole.told(view) == (
        "off the track on the right. pushed right. x +2.41 m, v +1.19 m/s, theta +3.6 "
        "deg, omega +19 deg/s."
    )
    assert cart_pole.situation(view) == (
        "off the track on the right. x +2.41 m, v +1.19 m/s, theta +3.6 deg, omega +19 "
        "deg/s. fails past 2.4 m or 12 deg."
    )


def test_the_panel_has_units_and_limits() -> None:
    view = leaning().view(0)
    assert cart_pole.panel(view) == [
        ("x", "+1.01 m"),
        ("v", "+0.59 m/s"),
        ("theta", "+11.0 deg"),
        ("omega", "+21 deg/s"),
        ("fails", "2.4 m"),
        ("or", "12 deg"),
        ("last", "right"),
        ("force", "10 N"),
    ]
