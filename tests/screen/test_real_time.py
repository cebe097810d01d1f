"""Real time waits for a key, counts down, begins slowly and quickens."""

from dmplay.game.table import GameController
from dmplay.screen.acts import clock_rate, tick_clock
from dmplay.screen.clock import CLOCK_START_HINT
from dmplay.screen.press import handle_key
from dmplay.screen.screen import PlayScreen
from dmplay.screen.shown import Viewport
from dmplay.terminal import Terminal
from tests.support.screens import game


def started(*keys: str) -> PlayScreen:
    shown = PlayScreen(
        GameController(game("cart-pole", turns=200)),
        Terminal(True, "", True, True, False),
        realtime_rate=50.0,
    )
    for key in keys:
        handle_key(shown, key)
    return shown


def turns(shown: PlayScreen) -> int:
    return len(shown.game.session.turns)


def test_the_clock_says_that_it_starts_with_a_key() -> None:
    shown = started()
    assert shown.frame_state.message == CLOCK_START_HINT
    for _ in range(5):
        tick_clock(shown)
    assert turns(shown) == 0
    handle_key(shown, "left")
    assert shown.frame_state.message == "3 ..."


def test_the_clock_counts_down_before_the_push_repeats() -> None:
    shown, told = started("left"), []
    for _ in range(5):
        tick_clock(shown)
        told.append((shown.message, turns(shown)))
    assert [message for message, _ in told[:3]] == ["2 ...", "1 ...", ""]
    assert [played for _, played in told] == [0, 0, 0, 1, 2]


def test_a_key_that_plays_nothing_starts_the_clock_but_no_push() -> None:
    shown = started("x")
    for _ in range(6):
        tick_clock(shown)
    assert (shown.message, turns(shown)) == ("press what to do", 0)
    handle_key(shown, "right")
    tick_clock(shown)
    assert turns(shown) == 1


def test_help_and_a_hint_do_not_start_the_clock() -> None:
    shown = started("?", "escape", "L")
    assert not shown.clock.is_started


def test_the_clock_begins_at_a_tenth_of_its_speed_and_quickens() -> None:
    shown = started("left")
    for _ in range(3):
        tick_clock(shown)
    paces = [clock_rate(shown)]
    for turn in range(40):
        handle_key(shown, "left" if turn % 2 else "right")
        tick_clock(shown)
        paces.append(clock_rate(shown))
    assert paces[0] == 5.0
    assert paces == sorted(paces)
    assert turns(shown) > 10
    assert paces[-1] == 50.0 * (0.1 + 0.9 * turns(shown) / 100)


def test_a_clock_that_is_stopped_does_not_count() -> None:
    shown = started("left", "P")
    for _ in range(5):
        tick_clock(shown)
    assert turns(shown) == 0
    handle_key(shown, "P")
    for _ in range(4):
        tick_clock(shown)
    assert turns(shown) == 1
    assert CLOCK_START_HINT not in shown.render_upper(Viewport(80, 24)).plain
