"""Tests of real time: it waits for a key, counts down, starts slowly and speeds up."""

from pathlib import Path

import pytest

from dmplay.game.game_series import GameController
from dmplay.terminal.capabilities import Terminal
from dmplay.terminal.key_releases import KEYBOARD_QUERY, REPORT_RELEASES, STOP_REPORTS
from dmplay.ui.screen.footer import format_footer
from dmplay.ui.screen.frame_state import Viewport
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.play_operations import get_clock_rate, tick_clock
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.screen.realtime_clock import CLOCK_START_HINT, RealtimeClock
from tests.support.screens import make_game
from tests.support.terminals import Terminal as PseudoTerminal


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


CLOCK_PROBLEM = """\
from dmplay.problems.mountain_car.rules import MountainCar
from dmplay.views.protocol import Clock

class Drift(MountainCar):
    "A car on a hill."

class VIEW:
    KEYS = {"h": "left", "l": "right"}
    def clock(view):
        return Clock(20.0, ("coast",))
"""


@pytest.fixture(params=["cart-pole", "mountain-car", "./drift.py"])
def timed_screen(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> PlayScreen:
    """A game with a clock, of a built-in problem and of a user's."""
    (tmp_path / "drift.py").write_text(CLOCK_PROBLEM)
    monkeypatch.chdir(tmp_path)
    game = make_game(request.param, turns=100)
    terminal = Terminal(True, "", True, color=True, ascii=False)
    return PlayScreen(GameController(game), terminal)


def read_footer(screen: PlayScreen) -> str:
    return format_footer(screen.game, Viewport(80, 24), screen.frame_state).plain


def test_p_starts_slow_motion_and_stops_it(timed_screen: PlayScreen) -> None:
    assert "P real-time" in read_footer(timed_screen)
    handle_key(timed_screen, "P")
    assert "slow motion" in timed_screen.message
    assert "P stop  + faster  - slower" in read_footer(timed_screen)
    handle_key(timed_screen, "l")
    for _ in range(8):
        tick_clock(timed_screen)
    assert count_turns(timed_screen) > 3
    slow = get_clock_rate(timed_screen)
    handle_key(timed_screen, "+")
    assert get_clock_rate(timed_screen) == 1.5 * slow
    for _ in range(9):
        handle_key(timed_screen, "+")
    full_speed = "real time: 50" if "cart-pole" in timed_screen.game.problem_name else ": 20"
    assert full_speed in timed_screen.message
    handle_key(timed_screen, "P")
    turn_count = count_turns(timed_screen)
    tick_clock(timed_screen)
    assert count_turns(timed_screen) == turn_count
    if not timed_screen.game.session.over:
        handle_key(timed_screen, "l")
        assert count_turns(timed_screen) == turn_count + 1


def test_a_released_key_leaves_the_key_that_is_held_or_the_idle_actions() -> None:
    clock = RealtimeClock(5.0, idle_actions=(1.0, 2.0))
    clock.press_key("h", 0.0)
    clock.press_key("l", 3.0)
    clock.release_key("x")
    assert clock.find_action(0) == 3.0
    clock.release_key("l")
    assert clock.find_action(0) == 0.0
    clock.release_key("h")
    assert [clock.find_action(turn) for turn in range(3)] == [1.0, 2.0, 1.0]
    clock.press_key("h", 0.0)
    assert clock.find_action(4) == 0.0


def test_without_idle_actions_the_last_action_repeats_after_its_release() -> None:
    clock = RealtimeClock(5.0)
    clock.press_key("h", 0.0)
    clock.release_key("h")
    assert clock.find_action(1) == 0.0


def test_a_terminal_that_reports_releases_is_asked_for_them_until_the_end(tmp_path: Path) -> None:
    with PseudoTerminal("mountain-car", "--seed", "7", folder=tmp_path) as terminal:
        terminal.until(lambda: KEYBOARD_QUERY in terminal.printed)
        terminal.ready()
        assert REPORT_RELEASES not in terminal.printed
        terminal.press("\x1b[?0u", lambda: REPORT_RELEASES in terminal.printed)
        terminal.press("P", "slow motion")
        terminal.press("l\x1b[108;1:3u", "coasted")
        terminal.press("q", lambda: STOP_REPORTS in terminal.printed)
        assert terminal.ended() == 0


def test_a_game_without_a_clock_does_not_ask_for_releases(tmp_path: Path) -> None:
    with PseudoTerminal("hexworld", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready().press("q").ended()
        assert KEYBOARD_QUERY not in terminal.printed
