"""Tests of hexagonal maps: results of moves, and the space that a map needs."""

from rich.text import Text

from dmplay.draw.canvas import measure_text as measured
from dmplay.draw.hex_map import HexCell, HexSize, describe_move, format_distance, iter_maps
from dmplay.draw.options import DrawOptions
from dmplay.problems.hexworld.rules import HexWorld


def test_a_move_is_straight_a_slip_or_a_bump() -> None:
    hexes = [(2, 1), (2, 2)]
    assert describe_move(hexes, (2, 1), (2, 2), 1) == ("NE", "moved NE")
    assert describe_move(hexes, (2, 1), (2, 2), 0) == ("slip NE", "slipped, moved NE")
    assert describe_move(hexes, (2, 1), (2, 1), 0) == ("bump", "bumped, stayed")


def test_a_bump_is_a_slip_if_the_chosen_hex_is_on_the_map() -> None:
    move = describe_move([(2, 1), (2, 2)], (2, 1), (2, 1), 1)
    assert move == ("slip bump", "slipped, bumped, stayed")


def test_a_map_too_wide_for_the_screen_is_blank_and_has_the_same_size() -> None:
    def hex_(position: object, size: HexSize) -> HexCell:
        return HexCell("@", dot_glyph="@")

    hexes = [(q, 0) for q in range(5)]
    wide, narrow = ([*iter_maps(hexes, hex_, DrawOptions(columns, 9))] for columns in (31, 30))
    assert [measured(board) for board in wide] == [(31, 4), (21, 3), (18, 1), (9, 1)]
    assert measured(narrow[0]) == (31, 4)
    assert not narrow[0].plain.strip()
    assert [board.plain for board in narrow[1:]] == [board.plain for board in wide[1:]]


def test_hexes_outside_the_screen_are_not_drawn() -> None:
    positions = list[object]()

    def hex_(position: object, size: HexSize) -> HexCell:
        positions.append(position)
        return HexCell("@")

    smallest = [*iter_maps([(-1000, -1000), (1000, 1000)], hex_, DrawOptions(300, 100))][-1]
    assert measured(smallest) == (6001, 2001)
    assert not positions


def test_a_distance_is_that_of_the_shortest_path_around_the_holes_of_the_map() -> None:
    hexes = HexWorld().hexes
    assert format_distance(hexes, (0, 2), (1, 2)) == "1 step"
    # The straight way of nine steps leads through two holes of the lower row.
    assert format_distance(hexes, (0, 0), (9, 0)) == "11 steps"


def test_a_change_of_a_drawn_map_does_not_change_the_next_one() -> None:
    def draw() -> Text:
        return next(iter_maps(((0, 0), (1, 0)), lambda *_: HexCell("@"), DrawOptions(40, 9)))

    first = draw()
    plain = first.plain
    first.append("changed", "red")
    assert (draw().plain, draw().spans == first.spans) == (plain, False)
