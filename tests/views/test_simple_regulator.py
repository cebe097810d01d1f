"""What a person sees of a number and its pushes, frame by frame."""

import dataclasses
from collections.abc import Sequence
from typing import overload

import pytest

import dmplay
from dmplay.chance import Array
from dmplay.session import Session
from dmplay.views.style import DrawOptions, fit_board, load_view_module
from tests.support.games import started

simple_regulator = load_view_module(dmplay.load_problem("simple-regulator"))


def pushed() -> Session:
    return started(
        "simple-regulator", [0.9], [-0.6, -0.7, 0.25], [0.5, 0.25], [0.7, 0.6], [0.9, 0.1]
    )


def test_the_panel_has_what_the_number_costs() -> None:
    view = pushed().view(0)
    assert simple_regulator.panel_rows(view) == [
        ("number", "-0.102"), ("costs", "0.010"), ("pushed", "+0.250"), ("aimed at", "-0.276"),
        ("reward", "-0.276"), ("noise", "0.1"), ("push by", "-10 to 10"),
        ("discount", "0.9 (gamma)"),
    ]  # fmt: skip


def test_a_push_is_told_with_its_aim() -> None:
    view = pushed().view(0)
    assert (
        simple_regulator.describe_turn(view)
        == "number -0.102. pushed -0.526 by +0.250, aimed at -0.276."
    )
    assert simple_regulator.describe_situation(view) == (
        "number -0.102. a turn here costs 0.010. push by a number from -10 to 10; noise of 0.1"
        " comes on top."
    )


@pytest.mark.parametrize(
    ("push", "drawn"),
    [
        (0.102, " ├────────┬──────●━→────────┬────────┤"),
        (-0.5, " ├──────←━━━━━━━━●─┼────────┬────────┤"),
        (0.0, " ├────────┬──────●─┼────────┬────────┤"),
    ],
)
def test_a_push_that_is_advised_or_written_leads_along_the_line(push: float, drawn: str) -> None:
    board = fit_board(
        simple_regulator, pushed().view(0), DrawOptions(39, 6, suggested_action=push)
    ).plain
    assert drawn in board.split("\n")


class Counted(Sequence[Array]):
    """What a seat saw, which counts how much of it is asked for."""

    def __init__(self, seen: Sequence[Array]) -> None:
        self.seen, self.asked = seen, 0

    def __len__(self) -> int:
        return len(self.seen)

    @overload
    def __getitem__(self, place: int) -> Array: ...
    @overload
    def __getitem__(self, place: slice) -> Sequence[Array]: ...
    def __getitem__(self, place: int | slice) -> Array | Sequence[Array]:
        found = self.seen[place]
        self.asked += len(found) if isinstance(place, slice) else 1
        return found


@pytest.mark.parametrize("turns", [20, 400])
def test_a_frame_asks_for_no_more_turns_than_it_shows(turns: int) -> None:
    game = dmplay.Session(
        dmplay.load_problem("simple-regulator"), dmplay.SeededUniforms(1), turn_limit=turns
    )
    for _ in range(turns):
        game.advance([0.0])
    seen = Counted(game.view(0).observations)
    view = dataclasses.replace(game.view(0), observations=seen)
    fit_board(simple_regulator, view, DrawOptions(80, 24))
    simple_regulator.panel_rows(view)
    assert seen.asked <= 4 * (12 + 1)  # turns of the largest frame, drawn in a few sizes


def test_the_smallest_noise_is_drawn() -> None:
    view = dmplay.Session(
        dmplay.load_problem("simple-regulator", noise=1e-300), dmplay.SeededUniforms(1)
    )
    view.advance([1.0])
    assert fit_board(simple_regulator, view.view(0), DrawOptions(80, 24)).plain.count("█") == 2


def test_the_start_is_told_with_what_can_be_done() -> None:
    view = started("simple-regulator:undiscounted", [0.36]).view(0)
    assert simple_regulator.describe_situation(view) == (
        "number +0.360. a turn here costs 0.130. push by a number from -10 to 10; noise of 0.1"
        " comes on top."
    )


FRAMES = {
    "the regulator and its last pushes": (pushed().view(0), DrawOptions(80, 24), """
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
s -0.102   pushed -0.526 by +0.250, aimed at -0.276"""),
    "the regulator in ascii": (pushed().view(0), DrawOptions(80, 24, ascii=True), """
                              |
                              |
                              |
                              |        <----------------o
                  <--------------------o
               o------>       |
                   _=*#*=_    |
               _.-+#######+-._|
 +--------------+----------*--+--------------+-------------+
-1            -0.5            0            +0.5           +1
s -0.102   pushed -0.526 by +0.250, aimed at -0.276"""),
    "the regulator in a small room": (pushed().view(0), DrawOptions(40, 12), """
                   │    ←──────────∘
            ←───────────∘
          ∘───→    │
          ▁▂▄▇█▇▄▂▁│
 ├────────┬──────●─┼────────┬────────┤
-1      -0.5       0      +0.5      +1
s -0.102  a +0.250  aimed -0.276"""),
    "the regulator in a small room in ascii": (pushed().view(0), DrawOptions(40, 12, ascii=True), """
                   |    <----------o
            <-----------o
          o--->    |
          _.-*#*-._|
 +--------+------*-+--------+--------+
-1      -0.5       0      +0.5      +1
s -0.102  a +0.250  aimed -0.276"""),
    "the regulator at its start": (started("simple-regulator", [0.36]).view(0), DrawOptions(40, 6), """
                   │
                   │▁▂▄▇█▇▄▂▁
 ├────────┬────────┼─────●──┬────────┤
-1      -0.5       0      +0.5      +1
s +0.360   drawn around 0.3"""),
    "the number line grows with the number": (
        started("simple-regulator", [0.36], [10], [0.5, 0.25]).view(0), DrawOptions(80, 12), """
                              │
                              │
                              │
                              │
                              │
                              │∘─────────────→
                              │              █
                              │              █
 ├──────────────┬─────────────┼──────────────●─────────────┤
-20            -10            0             +10           +20
s +10.360   pushed +0.360 by +10.000, aimed at +10.360"""),
    "the number line alone": (started("simple-regulator", [0.36]).view(0), DrawOptions(40, 3), """
 ├────────┬────────┼─────●──┬────────┤
-1      -0.5       0      +0.5      +1"""),
}  # fmt: skip


@pytest.mark.parametrize("what", FRAMES)
def test_a_number_and_its_pushes_are_drawn(what: str) -> None:
    view, look, board = FRAMES[what]
    assert fit_board(simple_regulator, view, look).plain == board[1:]
