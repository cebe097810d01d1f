"""Maps of hexes: what came of a move on them."""

from dmplay.views.hexgrid import Walk, walked


def test_a_walk_is_straight_on_a_slip_or_a_bump() -> None:
    assert walked((2, 1), (2, 2), 1) == Walk("NE", slipped=False)
    assert walked((2, 1), (2, 2), 0) == Walk("NE", slipped=True)
    assert walked((2, 1), (2, 1), 0) == Walk("", slipped=False)


def test_a_walk_says_itself() -> None:
    walks = Walk("NE", False), Walk("E", True), Walk("", False)
    assert [walk.said for walk in walks] == ["moved NE", "slipped, moved E", "bumped, stayed"]
