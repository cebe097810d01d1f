import dmplay
from dmplay.views.style import Look, fit, style_of
from tests.support.games import after

rock_paper_scissors = style_of(dmplay.load("rock-paper-scissors"))


def test_paper_covers_rock() -> None:
    drawn = fit(
        rock_paper_scissors, after("rock-paper-scissors", "rock rock", "paper rock"), Look(80, 24)
    ).plain
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
    drawn = fit(
        rock_paper_scissors,
        after("rock-paper-scissors", "paper scissors", seat=1),
        Look(30, 6, ascii=True),
    ).plain
    assert (
        drawn
        == """\
         | rock |paper |scisso
---------+------+------+------
 rock    | 0, 0 |-1, 1 |1, -1
>paper   |1, -1 | 0, 0 |[-1,1]
 scissors|-1, 1 |1, -1 | 0, 0"""
    )
