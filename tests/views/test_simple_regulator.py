"""Tests of the simple-regulator view, frame by frame."""

import dataclasses
from collections.abc import Sequence
from typing import overload

import pytest

import dmplay
from dmplay.core.arrays import Array
from dmplay.core.session import Session
from dmplay.draw.options import DrawOptions
from dmplay.views.protocol import fit_board, load_view_module
from tests.support.games import make_session_from_state

simple_regulator = load_view_module(dmplay.load_problem("simple-regulator"))


def make_pushed_game() -> Session:
    return make_session_from_state(
        "simple-regulator", [0.9], [-0.6, -0.7, 0.25], [0.5, 0.25], [0.7, 0.6], [0.9, 0.1]
    )


def test_the_panel_shows_the_cost_of_the_number() -> None:
    view = make_pushed_game().view(0)
    assert simple_regulator.panel_rows(view) == [
        ("number", "-0.102"), ("costs now", "0.0104"), ("pushed", "+0.250"), ("aimed at", "-0.276"),
        ("last turn", "-0.2762"), ("noise", "0.1"), ("push by", "-10 to 10"),
        ("discount", "0.9 (gamma)"),
    ]  # fmt: skip


def test_the_panel_shows_no_cost_of_the_number_after_the_end() -> None:
    view = dataclasses.replace(make_pushed_game().view(0), end_reason="horizon")
    assert "costs now" not in dict(simple_regulator.panel_rows(view))


def test_a_push_is_described_with_its_target() -> None:
    view = make_pushed_game().view(0)
    assert (
        simple_regulator.describe_turn(view)
        == "at -0.526 pushed +0.250, aimed at -0.276, chance moved it to -0.102."
    )
    assert simple_regulator.describe_situation(view) == (
        "number -0.102. a turn here costs 0.0104. push by a number from -10 to 10; noise of about "
        "0.1 is added."
    )


@pytest.mark.parametrize(
    ("push", "expected_row"),
    [
        (0.102, " ├────────┬──────●━→────────┬────────┤"),
        (-0.5, " ├──────←━━━━━━━━●─┼────────┬────────┤"),
        (0.0, " ├────────┬──────●─┼────────┬────────┤"),
    ],
)
def test_a_suggested_or_typed_push_is_drawn_along_the_number_line(
    push: float, expected_row: str
) -> None:
    board = fit_board(
        simple_regulator, make_pushed_game().view(0), DrawOptions(39, 6, suggested_action=push)
    ).plain
    assert expected_row in board.split("\n")


class CountingSequence(Sequence[Array]):
    """A sequence of observations that counts the elements that are read."""

    def __init__(self, values: Sequence[Array]) -> None:
        self.values, self.read_count = values, 0

    def __len__(self) -> int:
        return len(self.values)

    @overload
    def __getitem__(self, index: int) -> Array: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Array]: ...
    def __getitem__(self, index: int | slice) -> Array | Sequence[Array]:
        result = self.values[index]
        self.read_count += len(result) if isinstance(index, slice) else 1
        return result


@pytest.mark.parametrize("turns", [20, 400])
def test_a_frame_reads_only_the_turns_that_it_shows(turns: int) -> None:
    game = dmplay.Session(
        dmplay.load_problem("simple-regulator"), dmplay.SeededUniforms(1), turn_limit=turns
    )
    for _ in range(turns):
        game.advance([0.0])
    observations = CountingSequence(game.view(0).observations)
    view = dataclasses.replace(game.view(0), observations=observations)
    fit_board(simple_regulator, view, DrawOptions(80, 24))
    simple_regulator.panel_rows(view)
    # the largest frame shows 12 turns and is tried in a few sizes
    assert observations.read_count <= 4 * (12 + 1)


def test_the_smallest_noise_is_drawn() -> None:
    game = dmplay.Session(
        dmplay.load_problem("simple-regulator", noise=1e-300), dmplay.SeededUniforms(1)
    )
    game.advance([1.0])
    assert fit_board(simple_regulator, game.view(0), DrawOptions(80, 24)).plain.count("█") == 2


def test_the_description_at_the_start_lists_the_possible_pushes() -> None:
    view = make_session_from_state("simple-regulator:undiscounted", [0.36]).view(0)
    assert simple_regulator.describe_situation(view) == (
        "number +0.360. a turn here costs 0.1296. push by a number from -10 to 10; noise of about "
        "0.1 is added."
    )


FRAMES = {
    "the regulator and its last pushes": (make_pushed_game().view(0), DrawOptions(80, 24), """
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
s -0.102   at -0.526 pushed +0.250, aimed at -0.276"""),
    "the regulator in ascii": (make_pushed_game().view(0), DrawOptions(80, 24, ascii=True), """
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
s -0.102   at -0.526 pushed +0.250, aimed at -0.276"""),
    "the regulator in a small room": (make_pushed_game().view(0), DrawOptions(40, 12), """
                   │    ←──────────∘
            ←───────────∘
          ∘───→    │
          ▁▂▄▇█▇▄▂▁│
 ├────────┬──────●─┼────────┬────────┤
-1      -0.5       0      +0.5      +1
s -0.102  a +0.250  aimed -0.276"""),
    "the regulator in a small room in ascii": (
        make_pushed_game().view(0),
        DrawOptions(40, 12, ascii=True),
        """
                   |    <----------o
            <-----------o
          o--->    |
          _.-*#*-._|
 +--------+------*-+--------+--------+
-1      -0.5       0      +0.5      +1
s -0.102  a +0.250  aimed -0.276""",
    ),
    "the regulator at its start": (
        make_session_from_state("simple-regulator", [0.36]).view(0),
        DrawOptions(40, 6),
        """
                   │
                   │▁▂▄▇█▇▄▂▁
 ├────────┬────────┼─────●──┬────────┤
-1      -0.5       0      +0.5      +1
s +0.360   starts around 0.3""",
    ),
    "the number line grows with the number": (
        make_session_from_state("simple-regulator", [0.36], [10], [0.5, 0.25]).view(0),
        DrawOptions(80, 12),
        """
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
s +10.360   at +0.360 pushed +10.000, aimed at +10.360""",
    ),
    "the number line alone": (
        make_session_from_state("simple-regulator", [0.36]).view(0),
        DrawOptions(40, 3),
        """
 ├────────┬────────┼─────●──┬────────┤
-1      -0.5       0      +0.5      +1""",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", FRAMES)
def test_a_number_and_its_pushes_are_drawn(case: str) -> None:
    view, options, expected = FRAMES[case]
    assert fit_board(simple_regulator, view, options).plain == expected[1:]
