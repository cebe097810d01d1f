"""Tests of boards on the screen: larger than in transcripts, with regrets, forecasts and motion."""

import math

import numpy as np
import pytest

import dmplay
from dmplay.core.problem import Problem
from dmplay.core.session import Session, View
from dmplay.draw.options import DrawOptions
from dmplay.views.protocol import fit_board, load_view_module
from tests.support.games import make_session, make_session_from_state
from tests.support.view_options import forecast_action, make_regrets

LARGE_OPTIONS = DrawOptions(80, 12, allow_large=True)
SMALL_OPTIONS = DrawOptions(50, 9, allow_large=True)
ASCII_OPTIONS = SMALL_OPTIONS._replace(ascii=True)


def make_hexworld_game(q: int, r: int) -> Session:
    """Return a hex world game that starts on this hex."""
    game = make_session("hexworld", [0.5], [0.5])
    game.initial_state = np.array(game.problem.hexes.index((q, r)))  # type: ignore[attr-defined]
    return game


def play_turns(name: str, *turns: str) -> Session:
    """Return a game after these turns; a turn is the agents' actions, separated by spaces."""
    problem = dmplay.load_problem(name)
    game = Session(problem, dmplay.SeededUniforms(5))
    for turn in turns:
        game.advance(
            [problem.parse_action(seat, action) for seat, action in enumerate(turn.split())]
        )
    return game


def make_tile_game() -> Session:
    """Return a 2048 game in which only a slide to the left is illegal."""
    game = make_session("2048", [0.0, 0.0, 0.0, 0.9], [0.0, 0.0])
    game.advance([1])
    return game


def make_slid_tile_game() -> Session:
    """Return the same game after a slide up."""
    game = make_tile_game()
    game.advance([3], np.array([0.9, 0.0]))
    return game


def get_view(game: Session, seat: int = 0) -> View[Problem]:
    """Return the view of a seat."""
    return game.view(seat)


EXIT_GAME = make_hexworld_game(9, 0)
HUNT_GAME = play_turns("predator-prey", "sw e")
BLIND_HUNT_GAME = play_turns("collaborative-predator-prey", "e w", "ne w")
TILE_GAME = make_tile_game()
CART_GAME = make_session_from_state("cart-pole", [1.0, 0.4, 0.18, 0.6], [1])
CART_AT_EDGE_GAME = make_session_from_state("cart-pole", [2.2, 0.4, 0.18, 0.6], [1])
SLID_TILE_GAME = make_slid_tile_game()
SLIDE_REGRET = make_regrets(math.nan, 2.5, 0, 40)

FRAMES = {
    "an exit says that any key collects it": (
        get_view(EXIT_GAME),
        LARGE_OPTIONS,
        """
 ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲
│     │     │     │     │     │     │     │     │     │     │
│     │     │     │     │     │     │     │     │     │     │
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │  ◆  │     │     │ ░░░ │     │ ░░░   ░░░ │     │     │
   │  +5 │     │     │ ░░░ │     │ ░░░   ░░░ │     │     │
 ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲
│     │     │  ✗  │     │ ░░░ │     │     │     │ ░░░ │  @  │
│     │     │ -10 │     │ ░░░ │     │     │     │ ░░░ │ +10 │
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱         ╲ ╱   ╲ ╱   ╲ ╱         ╲ ╱
any action collects +10"""),
    "the prey has the same glyph for itself": (
        get_view(HUNT_GAME, 1),
        SMALL_OPTIONS._replace(show_keys=True),
        """
   ╱ ╲ ╱ ╲ ╱ ╲
  │   │   │   │
 ╱ ╲ ╱ ╲ ╱ ╲ ╱   ╱ ╲ ╱ ╲
│   │ ░ │ A │ ░ │   │   │
 ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱
  │   │ h │ o │ l │   │
   ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱"""),
    "the blind hunt in shades": (
        get_view(BLIND_HUNT_GAME),
        LARGE_OPTIONS._replace(width=60),
        """
    ╱   ╲ ╱   ╲ ╱   ╲
   │  @  │  @  │  @@ │
   │█████│█████│▆▆▆▆▆│
 ╱   ╲ ╱   ╲ ╱   ╲ ╱     ╱   ╲ ╱   ╲
│     │ ░░░ │  @  │ ░░░ │  @  │ @28%│
│█10%█│ ░░░ │█████│ ░░░ │█████│▆▆▆▆▆│
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │     │     │  @  │     │     │
   │██9%█│█10%█│█████│█████│█████│
     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
@ where you may be, █ where the prey may be"""),
    "the blind hunt in shades, small and in ascii": (
        get_view(BLIND_HUNT_GAME),
        ASCII_OPTIONS,
        r"""
   / \ / \ / \
  |@##|@##|@++|
 / \ / \ / \ /   / \ / \
|###| % |@##| % |@##|@++|
 \ / \ / \ / \ / \ / \ /
  |#9%|###|@##|###|###|
   \ / \ / \ / \ / \ /
@ where you may be, # where the prey may be"""),
    "where the prey would be after either sense": (
        get_view(BLIND_HUNT_GAME),
        LARGE_OPTIONS._replace(width=60, height=13, forecast=forecast_action(BLIND_HUNT_GAME, 4)),
        """
    ╱   ╲ ╱   ╲ ╱   ╲
   │█████│█10%█│▆▆▆▆▆│
   │▄▄▄▄▄│▄▄▄▄▄│▂▂▂▂▂│
 ╱   ╲ ╱   ╲ ╱   ╲ ╱     ╱   ╲ ╱   ╲
│█10%█│ ░░░ │█10%█│ ░░░ │█████│▆▆▆▆▆│
│▂▂▂▂▂│ ░░░ │█19%█│ ░░░ │▂▂▂▂▂│▂▂▂▂▂│
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │█████│█████│▆▆▆▆▆│▆▆▆▆▆│█████│
   │▄▄▄▄▄│█17%█│█18%█│█████│▂▂▂▂▂│
     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
if you go SW: chance of the prey on each hex
upper: sensed nothing (95%); lower: sensed prey (5%)"""),
    "who truly was where": (
        get_view(BLIND_HUNT_GAME),
        LARGE_OPTIONS._replace(width=60, revealed_state=np.array([3, 4, 5])),
        """
    ╱   ╲ ╱   ╲ ╱   ╲
   │     │     │     │
   │█████│█████│▆▆▆▆▆│
 ╱   ╲ ╱   ╲ ╱   ╲ ╱     ╱   ╲ ╱   ╲
│  @  │ ░░░ │  B  │ ░░░ │  o  │     │
│█10%█│ ░░░ │█████│ ░░░ │█████│▆▆▆▆▆│
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │     │     │     │     │     │
   │██9%█│█10%█│█████│█████│█████│
     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
true positions: @ predator1, B predator2, o prey"""),
    "the actions of the blind from the best down": (
        get_view(BLIND_HUNT_GAME),
        SMALL_OPTIONS._replace(regret=make_regrets(1.3, 1.04, 0.78, 0.52, 0.26, 0)),
        """
   ╱ ╲ ╱ ╲ ╱ ╲
  │@██│@██│@▆▆│
 ╱ ╲ ╱ ╲ ╱ ╲ ╱   ╱ ╲ ╱ ╲
│███│ ░ │@██│ ░ │@██│@▆▆│
 ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱
  │█9%│███│@██│███│███│
   ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱
hint: best se; sw -0.26; w -0.52; nw -0.78"""),
    "tiles half on their way, two of them to the same cell": (
        get_view(SLID_TILE_GAME),
        SMALL_OPTIONS._replace(height=10, motion_progress=0.5),
        """
┌──────┬──────┬──────┬──────┐
│  2   │      │      │      │
├──────┼──────┼──────┼──────┤
│      │      │      │      │
├  2   ┼  4   ┼──────┼──────┤
│      │      │      │      │
├──────┼──────┼──────┼──────┤
│      │      │      │      │
└──────┴──────┴──────┴──────┘"""),
    "four rows of tiles without one": (
        get_view(TILE_GAME),
        ASCII_OPTIONS._replace(height=4, regret=SLIDE_REGRET),
        """
    2    .    .    .  ^ -40
    .    .    .    .
    .    .    .    .  > best
    2    4    .    .  v -2.5"""),
    "the cart says what is lost by a push": (
        get_view(CART_GAME),
        SMALL_OPTIONS._replace(regret=make_regrets(0.5, 0)),
        """
                            ●
                           │
                           │
                          │
           -0.5 turns ← ┌─┴─┐ → best
                       →└o─o┘
   ╋━━━━━━━━━━━━━━━┷━━━━━━━━━━━━━━━╋
position +1.01/2.4 m  speed +0.59 m/s
angle +11.0/12 deg  swing +21 deg/s"""),
    "the cart says it where there is room": (
        get_view(CART_AT_EDGE_GAME),
        ASCII_OPTIONS._replace(regret=make_regrets(0.5, 0)),
        """
                                    *
                                   |
                                   |
                                  |
           < -0.5 turns  > best +-+-+
                               >+o-o+
   #===============^===============#
position +2.21/2.4 m  speed +0.59 m/s
angle +11.0/12 deg  swing +21 deg/s"""),
}  # fmt: skip


@pytest.mark.parametrize("case", FRAMES)
def test_a_board_is_drawn_on_the_screen(case: str) -> None:
    view, options, expected = FRAMES[case]
    assert fit_board(load_view_module(view.problem), view, options).plain == expected[1:]
