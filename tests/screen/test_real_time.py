"""Real time waits for a key, counts down, begins slowly and quickens."""

from dmplay.game.table import Table
from dmplay.screen.acts import pace, tick
from dmplay.screen.clock import STARTS
from dmplay.screen.press import press
from dmplay.screen.screen import Screen
from dmplay.screen.shown import Room
from dmplay.terminal import Terminal
from tests.support.screens import game


def started(*keys: str) -> Screen:
    shown = Screen(
        Table(game("cart-pole", turns=200)), Terminal(True, "", True, True, False), rate=50.0
    )
    for key in keys:
        press(shown, key)
    return shown


def turns(shown: Screen) -> int:
    return len(shown.game.session.turns)


def test_the_clock_says_that_it_starts_with_a_key() -> None:
    shown = started()
    assert shown.shown.message == STARTS
    for _ in range(5):
        tick(shown)
    assert turns(shown) == 0
    press(shown, "left")
    assert shown.shown.message == "3 ..."


def test_the_clock_counts_down_before_the_push_repeats() -> None:
    shown, told = started("left"), []
    for _ in range(5):
        tick(shown)
        told.append((shown.message, turns(shown)))
    assert [message for message, _ in told[:3]] == ["2 ...", "1 ...", ""]
    assert [played for _, played in told] == [0, 0, 0, 1, 2]


def test_a_key_that_plays_nothing_starts_the_clock_but_no_push() -> None:
    shown = started("x")
    for _ in range(6):
        tick(shown)
    assert (shown.message, turns(shown)) == ("press what to do", 0)
    press(shown, "right")
    tick(shown)
    assert turns(shown) == 1


def test_help_and_a_hint_do_not_start_the_clock() -> None:
    shown = started("?", "escape", "L")
    assert not shown.clock.started


def test_the_clock_begins_at_a_tenth_of_its_speed_and_quickens() -> None:
    shown = started("left")
    for _ in range(3):
        tick(shown)
    paces = [pace(shown)]
    for turn in range(40):
        press(shown, "left" if turn % 2 else "right")
        tick(shown)
        paces.append(pace(shown))
    assert paces[0] == 5.0
    assert paces == sorted(paces)
    assert turns(shown) > 10
    assert paces[-1] == 50.0 * (0.1 + 0.9 * turns(shown) / 100)


def test_a_clock_that_is_stopped_does_not_count() -> None:
    shown = started("left", "P")
    for _ in range(5):
        tick(shown)
    assert turns(shown) == 0
    press(shown, "P")
    for _ in range(4):
        tick(shown)
    assert turns(shown) == 1
    assert STARTS not in shown.upper(Room(80, 24)).plain
