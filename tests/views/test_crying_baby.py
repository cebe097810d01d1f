"""Tests of the view of the crying baby."""

import dmplay
from dmplay.draw.options import DrawOptions
from dmplay.views.protocol import fit_board, load_view_module


def test_a_long_history_is_of_the_last_twenty_turns_and_says_so() -> None:
    session = dmplay.Session(
        dmplay.load_problem("crying-baby"), dmplay.SeededUniforms(7), turn_limit=30
    )
    histories = []
    for _ in range(25):
        view = session.view(0)
        options = DrawOptions(80, 24, allow_large=True)
        board = fit_board(load_view_module(view.problem), view, options).plain
        histories += [row for row in board.split("\n") if row.startswith("chance of hunger")]
        session.advance([2])
    assert histories[0] == "chance of hunger, turn by turn ▅"
    assert histories[-1].startswith("chance of hunger, last turns ")
    assert len(histories[-1].removeprefix("chance of hunger, last turns ")) == 20
