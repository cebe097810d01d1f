"""The review as columns."""

from dmplay.advice.review import ReviewedAction, format_table


def move(turn: int, seat: str, chosen: str, regret: float) -> ReviewedAction:
    """A move of which left and up were the best."""
    return ReviewedAction(turn, seat, chosen, ("left", "up"), regret, {})


def test_the_worst_moves_come_first_and_equal_ones_in_order() -> None:
    made = [move(1, "agent", "up", 0.0), move(2, "agent", "right", 0.5), move(3, "agent", "d", 2.0)]
    assert format_table([*made, move(4, "agent", "left", 0.0)]) == [
        "turn  yours  best        regret",
        "3     d      left or up  2.00 ####################",
        "2     right  left or up  0.50 #####",
        "1     up     left or up  0.00",
        "4     left   left or up  0.00",
        "review: 2 of 4 moves the best, regret 2.50 in all, most in turn 3",
    ]


def test_no_bar_is_longer_than_the_others_and_what_all_actions_are_is_any() -> None:
    known = move(1, "agent", "down", 1.69)._replace(values={"left": 1.0, "up": 1.0})
    assert format_table([known])[1] == "1     down   any   1.69 ####################"


def test_several_people_are_named() -> None:
    told = format_table([move(1, "agent1", "up", 0.0), move(1, "agent2", "down", 1.0)])
    assert told[0] == "turn  seat    yours  best        regret"
    assert told[1] == "1     agent2  down   left or up  1.00 ####################"


def test_where_nothing_is_known_there_are_no_columns() -> None:
    assert format_table([]) == ["review: no agent here knows the values of these moves"]
