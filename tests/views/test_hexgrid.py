"""Maps of hexes: what came of a move on them, and what they take to be drawn."""

from dmplay.views.canvas import measure_text as measured
from dmplay.views.hexgrid import HexCell, HexMove, HexSize, classify_move, iter_maps
from dmplay.views.style import DrawOptions


def test_a_walk_is_straight_on_a_slip_or_a_bump() -> None:
    assert classify_move((2, 1), (2, 2), 1) == HexMove("NE", has_slipped=False)
    assert classify_move((2, 1), (2, 2), 0) == HexMove("NE", has_slipped=True)
    assert classify_move((2, 1), (2, 1), 0) == HexMove("", has_slipped=False)


def test_a_walk_says_itself() -> None:
    walks = HexMove("NE", False), HexMove("E", True), HexMove("", False)
    assert [walk.description for walk in walks] == [
        "moved NE",
        "slipped, moved E",
        "bumped, stayed",
    ]


def test_a_map_without_room_is_as_large_but_blank() -> None:
    def hex_(place: object, size: HexSize) -> HexCell:
        return HexCell("@", dot_glyph="@")

    hexes = [(q, 0) for q in range(5)]
    roomy, narrow = ([*iter_maps(hexes, hex_, DrawOptions(columns, 9))] for columns in (31, 30))
    assert [measured(drawn) for drawn in roomy] == [(31, 4), (21, 3), (18, 1), (9, 1)]
    assert measured(narrow[0]) == (31, 4)
    assert not narrow[0].plain.strip()
    assert [drawn.plain for drawn in narrow[1:]] == [drawn.plain for drawn in roomy[1:]]


def test_hexes_far_apart_are_no_work() -> None:
    drawn = list[object]()

    def hex_(place: object, size: HexSize) -> HexCell:
        drawn.append(place)
        return HexCell("@")

    smallest = [*iter_maps([(-1000, -1000), (1000, 1000)], hex_, DrawOptions(300, 100))][-1]
    assert measured(smallest) == (6001, 2001)
    assert not drawn
