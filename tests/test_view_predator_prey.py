from functools import partial

from dmplay.views import predator_prey
from dmplay.views._canvas import Look, fit
from tests import games

after = partial(games.after, "predator-prey")


def test_the_hunt_at_its_start_with_the_keys() -> None:
    drawn = fit(predator_prey, after(), Look(80, 24, keys=True)).plain
    assert (
        drawn
        == """\
    ╱   ╲ ╱   ╲ ╱   ╲
   │     │  h  │  @  │
   │     │     │     │
 ╱   ╲ ╱   ╲ ╱   ╲ ╱     ╱   ╲ ╱   ╲
│     │     │  b  │     │     │     │
│     │     │     │     │     │     │
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │     │     │  o  │     │     │
   │     │     │     │     │     │
     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱"""
    )


def test_several_on_one_hex() -> None:
    drawn = fit(
        predator_prey, after("e e e e e", seed=3, predators=2, prey=3), Look(80, 24, ascii=True)
    ).plain
    assert (
        drawn
        == r"""
    /   \ /   \ /   \
   |     |     |  o3 |
   |     |     |     |
 /   \ /   \ /   \ /     /   \ /   \
|     |     |  o2 |     |     |  *  |
|     |     |     |     |     | @o1 |
  \ /   \ /   \ /   \ /   \ /   \ /
   |     |     |  b  |     |     |
   |     |     |     |     |     |
     \ /   \ /   \ /   \ /   \ /"""[1:]
    )


def test_the_hunt_compact_as_the_prey_sees_it() -> None:
    drawn = fit(predator_prey, after("sw e", seat=1), Look(40, 8, keys=True)).plain
    assert (
        drawn
        == """\
   ╱ ╲ ╱ ╲ ╱ ╲
  │   │   │   │
 ╱ ╲ ╱ ╲ ╱ ╲ ╱   ╱ ╲ ╱ ╲
│   │   │ a │   │   │   │
 ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱
  │   │ h │ @ │ l │   │
   ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱"""
    )


def test_the_hunt_in_dots() -> None:
    drawn = fit(predator_prey, after(), Look(40, 6, ascii=True)).plain
    assert (
        drawn
        == """\
   .   .   @
 .       .       .   .
   .   .   o   .   ."""
    )


def test_the_hunt_is_told_from_where_one_stands() -> None:
    assert predator_prey.situation(after()) == (
        "at (1,2), you are predator. E wall. NE wall. NW wall. W (0,2) free. SW (1,1) free. "
        "SE wall. prey at (2,0): 2 steps."
    )
    assert (
        predator_prey.told(after("sw e"))
        == "at (1,1). chose SW, moved SW. prey chose E, bumped, stayed at (2,0)."
    )
