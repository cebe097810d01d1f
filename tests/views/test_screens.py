"""What a screen draws beyond a transcript's frames: more room, what is lost, what may come."""

import math

import numpy as np
import pytest

import dmplay
from dmplay.core import Problem
from dmplay.session import Session, View
from dmplay.views.style import DrawOptions, fit_board, load_view_module
from tests.support.games import session, started
from tests.support.looks import foreseen, losing

LARGE = DrawOptions(80, 12, allow_large=True)
SMALL = DrawOptions(50, 9, allow_large=True)
PLAIN = SMALL._replace(ascii=True)


def hexworld(q: int, r: int) -> Session:
    """A game of hex world that begins on this hex."""
    game = session("hexworld", [0.5], [0.5])
    game.initial_state = np.array(game.problem.hexes.index((q, r)))  # type: ignore[attr-defined]
    return game


def played(name: str, *turns: str) -> Session:
    """A game after these turns, the actions of one turn with blanks between."""
    problem = dmplay.load_problem(name)
    game = Session(problem, dmplay.SeededUniforms(5))
    for turn in turns:
        game.advance([problem.parse_action(seat, word) for seat, word in enumerate(turn.split())])
    return game


def tiles() -> Session:
    """A board whose only closed way is to the left."""
    game = session("2048", [0.0, 0.0, 0.0, 0.9], [0.0, 0.0])
    game.advance([1])
    return game


def slid() -> Session:
    """The same board after a slide up."""
    game = tiles()
    game.advance([3], np.array([0.9, 0.0]))
    return game


def now(game: Session, seat: int = 0) -> View[Problem]:
    """What a seat sees."""
    return game.view(seat)


EXIT = hexworld(9, 0)
HUNT, BLIND = played("predator-prey", "sw e"), played("collaborative-predator-prey", "e w", "ne w")
TILES = tiles()
CART = started("cart-pole", [1.0, 0.4, 0.18, 0.6], [1])
EDGE = started("cart-pole", [2.2, 0.4, 0.18, 0.6], [1])
SLID = slid()
SLIDES = losing(math.nan, 2.5, 0, 40)

FRAMES = {
    "an exit says that any key collects it": (
        now(EXIT),
        LARGE,
        """
 ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲
│     │     │     │     │     │     │     │     │     │     │
│     │     │     │     │     │     │     │     │     │     │
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │  ◆  │     │     │     │     │           │     │     │
   │  +5 │     │     │     │     │           │     │     │
 ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲
│     │     │  ✗  │     │     │     │     │     │     │  @  │
│     │     │ -10 │     │     │     │     │     │     │ +10 │
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱         ╲ ╱   ╲ ╱   ╲ ╱         ╲ ╱
any key collects +10"""),
    "the prey has the same glyph for itself": (
        now(HUNT, 1),
        SMALL._replace(show_keys=True),
        """
   ╱ ╲ ╱ ╲ ╱ ╲
  │   │   │   │
 ╱ ╲ ╱ ╲ ╱ ╲ ╱   ╱ ╲ ╱ ╲
│   │   │ A │   │   │   │
 ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱
  │   │ h │ o │ l │   │
   ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱"""),
    "the blind hunt in shades": (
        now(BLIND),
        LARGE._replace(width=60),
        """
    ╱   ╲ ╱   ╲ ╱   ╲
   │  @  │  @  │  @@ │
   │█████│█████│▆▆▆▆▆│
 ╱   ╲ ╱   ╲ ╱   ╲ ╱     ╱   ╲ ╱   ╲
│     │     │  @  │     │  @  │ @28%│
│█10%█│     │█████│     │█████│▆▆▆▆▆│
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │     │     │  @  │     │     │
   │██9%█│█10%█│█████│█████│█████│
     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
@ where you may be, █ where the prey may be"""),
    "the blind hunt in shades, small and in ascii": (
        now(BLIND),
        PLAIN,
        r"""
   / \ / \ / \
  |@##|@##|@++|
 / \ / \ / \ /   / \ / \
|###|   |@##|   |@##|@++|
 \ / \ / \ / \ / \ / \ /
  |#9%|###|@##|###|###|
   \ / \ / \ / \ / \ /
@ where you may be, # where the prey may be"""),
    "where the prey would be after either sense": (
        now(BLIND),
        LARGE._replace(width=60, height=13, forecast=foreseen(BLIND, 4)),
        """
    ╱   ╲ ╱   ╲ ╱   ╲
   │█████│█10%█│▆▆▆▆▆│
   │▄▄▄▄▄│▄▄▄▄▄│▂▂▂▂▂│
 ╱   ╲ ╱   ╲ ╱   ╲ ╱     ╱   ╲ ╱   ╲
│█10%█│     │█10%█│     │█████│▆▆▆▆▆│
│▂▂▂▂▂│     │█19%█│     │▂▂▂▂▂│▂▂▂▂▂│
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │█████│█████│▆▆▆▆▆│▆▆▆▆▆│█████│
   │▄▄▄▄▄│█17%█│█18%█│█████│▂▂▂▂▂│
     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
if you go SW, where the prey is
upper if nothing, 95%; lower if prey, 5%"""),
    "who truly was where": (
        now(BLIND),
        LARGE._replace(width=60, revealed_state=np.array([3, 4, 5])),
        """
    ╱   ╲ ╱   ╲ ╱   ╲
   │     │     │     │
   │█████│█████│▆▆▆▆▆│
 ╱   ╲ ╱   ╲ ╱   ╲ ╱     ╱   ╲ ╱   ╲
│  @  │     │  B  │     │  o  │     │
│█10%█│     │█████│     │█████│▆▆▆▆▆│
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │     │     │     │     │     │
   │██9%█│█10%█│█████│█████│█████│
     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
truly @ predator1, B predator2, o prey"""),
    "the actions of the blind from the best down": (
        now(BLIND),
        SMALL._replace(regret=losing(1.3, 1.04, 0.78, 0.52, 0.26, 0)),
        """
   ╱ ╲ ╱ ╲ ╱ ╲
  │@██│@██│@▆▆│
 ╱ ╲ ╱ ╲ ╱ ╲ ╱   ╱ ╲ ╱ ╲
│███│   │@██│   │@██│@▆▆│
 ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱
  │█9%│███│@██│███│███│
   ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱
hint  n best  b -0.26  h -0.52  y -0.78  u -1.04"""),
    "tiles half on their way, two of them to the same cell": (
        now(SLID),
        SMALL._replace(height=10, motion_progress=0.5),
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
        now(TILES),
        PLAIN._replace(height=4, regret=SLIDES),
        """
    2    .    .    .  ^ -40
    .    .    .    .
    .    .    .    .  > best
    2    4    .    .  v -2.5"""),
    "the cart says what is lost by a push": (
        now(CART),
        SMALL._replace(regret=losing(0.5, 0)),
        """
                            ●
                           │
                           │
                          │
           -0.5 turns ← ┌─┴─┐ → best
                       →└o─o┘
   ╋━━━━━━━━━━━━━━━┷━━━━━━━━━━━━━━━╋
place +1.01/2.4 m  speed +0.59 m/s
lean +11.0/12 deg  swings +21 deg/s"""),
    "the cart says it where there is room": (
        now(EDGE),
        PLAIN._replace(regret=losing(0.5, 0)),
        """
                                    *
                                   |
                                   |
                                  |
           < -0.5 turns  > best +-+-+
                               >+o-o+
   #===============^===============#
place +2.21/2.4 m  speed +0.59 m/s
lean +11.0/12 deg  swings +21 deg/s"""),
}  # fmt: skip


@pytest.mark.parametrize("what", FRAMES)
def test_a_screen_draws(what: str) -> None:
    view, look, board = FRAMES[what]
    assert fit_board(load_view_module(view.problem), view, look).plain == board[1:]
