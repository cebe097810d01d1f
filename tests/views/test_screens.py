"""What a screen draws beyond a transcript's frames: more room, what is lost, what may come."""

import math

import numpy as np
import pytest

import dmplay
from dmplay.core import Problem
from dmplay.session import Session, View
from dmplay.views.style import Look, fit, style_of
from tests.support.games import session, started
from tests.support.looks import foreseen, losing

LARGE = Look(80, 12, large=True)
SMALL = Look(50, 9, large=True)
PLAIN = SMALL._replace(ascii=True)


def hexworld(q: int, r: int) -> Session:
    """A game of hex world that begins on this hex."""
    game = session("hexworld", [0.5], [0.5])
    game.first = np.array(game.problem.hexes.index((q, r)))  # type: ignore[attr-defined]
    return game


def played(name: str, *turns: str) -> Session:
    """A game after these turns, the actions of one turn with blanks between."""
    problem = dmplay.load(name)
    game = Session(problem, dmplay.Dice(5))
    for turn in turns:
        game.advance([problem.action(seat, word) for seat, word in enumerate(turn.split())])
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


def advised() -> Session:
    """An encounter ten seconds old."""
    before, draws = [1, 1, 1, 2, 2, 2, 2, 0, 0, 1], [[0.5]] * 8 + [[0.1]] * 2
    return started("collision-avoidance", [40.0, -3.0, 0.0, 40.0], before, *draws)


def pushed() -> Session:
    """A number after three pushes."""
    draws = [0.5, 0.25], [0.7, 0.6], [0.9, 0.1]
    return started("simple-regulator", [0.9], [-0.6, -0.7, 0.25], *draws)


def now(game: Session, seat: int = 0) -> View[Problem]:
    """What a seat sees."""
    return game.view(seat)


EXIT, BORDER = hexworld(9, 0), hexworld(8, 1)
HUNT, BLIND = played("predator-prey", "sw e"), played("collaborative-predator-prey", "e w", "ne w")
TILES, ENCOUNTER, NUMBER = tiles(), advised(), pushed()
CART = started("cart-pole", [1.0, 0.4, 0.18, 0.6], [1])
EDGE = started("cart-pole", [2.2, 0.4, 0.18, 0.6], [1])
CAR = started("mountain-car", [-0.9, -0.05], [0])
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
    "each way on says what is lost by it": (
        now(BORDER),
        LARGE._replace(regret=losing(0, 0.21, 1.2, 1.5, 0.9, 0.4)),
        """
 ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲
│     │     │     │     │     │     │     │     │y ██▍│u ▍  │
│     │     │     │     │     │     │     │     │ -1.2│-0.21│
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │  ◆  │     │     │     │     │           │h ███│  @  │
   │  +5 │     │     │     │     │           │ -1.5│     │
 ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲
│     │     │  ✗  │     │     │     │     │     │     │◆ n ▊│
│     │     │ -10 │     │     │     │     │     │     │ -0.4│
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱         ╲ ╱   ╲ ╱   ╲ ╱         ╲ ╱
walls: l best b -0.9"""),
    "each way on says what is lost by it, small and in ascii": (
        now(BORDER),
        PLAIN._replace(regret=losing(0, 0.21, 1.2, 1.5, 0.9, 0.4)),
        r"""
 / \ / \ / \ / \ / \ / \ / \ / \ / \ / \
|   |   |   |   |   |   |   |   | y#| u |
 \ / \ / \ / \ / \ / \ / \ / \ / \ / \ /
  | + |   |   |   |   |       | h#| @ |
 / \ / \ / \ / \   \ / \ / \ / \ / \ / \
|   |   | x |   |   |   |   |   |   |+ n|
 \ / \ / \ / \ /     \ / \ / \ /     \ /
walls: l best b -0.9"""),
    "each hex says how likely a step ends there": (
        now(BORDER),
        LARGE._replace(outlook=foreseen(BORDER, 2)),
        """
 ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲
│     │     │     │     │     │     │     │     │ 0.70│ 0.15│
│     │     │     │     │     │     │     │     │     │     │
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │  ◆  │     │     │     │     │           │ 0.15│  @  │
   │  +5 │     │     │     │     │           │     │     │
 ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲
│     │     │  ✗  │     │     │     │     │     │     │  ◆  │
│     │     │ -10 │     │     │     │     │     │     │ +10 │
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱         ╲ ╱   ╲ ╱   ╲ ╱         ╲ ╱
if you go NW, how likely each hex is"""),
    "each hex says how likely a step ends there, small and in ascii": (
        now(BORDER),
        PLAIN._replace(outlook=foreseen(BORDER, 2)),
        r"""
 / \ / \ / \ / \ / \ / \ / \ / \ / \ / \
|   |   |   |   |   |   |   |   |.70|.15|
 \ / \ / \ / \ / \ / \ / \ / \ / \ / \ /
  | + |   |   |   |   |       |.15| @ |
 / \ / \ / \ / \   \ / \ / \ / \ / \ / \
|   |   | x |   |   |   |   |   |   | + |
 \ / \ / \ / \ /     \ / \ / \ /     \ /
if you go NW, how likely each hex is"""),
    "the predator sees who it is": (
        now(HUNT),
        SMALL._replace(width=60, height=12, keys=True),
        """
    ╱   ╲ ╱   ╲ ╱   ╲
   │     │  y  │  u  │
   │     │     │     │
 ╱   ╲ ╱   ╲ ╱   ╲ ╱     ╱   ╲ ╱   ╲
│     │     │  A  │     │     │     │
│     │     │ you │     │     │     │
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │     │  b  │  o  │     │     │
   │     │     │  n  │     │     │
     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
A is you, o is the prey"""),
    "the prey has the same glyph for itself": (
        now(HUNT, 1),
        SMALL._replace(keys=True),
        """
   ╱ ╲ ╱ ╲ ╱ ╲
  │   │   │   │
 ╱ ╲ ╱ ╲ ╱ ╲ ╱   ╱ ╲ ╱ ╲
│   │   │ A │   │   │   │
 ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱
  │   │ h │ o │ l │   │
   ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱"""),
    "the way that leads to somebody says what is lost by it": (
        now(HUNT),
        LARGE._replace(width=60, regret=losing(1, 2, 3, 2, 1, 0)),
        """
    ╱   ╲ ╱   ╲ ╱   ╲
   │     │y ███│u ██ │
   │     │  -3 │  -2 │
 ╱   ╲ ╱   ╲ ╱   ╲ ╱     ╱   ╲ ╱   ╲
│     │     │  A  │     │     │     │
│     │     │ you │     │     │     │
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │     │b █  │ o n │     │     │
   │     │  -1 │ best│     │     │
     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
walls: l -1 h -2"""),
    "in the hunt both may come to a hex": (
        now(HUNT),
        LARGE._replace(width=60, ascii=True, outlook=foreseen(HUNT, 5)),
        r"""
    /   \ /   \ /   \
   |     |     |     |
   |     |     |     |
 /   \ /   \ /   \ /     /   \ /   \
|     |     |  A  |     |     |     |
|     |     | 0.15|     |     |     |
  \ /   \ /   \ /   \ /   \ /   \ /
   |     | 0.15|  o  |o0.70|     |
   |     |     | 0.70|     |     |
     \ /   \ /   \ /   \ /   \ /
if you go SE, how likely"""),
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
@ you, █ prey if likely"""),
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
@ you, # prey if likely"""),
    "where the prey would be after either sense": (
        now(BLIND),
        LARGE._replace(width=60, height=13, outlook=foreseen(BLIND, 4)),
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
upper: nothing 95%, lower: prey 5%"""),
    "who truly was where": (
        now(BLIND),
        LARGE._replace(width=60, state=np.array([3, 4, 5])),
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
    "each edge says what is lost by a slide": (
        now(TILES),
        SMALL._replace(regret=SLIDES),
        """
       ┌────── ↑ -40 █████ ─┬──────┐
       │  2   │      │      │      │
       ├──────┼──────┼──────┼──────┤
       │      │      │      │      │ →
       ├──────┼──────┼──────┼──────┤ best
       │      │      │      │      │
       ├──────┼──────┼──────┼──────┤
       │  2   │  4   │      │      │
       └──────┴─ ↓ -2.5 ▎ ──┴──────┘"""),
    "four rows of tiles in borders": (
        now(TILES),
        SMALL._replace(height=8, regret=SLIDES),
        """
       ┌──── ↑ -40 █████ ┬─────┐
       │  2  │     │     │     │ →
       │     │     │     │     │ best
       │     │     │     │     │
       │  2  │  4  │     │     │
       └─────┴ ↓ -2.5 ▎ ─┴─────┘"""),
    "tiles half on their way, two of them to the same cell": (
        now(SLID),
        SMALL._replace(height=10, passed=0.5),
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
    "the board after a slide, and where a tile may come": (
        now(TILES),
        SMALL._replace(outlook=foreseen(TILES, 2)),
        """
┌ if you go right: 0 ┬──────┐
│  8%  │  8%  │  8%  │  2   │
├──────┼──────┼──────┼──────┤
│  8%  │  8%  │  8%  │  8%  │
├──────┼──────┼──────┼──────┤
│  8%  │  8%  │  8%  │  8%  │
├──────┼──────┼──────┼──────┤
│  8%  │  8%  │  2   │  4   │
└──────┴──────┴──────┴──────┘"""),
    "the board after a slide in ascii": (
        now(TILES),
        PLAIN._replace(outlook=foreseen(TILES, 1)),
        """
+ if you go down: +4 +------+
|  7%  |  7%  |  7%  |  7%  |
+------+------+------+------+
|  7%  |  7%  |  7%  |  7%  |
+------+------+------+------+
|  7%  |  7%  |  7%  |  7%  |
+------+------+------+------+
|  4   |  4   |  7%  |  7%  |
+------+------+------+------+"""),
    "a straight pole beside the panel that has its numbers": (
        now(CART),
        LARGE._replace(height=17),
        """
                                            ●
                                            │
                                            │
                                           │
                                           │
                                           │
                                          │
                                          │
                                         │
                                       ┌─┴─┐
                                      →└o─o┘
   ╋━━━━━━━━━━━━━━━━━━━━━━━━━━┷━━━━━━━━━━━━━━━━━━━━━━━━━━╋
-2.4                       place x                     +2.4 m
   ├┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┼┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄●┄┤
-12                      lean theta                   +12 deg"""),
    "the cart says what is lost by a push": (
        now(CART),
        SMALL._replace(regret=losing(0.5, 0)),
        """
                            ●
                           │
                           │
                          │
                 -0.5 ← ┌─┴─┐ → best
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
                 < -0.5  > best +-+-+
                               >+o-o+
   #===============^===============#
place +2.21/2.4 m  speed +0.59 m/s
lean +11.0/12 deg  swings +21 deg/s"""),
    "where a push leads": (
        now(CART),
        LARGE._replace(height=17, ascii=True, outlook=foreseen(CART, 1)),
        """
                                            *
                                            |
                                            |
                                           |
                                           |
                                           |
                                          |
                                          |
                                         |
                                       +-+-+
                                      >+o-o+
   #==========================^==========================#
-2.4                       place x                     +2.4 m
   +--------------------------+------------------------*o+
-12                      lean theta                   +12 deg

if you push right: place +1.020 m, lean +11.42 deg"""),
    "the car says what is lost by its engine": (
        now(CAR),
        LARGE._replace(height=14, regret=losing(0, 0.25, 1)),
        """
│← best  · -0.25  → -1
│                                                           F
│                                                           │
│                                                ▁▃▄▅▆▇▇████▇
│▃▁                                          ▂▄▆▇████████████
│██▇▄▂                                   ▁▄▆█████████████████
│██████▆←● ·                         ▁▃▅▇████████████████████
│█████████▇▅▃▂                   ▁▃▅▇████████████████████████
│██████████████▆▅▄▃▂▁▁▁▁▁▁▁▁▂▃▅▆▇████████████████████████████
-1.2                 -0.52                           goal 0.6
 ├┄┄┄┄┄┄┄┄●┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┼┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┤
-0.07                      speed v                      +0.07"""),
    "where the engine leads": (
        now(CAR),
        LARGE._replace(height=14, ascii=True, outlook=foreseen(CAR, 2)),
        """
|
|                                                           F
|                                                           |
|                                                _--==#######
|-_                                          _-=#############
|###-_                                   _-=#################
|######=<* .                         _-=#####################
|##########=-_                   _-=#########################
|##############==--__________-==#############################
-1.2                 -0.52                           goal 0.6
 +--------*o------------------+----------------------------+
-0.07                      speed v                      +0.07

if you drive right: x -0.994 v -0.0453"""),
    "the number beside the panel that tells it": (
        now(NUMBER),
        LARGE,
        """
                              │
                              │
                              │
                              │
                              │        ←────────────────∘
                  ←────────────────────∘
               ∘──────→       │
                   ▁▅▇█▇▅▁    │
               ▁▂▄▆███████▆▄▂▁│
 ├──────────────┬──────────●──┼──────────────┬─────────────┤
-1            -0.5            0            +0.5           +1
● the number, ∘→ a push and its aim, ▄█▄ where chance took it"""),
    "what a push costs now and next": (
        now(NUMBER),
        LARGE._replace(outlook=foreseen(NUMBER, 0.1)),
        """
                              │
                              │
                              │
                              │
                              │        ←────────────────∘
                  ←────────────────────∘
               ∘──────→       │
                           ▁▅▅█▇▃
                   ▁   ▁▁▆▆██████▇▇▄▄▁▁
 ├──────────────┬──────────●──┼──────────────┬─────────────┤
-1            -0.5            0            +0.5           +1
if you push +0.100 (samples): costs 0.010 now, 0.011 next on average"""),
    "what a push costs, small and in ascii": (
        now(NUMBER),
        PLAIN._replace(outlook=foreseen(NUMBER, 0.1)),
        """
                   |    <----------o
            <-----------o
          o--->    |
               _.-=#+-._
 +--------+------*-+--------+--------+
-1      -0.5       0      +0.5      +1
+0.10: 0.01 now, 0.01 next (samples)"""),
    "where each advisory leads, by name": (
        now(ENCOUNTER),
        LARGE._replace(height=16),
        """
 +300


 +150                                       ↑  ↑ climb
                                   ↑  ↑  ↑
      ···↑↑↑↑↓↓·             ↑  ↑             ▒▒
    0 ┄┄┄┄┄┄┄┄┄┄◆┄┄┄↑┄┄↑┄┄↑┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄▒A
                       ↓  ∘  ∘  ∘  ∘          ▒▒
                                ↓  ↓  ∘  ∘  ∘
 -150                                 ↓  ↓     ∘ none
                                            ↓  ↓ descend

 -300
     40s       30s        20s       10s       0s
will pass 127 m below A: clear"""),
    "where each gust bears an advisory": (
        now(ENCOUNTER),
        LARGE._replace(height=16, ascii=True, outlook=foreseen(ENCOUNTER, 2)),
        """
 +200                                          ^ climb
                                            ^  ^ climb
                                      ^  ^  ^  ^ climb
 +100                              ^  ^  ^
                             ^  ^  ^  ^       ::
      ...^^^^vv.+      ^  ^  ^  ^             ::
    0 --------------^--^--^--^----------------:A
                                              ::

 -100


 -200
     40s       30s        20s       10s       0s
climb: rate -4.0 0.50, -6.0 0.25, -2.0 0.25"""),
    "what is lost by each advisory": (
        now(ENCOUNTER),
        SMALL._replace(regret=losing(0.3, 0.01, 0)),
        """
 +300
 +150                       ↑  ↑  ↑  ↑
    0 ··↑↑↑↓↓·◆┄↑┄┄↑┄┄↑┄┄↑┄┄∘┄┄┄┄┄┄┄▒A
 -150                    ↓  ↓  ∘  ∘  ∘
 -300
     40s     30s     20s    10s     0s
◆ +23 m  -5.0 m/s  30 s left  none
hint  climb best  none -0.01"""),
}  # fmt: skip


@pytest.mark.parametrize("what", FRAMES)
def test_a_screen_draws(what: str) -> None:
    view, look, board = FRAMES[what]
    assert fit(style_of(view.problem), view, look).plain == board[1:]
