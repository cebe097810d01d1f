import dmplay
from dmplay.draw.options import DrawOptions
from dmplay.views.protocol import fit_board, load_view_module
from tests.support.games import make_view_after

rock_paper_scissors = load_view_module(dmplay.load_problem("rock-paper-scissors"))


def test_paper_covers_rock() -> None:
    board = fit_board(
        rock_paper_scissors,
        make_view_after("rock-paper-scissors", "rock rock", "paper rock"),
        DrawOptions(80, 24),
    ).plain
    assert (
        board
        == """\
          │   rock   │  paper   │ scissors
──────────┼──────────┼──────────┼──────────
 rock     │   0, 0   │  -1, 1   │  1, -1
>paper    │ [1, -1]  │   0, 0   │  -1, 1
 scissors │  -1, 1   │  1, -1   │   0, 0

agent1 (you) R P
agent2       R R"""
    )


def test_the_table_on_a_small_ascii_board() -> None:
    board = fit_board(
        rock_paper_scissors,
        make_view_after("rock-paper-scissors", "paper scissors", seat=1),
        DrawOptions(30, 6, ascii=True),
    ).plain
    assert (
        board
        == """\
         | rock |paper |scisso
---------+------+------+------
 rock    | 0, 0 |-1, 1 |1, -1
>paper   |1, -1 | 0, 0 |[-1,1]
 scissors|-1, 1 |1, -1 | 0, 0"""
    )
