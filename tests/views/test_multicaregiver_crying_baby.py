from functools import partial

import dmplay
from dmplay.views.style import DrawOptions, fit_board, load_view_module
from tests.support import games

multicaregiver_crying_baby = load_view_module(dmplay.load_problem("multicaregiver-crying-baby"))

after = partial(games.after, "multicaregiver-crying-baby")


def test_what_one_of_two_caregivers_believes() -> None:
    drawn = fit_board(
        multicaregiver_crying_baby, after("ignore ignore", "sing feed", seat=1), DrawOptions(80, 24)
    ).plain
    assert (
        drawn
        == """\
heard  quiet

sated   ████████████████████ 1.000
hungry  ···················· 0.000
history of hungry ▅█▁·················
caregiver1 is unseen: believed to act at random"""
    )


def test_two_caregivers_in_a_small_ascii_room() -> None:
    drawn = fit_board(
        multicaregiver_crying_baby, after("ignore feed"), DrawOptions(40, 8, ascii=True)
    ).plain
    assert (
        drawn
        == """\
heard  quiet

sated   ##################.. 0.909
hungry  ##.................. 0.091
history of hungry =_
caregiver2: believed to act at random"""
    )


def test_a_caregiver_is_told_what_the_other_is_believed_to_do() -> None:
    assert multicaregiver_crying_baby.describe_situation(after()) == (
        "heard nothing yet. belief: sated 0.500, hungry 0.500. caregiver2 is unseen and believed "
        "to act uniformly at random."
    )
