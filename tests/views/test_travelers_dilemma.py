from functools import partial

import pytest

import dmplay
from dmplay.draw.options import DrawOptions
from dmplay.views.protocol import fit_board, load_view_module
from tests.support import games

travelers_dilemma = load_view_module(dmplay.load_problem("travelers-dilemma"))

make_view_after = partial(games.make_view_after, "travelers-dilemma")


def test_the_table_stays_in_place_while_claims_stay_in_it() -> None:
    options = DrawOptions(80, 24)
    headings = [
        fit_board(travelers_dilemma, make_view_after(*rounds), options).plain.split("\n")[0]
        for rounds in ((), ("97 98",), ("97 98", "99 99"), ("97 98", "99 99", "97 95"))
    ]
    assert len(set(headings[:3])) == 1
    assert "94" in headings[3]


def test_the_rule_is_described_in_words_instead_of_9801_cells() -> None:
    assert travelers_dilemma.describe_situation(make_view_after("60 45")) == (
        "you are agent1. last round: agent1 chose 60. agent2 chose 45. claim 2 to 100 whole "
        "dollars. if the claims are equal, each gets its claim. else both get the lower claim, the "
        "lower claimant 2 more and the higher 2 less."
    )


FRAMES = {
    "a window round both claims": (make_view_after("100 97", "60 45"), DrawOptions(80, 24), """
     │ … │   44   │   45   │   46   │   47   │   48   │ …
─────┼───┼────────┼────────┼────────┼────────┼────────┼───
   … │   │        │        │        │        │        │
  59 │   │ 42, 46 │ 43, 47 │ 44, 48 │ 45, 49 │ 46, 50 │
> 60 │   │ 42, 46 │[43,47] │ 44, 48 │ 45, 49 │ 46, 50 │
  61 │   │ 42, 46 │ 43, 47 │ 44, 48 │ 45, 49 │ 46, 50 │
  62 │   │ 42, 46 │ 43, 47 │ 44, 48 │ 45, 49 │ 46, 50 │
  63 │   │ 42, 46 │ 43, 47 │ 44, 48 │ 45, 49 │ 46, 50 │
   … │   │        │        │        │        │        │

agent1 (you) 100  60
agent2        97  45"""),
    "a window at the corner in ascii": (
        make_view_after("2 3", seat=1),
        DrawOptions(80, 24, ascii=True),
        """
     |   2    |   3    |   4    |   5    |   6    | ~
-----+--------+--------+--------+--------+--------+---
>  2 |  2, 2  | [4,0]  |  4, 0  |  4, 0  |  4, 0  |
   3 |  0, 4  |  3, 3  |  5, 1  |  5, 1  |  5, 1  |
   4 |  0, 4  |  1, 5  |  4, 4  |  6, 2  |  6, 2  |
   5 |  0, 4  |  1, 5  |  2, 6  |  5, 5  |  7, 3  |
   6 |  0, 4  |  1, 5  |  2, 6  |  3, 7  |  6, 6  |
   ~ |        |        |        |        |        |

agent1         2
agent2 (you)   3""",
    ),
    "three claims by three": (make_view_after("100 97"), DrawOptions(40, 8), """
     │ … │   96   │   97   │   98   │ …
─────┼───┼────────┼────────┼────────┼───
   … │   │        │        │        │
  98 │   │ 94, 98 │ 95, 99 │ 98, 98 │
  99 │   │ 94, 98 │ 95, 99 │96, 100 │
>100 │   │ 94, 98 │[95,99] │96, 100 │"""),
    "the rounds alone": (make_view_after("100 97", "60 45"), DrawOptions(40, 6), """
agent1 (you) 100  60
agent2        97  45
both get the lower claim,
lower claim +2, higher claim -2"""),
}  # fmt: skip


@pytest.mark.parametrize("case", FRAMES)
def test_the_claims_are_drawn(case: str) -> None:
    view, options, expected = FRAMES[case]
    assert fit_board(travelers_dilemma, view, options).plain == expected[1:]
