"""Real time waits for a key, counts down, begins slowly and quickens."""

from dmplay.game.table import Table
from dmplay.screen.clock import STARTS
from dmplay.screen.screen import Screen
from dmplay.screen.shown import Room
from dmplay.terminal import Terminal
from tests.support.screens import game


def started(*keys: str) -> Screen:
    shown = Screen(
        Table(game("cart-pole", turns=200)), Terminal(True, "", True, True, False), rate=50.0
    )
    for key in keys:
        shown.press(key)
    return shown


def turns(shown: Screen) -> int:
    return len(shown.game.session.turns)


def test_the_clock_says_that_it_starts_with_a_key() -> None:
    shown = started()
    assert shown.shown.message == STARTS
    for _ in range(5):
        shown.tick()
    assert turns(shown) == 0
    shown.press("left")
    assert shown.shown.message == "3 ..."


def test_the_clock_counts_down_before_the_push_repeats() -> None:
    shown, told = started("left"), []
    for _ in range(5):
        shown.tick()
        told.append((shown.message, turns(shown)))
    assert [message for message, _ in told[:3]] == ["2 ...", "1 ...", ""]
    assert [played for _, played in told] == [0, 0, 0, 1, 2]


def test_a_key_that_plays_nothing_starts_the_clock_but_no_push() -> None:
    shown = started("x")
    for _ in range(6):
        shown.tick()
    assert (shown.message, turns(shown)) == ("press what to do", 0)
    shown.press("right")
    shown.tick()
    assert turns(shown) == 1


def test_help_and_a_hint_do_not_start_the_clock() -> None:
    shown = started("?", "escape", "L")
    assert not shown.clock.started


def test_the_clock_begins_at_a_tenth_of_its_speed_and_quickens() -> None:
    shown = started("left")
    for _ in range(3):
        shown.tick()
    paces = [shown.pace]
    for turn in range(40):
        shown.press("left" if turn % 2 else "right")
        shown.tick()
        paces.append(shown.pace)
    assert paces[0] == 5.0
    assert paces == sorted(paces)
    assert turns(shown) > 10
    assert paces[-1] == 50.0 * (0.1 + 0.9 * turns(shown) / 100)


def test_a_clock_that_is_stopped_does_not_count() -> None:
    shown = started("left", "P")
    for _ in range(5):
        shown.tick()
    assert turns(shown) == 0
    shown.press("P")
    for _ in range(4):
        shown.tick()
    assert turns(shown) == 1
    assert STARTS not in shown.upper(Room(80, 24)).plain
