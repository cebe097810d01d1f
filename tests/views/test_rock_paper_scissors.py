from functools import partial

import dmplay
from dmplay.views.style import Look, fit, style_of
from tests.support import games

rock_paper_scissors = style_of(dmplay.load("rock-paper-scissors"))

after = partial(games.after, "rock-paper-scissors")


def test_paper_covers_rock() -> None:
    drawn = fit(rock_paper_scissors, after("rock rock", "paper rock"), Look(80, 24)).plain
    assert (
        drawn
        == """\
          │   rock   │  paper   │ scissors
──────────┼──────────┼──────────┼──────────
 rock     │   0, 0   │  -1, 1   │  1, -1
>paper    │ [1, -1]  │   0, 0   │  -1, 1
 scissors │  -1, 1   │  1, -1   │   0, 0

agent1 (you) R P
agent2       R R"""
    )


def test_the_table_in_a_small_ascii_room() -> None:
    drawn = fit(rock_paper_scissors, after("paper scissors", seat=1), Look(30, 6, ascii=True)).plain
    assert (
        drawn
        == """\
         | rock |paper |scisso
---------+------+------+------
 rock    | 0, 0 |-1, 1 |1, -1
>paper   |1, -1 | 0, 0 |[-1,1]
 scissors|-1, 1 |1, -1 | 0, 0"""
    )
