from functools import partial

import numpy as np
import pytest

import dmplay
from dmplay.draw.options import DrawOptions
from dmplay.views.protocol import fit_board, load_view_module
from tests.support import games

catch = load_view_module(dmplay.load_problem("catch"))

make_view_after = partial(games.make_view_after, "catch")


def test_descriptions_include_the_last_throw_and_the_expected_rewards() -> None:
    assert catch.describe_situation(make_view_after()) == (
        "threw nothing yet. belief about the skill: 20 m 0.250, 40 m 0.250, 60 m 0.250, "
        "80 m 0.250. expected reward: 10 m 8.7, 20 m 16.0, 30 m 21.3, 40 m 24.4, 50 m 25.0, "
        "60 m 23.5, 70 m 20.2, 80 m 15.8, 90 m 11.3, 100 m 7.4."
    )
    assert (
        catch.describe_turn(make_view_after("50", "100"))
        == "threw 100 m: dropped. likeliest skill 80 m (39%)."
    )


def test_the_last_throw_names_all_skills_that_are_likeliest() -> None:
    sharp = games.make_view_after("catch:sharp", "50", seed=5)
    assert (
        catch.describe_turn(sharp) == "threw 50 m: caught. likeliest skill 60 m or 80 m (50% each)."
    )


FRAMES = {
    "the curves with the belief below": (make_view_after("50", "100", "60"), DrawOptions(80, 24),
         """
1.0 ┤   68  68   8   8                          chance of catch
    │    4   4   6   6   8   8                  2: skill 20 m
    │    2       4       6       8              4: skill 40 m
0.5 ┤        2       4       6       8          and so on
    │            2       4       6       8
    │                2   2   4   4   6   6   8
0.0 ┤                        2   2  24  24 246
    └─────────────────────────────────────────
metres  10  20  30  40  50  60  70  80  90 100
reward   9  17  23  26  26  24  20  15  10   7  expected

belief: skill
20 m  ██▋················· 0.134
40 m  ██████▍············· 0.318
60 m  ███████▌············ 0.373
80 m  ███▌················ 0.175
throws 50✓ 100✗ 60✗"""),
    "the curves in ascii with the belief beside": (
        make_view_after("50", "100", "60"),
        DrawOptions(120, 24, ascii=True),
        """
1.0 +   68  68   8   8                          chance of catch belief: skill
    |    4   4   6   6   8   8                  2: skill 20 m   20 m  ###................. 0.134
    |    2       4       6       8              4: skill 40 m   40 m  ######.............. 0.318
0.5 +        2       4       6       8          and so on       60 m  #######............. 0.373
    |            2       4       6       8                      80 m  ####................ 0.175
    |                2   2   4   4   6   6   8
0.0 +                        2   2  24  24 246
    +-----------------------------------------
metres  10  20  30  40  50  60  70  80  90 100
reward   9  17  23  26  26  24  20  15  10   7  expected

throws 50v 100x 60x""",
    ),
    "the odds as a table": (make_view_after("50", "100", "60"), DrawOptions(50, 8), """
metres   10 20 30 40 50 60 70 80 90 100
caught % 90 84 75 65 52 40 28 19 12   7
expected  9 17 23 26 26 24 20 15 10   7
20 m  ██▋················· 0.134
40 m  ██████▍············· 0.318
60 m  ███████▌············ 0.373
80 m  ███▌················ 0.175
throws 50✓ 100✗ 60✗"""),
    "the odds as a small table with the truth": (
        make_view_after("50", "100", "60"),
        DrawOptions(40, 6, ascii=True, revealed_state=np.array(3)),
        """
metres   10 20 30 40 50 60 70 80 90 100
caught % 90 84 75 65 52 40 28 19 12   7
expected  9 17 23 26 26 24 20 15 10   7
20: 0.13  40: 0.32  60: 0.37  80: 0.18
true skill 80 m  throws 50v 100x 60x""",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", FRAMES)
def test_throws_and_catch_probabilities_are_drawn(case: str) -> None:
    view, options, expected = FRAMES[case]
    assert fit_board(catch, view, options).plain == expected[1:]
