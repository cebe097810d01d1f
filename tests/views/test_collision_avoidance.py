"""What a person sees of an encounter in the air, frame by frame."""

import pytest

import dmplay
from dmplay.session import Session
from dmplay.views.style import DrawOptions, fit_board, load_view_module
from tests.support.games import started

collision_avoidance = load_view_module(dmplay.load_problem("collision-avoidance"))


def advised() -> Session:
    return started(
        "collision-avoidance",
        [40.0, -3.0, 0.0, 40.0],
        [1, 1, 1, 2, 2, 2, 2, 0, 0, 1],
        *[[0.5]] * 8,
        *[[0.1]] * 2,
    )


def collided() -> Session:
    return started(
        "collision-avoidance", [-20.0, -3.0, 0.0, 3.0], [0, 2, 2, 2], [0.5], [0.5], [0.5], [0.5]
    )


REVERSED = "clear ahead: will pass 301 m above the intruder."


@pytest.mark.parametrize(
    ("game", "told", "situation"),
    [
        (
            collided(),
            "collision: passed 30 m below the intruder. kept climb. "
            "height -30 m, rate -2.0 m/s, 0 s left.",
            "collision: passed 30 m below the intruder. "
            "height -30 m, rate -2.0 m/s, 0 s left. advisory climb.",
        ),
        (
            started("collision-avoidance", [300.0, 0.0, 0.0, 20.0], [2, 0], [0.5], [0.5]),
            f"{REVERSED} changed to descend. height +301 m, rate +0.0 m/s, 18 s left.",
            f"{REVERSED} height +301 m, rate +0.0 m/s, 18 s left. advisory descend.",
        ),
    ],
)
def test_a_collision_and_an_advisory_reversed_are_told_first(
    game: Session, told: str, situation: str
) -> None:
    view = game.view(0)
    assert collision_avoidance.describe_turn(view) == told
    assert collision_avoidance.describe_situation(view) == situation


def test_the_panel_has_what_the_board_does_not_say() -> None:
    view = advised().view(0)
    assert collision_avoidance.panel_rows(view) == [
        ("height", "+23 m"), ("rate", "-5.0 m/s"), ("left", "30 s"), ("advice", "none"),
    ]  # fmt: skip


FRAMES = {
    "the encounter with every advisory": (advised().view(0), DrawOptions(80, 24), """
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
will pass 127 m below A: clear"""),
    "the encounter in ascii": (advised().view(0), DrawOptions(80, 24, ascii=True), """
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
will pass 127 m below A: clear"""),
    "the encounter in a small room": (advised().view(0), DrawOptions(40, 12), """
 +100
  +50 ··↑↑↑↓↓·                      ▒▒
    0 ┄┄┄┄┄┄┄┄◆┄∘┄∘┄∘┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄▒A
  -50                 ∘ ∘ ∘ ∘       ▒▒
 -100                         ∘ ∘
     40s     30s     20s    10s     0s
◆ h +23 m  dh -5.0 m/s  30 s  none
will pass 127 m below A: clear"""),
    "the encounter in a small room in ascii": (advised().view(0), DrawOptions(40, 12, ascii=True), """
 +100
  +50 ..^^^vv.                      ::
    0 --------+-o-o-o---------------:A
  -50                 o o o o       ::
 -100                         o o
     40s     30s     20s    10s     0s
+ h +23 m  dh -5.0 m/s  30 s  none
will pass 127 m below A: clear"""),
    "the encounter after a collision": (collided().view(0), DrawOptions(80, 12), """
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
    "the encounter in six rows": (collided().view(0), DrawOptions(40, 6), """
 +100
  +50                               ▒▒
    0 ┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄↑▒A
  -50                               ↑◆
 -100
passed 30 m below A: COLLISION"""),
}  # fmt: skip


@pytest.mark.parametrize("what", FRAMES)
def test_an_encounter_is_drawn(what: str) -> None:
    view, look, board = FRAMES[what]
    assert fit_board(collision_avoidance, view, look).plain == board[1:]
