"""Tests of the view of the crying baby."""

import dmplay
from dmplay.views import crying_baby
from dmplay.views.protocol import DrawOptions, fit_board


def test_a_long_history_is_of_the_last_twenty_turns_and_says_so() -> None:
    session = dmplay.Session(
        dmplay.load_problem("crying-baby"), dmplay.SeededUniforms(7), turn_limit=30
    )
    histories = []
    for _ in range(25):
        board = fit_board(crying_baby, session.view(0), DrawOptions(80, 24, allow_large=True)).plain
        histories += [row for row in board.split("\n") if row.startswith("chance of hunger")]
        session.advance([2])
    assert histories[0] == "chance of hunger by turn ▅···················"
    assert histories[-1].startswith("chance of hunger, last turns ")
    assert len(histories[-1].removeprefix("chance of hunger, last turns ")) == 20
