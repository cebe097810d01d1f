"""Tests of the collision-avoidance view, frame by frame."""

import pytest

import dmplay
from dmplay.core.session import Session
from dmplay.draw.options import DrawOptions
from dmplay.views.protocol import fit_board, load_view_module
from tests.support.games import make_session_from_state

collision_avoidance = load_view_module(dmplay.load_problem("collision-avoidance"))


def make_advised_game() -> Session:
    return make_session_from_state(
        "collision-avoidance",
        [40.0, -3.0, 0.0, 40.0],
        [1, 1, 1, 2, 2, 2, 2, 0, 0, 1],
        *[[0.5]] * 8,
        *[[0.1]] * 2,
    )


def make_collided_game() -> Session:
    return make_session_from_state(
        "collision-avoidance", [-20.0, -3.0, 0.0, 3.0], [0, 2, 2, 2], [0.5], [0.5], [0.5], [0.5]
    )


CLEAR_DESCRIPTION = "clear course: at this rate 301 m above aircraft A."


@pytest.mark.parametrize(
    ("game", "turn_description", "situation"),
    [
        (
            make_collided_game(),
            "kept climb (free). height -30 m, rate -2.0 m/s, 0 s left. "
            "collision: passed 30 m below aircraft A.",
            "collision: passed 30 m below aircraft A. "
            "height -30 m, rate -2.0 m/s, 0 s left. advisory: climb.",
        ),
        (
            make_session_from_state(
                "collision-avoidance", [300.0, 0.0, 0.0, 20.0], [2, 0], [0.5], [0.5]
            ),
            "changed the advisory to descend (costs 0.01). height +301 m, rate +0.0 m/s, "
            f"18 s left. {CLEAR_DESCRIPTION}",
            f"{CLEAR_DESCRIPTION} height +301 m, rate +0.0 m/s, 18 s left. advisory: descend.",
        ),
        (
            make_session_from_state("collision-avoidance", [300.0, 0.0, 0.0, 20.0], [0], [0.9]),
            "changed the advisory to descend (costs 0.01); a gust raised the rate by 2 m/s. "
            "height +300 m, rate +1.0 m/s, 19 s left. "
            "clear course: at this rate 319 m above aircraft A.",
            "clear course: at this rate 319 m above aircraft A. "
            "height +300 m, rate +1.0 m/s, 19 s left. advisory: descend.",
        ),
    ],
)
def test_collisions_and_reversed_advisories_are_described(
    game: Session, turn_description: str, situation: str
) -> None:
    view = game.view(0)
    assert collision_avoidance.describe_turn(view) == turn_description
    assert collision_avoidance.describe_situation(view) == situation


def test_the_panel_shows_height_rate_time_and_advisory() -> None:
    view = make_advised_game().view(0)
    assert collision_avoidance.panel_rows(view) == [
        ("height", "+23 m"), ("rate", "-5.0 m/s"), ("pass in", "30 s"), ("advisory", "no-advisory"),
    ]  # fmt: skip


FRAMES = {
    "the encounter with every advisory": (make_advised_game().view(0), DrawOptions(80, 24), """
 +100


  +50                                        ▒▒
      ···↑↑↑↑↓↓·                             ▒▒
                ◆ ∘                          ▒▒
    0 ┄┄┄┄┄┄┄┄┄┄┄┄┄┄∘┄∘┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄▒A
                        ∘                    ▒▒
                          ∘ ∘                ▒▒
  -50                         ∘ ∘            ▒▒
                                  ∘
                                    ∘ ∘
 -100                                   ∘
     40s       30s       20s       10s       0s
◆ h +23 m  dh -5.0 m/s  30 s  none
at this rate 127 m below A: clear"""),
    "the encounter in ascii": (make_advised_game().view(0), DrawOptions(80, 24, ascii=True), """
 +100


  +50                                        ::
      ...^^^^vv.                             ::
                + o                          ::
    0 --------------o-o----------------------:A
                        o                    ::
                          o o                ::
  -50                         o o            ::
                                  o
                                    o o
 -100                                   o
     40s       30s       20s       10s       0s
+ h +23 m  dh -5.0 m/s  30 s  none
at this rate 127 m below A: clear"""),
    "the encounter in a small room": (make_advised_game().view(0), DrawOptions(40, 12), """
 +100
  +50 ··↑↑↑↓↓·                      ▒▒
    0 ┄┄┄┄┄┄┄┄◆┄∘┄∘┄∘┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄▒A
  -50                 ∘ ∘ ∘ ∘       ▒▒
 -100                         ∘ ∘
     40s     30s     20s    10s     0s
◆ h +23 m  dh -5.0 m/s  30 s  none
at this rate 127 m below A: clear"""),
    "the encounter in a small room in ascii": (
        make_advised_game().view(0),
        DrawOptions(40, 12, ascii=True),
        """
 +100
  +50 ..^^^vv.                      ::
    0 --------+-o-o-o---------------:A
  -50                 o o o o       ::
 -100                         o o
     40s     30s     20s    10s     0s
+ h +23 m  dh -5.0 m/s  30 s  none
at this rate 127 m below A: clear""",
    ),
    "the encounter after a collision": (make_collided_game().view(0), DrawOptions(80, 12), """
 +100

  +50                                        ▒▒
                                             ▒▒
    0 ┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄▒A
                                           ↓↑↑◆
  -50                                        ▒▒

 -100
     40s       30s       20s       10s       0s
◆ h -30 m  dh -2.0 m/s  0 s  climb
passed 30 m below A: COLLISION"""),
    "the encounter in six rows": (make_collided_game().view(0), DrawOptions(40, 6), """
 +100
  +50                               ▒▒
    0 ┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄↑▒A
  -50                               ↑◆
 -100
passed 30 m below A: COLLISION"""),
}  # fmt: skip


@pytest.mark.parametrize("case", FRAMES)
def test_an_encounter_is_drawn(case: str) -> None:
    view, options, expected = FRAMES[case]
    assert fit_board(collision_avoidance, view, options).plain == expected[1:]


def test_a_key_says_that_the_advisory_in_force_is_free_to_keep() -> None:
    game = make_session_from_state("collision-avoidance", [300.0, 0.0, 0.0, 20.0], [0], [0.5])
    describe_keys = getattr(collision_avoidance, "describe_keys", None)
    assert describe_keys is not None
    assert describe_keys(game.view(0)) == {"descend": "keep, free"}


def test_a_gust_after_the_pass_is_not_described() -> None:
    game = make_session_from_state("collision-avoidance", [300.0, 0.0, 0.0, 0.0], [1], [0.9])
    assert "gust" not in collision_avoidance.describe_turn(game.view(0))
