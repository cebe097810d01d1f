"""Tests of real time: it waits for a key, counts down, starts slowly and speeds up."""

from dmplay.game.game_series import GameController
from dmplay.terminal.capabilities import Terminal
from dmplay.ui.screen.frame_state import Viewport
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.play_operations import get_clock_rate, tick_clock
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.screen.realtime_clock import CLOCK_START_HINT
from tests.support.screens import make_game


def make_screen_after_keys(*keys: str) -> PlayScreen:
    play_screen = PlayScreen(
        GameController(make_game("cart-pole", turns=200)),
        Terminal(True, "", True, True, False),
        realtime_rate=50.0,
    )
    for key in keys:
        handle_key(play_screen, key)
    return play_screen


def count_turns(play_screen: PlayScreen) -> int:
    return len(play_screen.game.session.turns)


def test_the_screen_says_that_a_key_starts_the_clock() -> None:
    play_screen = make_screen_after_keys()
    assert play_screen.frame_state.message == CLOCK_START_HINT
    for _ in range(5):
        tick_clock(play_screen)
    assert count_turns(play_screen) == 0
    handle_key(play_screen, "left")
    assert play_screen.frame_state.message == "3 ..."


def test_the_clock_counts_down_before_the_action_repeats() -> None:
    play_screen, messages_and_turns = make_screen_after_keys("left"), []
    for _ in range(5):
        tick_clock(play_screen)
        messages_and_turns.append((play_screen.message, count_turns(play_screen)))
    assert [message for message, _ in messages_and_turns[:3]] == ["2 ...", "1 ...", ""]
    assert [turn_count for _, turn_count in messages_and_turns] == [0, 0, 0, 1, 2]


def test_a_key_without_an_action_starts_the_clock_but_plays_nothing() -> None:
    play_screen = make_screen_after_keys("x")
    for _ in range(6):
        tick_clock(play_screen)
    assert (play_screen.message, count_turns(play_screen)) == ("press an action key", 0)
    handle_key(play_screen, "right")
    tick_clock(play_screen)
    assert count_turns(play_screen) == 1


def test_help_and_a_hint_do_not_start_the_clock() -> None:
    play_screen = make_screen_after_keys("?", "escape", "L")
    assert not play_screen.clock.is_started


def test_the_clock_starts_at_a_tenth_of_its_speed_and_speeds_up() -> None:
    play_screen = make_screen_after_keys("left")
    for _ in range(3):
        tick_clock(play_screen)
    paces = [get_clock_rate(play_screen)]
    for turn in range(40):
        handle_key(play_screen, "left" if turn % 2 else "right")
        tick_clock(play_screen)
        paces.append(get_clock_rate(play_screen))
    assert paces[0] == 5.0
    assert paces == sorted(paces)
    assert count_turns(play_screen) > 10
    assert paces[-1] == 50.0 * (0.1 + 0.9 * count_turns(play_screen) / 100)


def test_a_paused_clock_does_not_advance() -> None:
    play_screen = make_screen_after_keys("left", "P")
    for _ in range(5):
        tick_clock(play_screen)
    assert count_turns(play_screen) == 0
    handle_key(play_screen, "P")
    for _ in range(4):
        tick_clock(play_screen)
    assert count_turns(play_screen) == 1
    assert CLOCK_START_HINT not in play_screen.render_upper(Viewport(80, 24)).plain
