"""Tests of the keys of a replay: jumps, the worst choice, and playing on from a turn."""

from pathlib import Path

import pytest

from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.game.playback import Playback
from dmplay.terminal.capabilities import Terminal
from dmplay.ui.screen.footer import format_footer
from dmplay.ui.screen.frame_state import Viewport
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.play_screen import PlayScreen


@pytest.fixture
def screen(tmp_path: Path) -> PlayScreen:
    """Return the replay of a random walk of 8 turns, at its start."""
    path = tmp_path / "walk.dmt"
    request = GameRequest("hexworld", seed=7, agent="random", turns=8, record_path=path)
    game = start_new_game(request)
    for _ in game.iter_agent_turns():
        pass
    game.finish()
    terminal = Terminal(True, "", True, color=False, ascii=False)
    return PlayScreen(GameController(Playback(path)), terminal)


def press(screen: PlayScreen, *keys: str) -> int:
    """Press keys, and return the number of turns before the position."""
    for key in keys:
        handle_key(screen, key)
    return len(screen.game.session.turns)


def test_arrows_home_and_end_move_through_the_turns(screen: PlayScreen) -> None:
    assert press(screen, "right", "right") == 2
    assert press(screen, "left") == 1
    assert press(screen, "end") == 8
    assert press(screen, "home") == 0


def test_the_log_holds_no_later_turn_after_a_jump_back(screen: PlayScreen) -> None:
    press(screen, "end", "2", "enter")
    assert [row.partition(".")[0] for row in screen.log[:-1]] == ["turn 2"]
    press(screen, "right")
    assert [row.partition(".")[0] for row in screen.log[:-1]] == ["turn 2", "turn 3"]
    press(screen, "home")
    assert screen.log[:-1] == []


def test_the_number_of_a_turn_and_enter_go_there(screen: PlayScreen) -> None:
    assert press(screen, "6") == 0
    assert screen.message == "turn 6: Enter goes there"
    assert press(screen, "enter") == 6
    assert press(screen, "1", "2", "backspace", "enter") == 1


def test_a_turn_beyond_the_end_is_refused(screen: PlayScreen) -> None:
    assert press(screen, "right", "9", "enter") == 1
    assert screen.message == "turn 9: this game has 8 turns"


def test_another_key_forgets_the_typed_turn(screen: PlayScreen) -> None:
    assert press(screen, "6", "right") == 1
    assert screen.typed_turn == ""


def test_the_log_ends_with_the_position(screen: PlayScreen) -> None:
    press(screen, "4", "enter")
    assert screen.log[-1].startswith("turn 4 of 8 ───")
    assert screen.log[-1].count("●") == 1


def test_x_goes_to_the_worst_choices_in_order(screen: PlayScreen) -> None:
    assert press(screen, "X") == 4
    assert screen.message == "next, turn 5: chose sw; e was better by 5.23, 3.43 of the score."
    assert screen.log[-1].startswith("value lost each turn ")
    assert screen.log[-1].endswith("[ ] = next turn; most in turns 5, 3, 1")
    assert press(screen, "X") == 2
    assert press(screen, "X") == 0
    assert press(screen, "X") == 4


def test_x_goes_to_the_worst_choice_even_from_its_own_position(screen: PlayScreen) -> None:
    assert press(screen, "4", "enter") == 4  # before turn 5, the worst choice
    assert press(screen, "X") == 4
    assert press(screen, "X") == 2


def test_a_replay_of_undone_turns_can_be_jumped_through(tmp_path: Path) -> None:
    path = tmp_path / "undone.dmt"
    game = start_new_game(GameRequest("hexworld", seed=7, record_path=path))
    for action in (0, 1, 2):
        game.choose(action)
    game.undo(2)
    game.choose(3)
    game.finish()
    terminal = Terminal(True, "", True, color=False, ascii=False)
    screen = PlayScreen(GameController(Playback(path)), terminal)
    press(screen, "end")
    assert press(screen, "home") == 0
    assert press(screen, "2", "enter") == 2
    assert press(screen, "0", "enter") == 0


def test_the_help_page_lists_the_keys_of_a_replay(screen: PlayScreen) -> None:
    press(screen, "?")
    page = "\n".join(screen.page_rows)
    assert "X           worst" in page
    assert "Enter       play on" in page


def test_the_keys_do_not_change_another_game(tmp_path: Path) -> None:
    game = start_new_game(GameRequest("hexworld", seed=7, record_path=tmp_path / "game.dmt"))
    terminal = Terminal(True, "", True, color=False, ascii=False)
    screen = PlayScreen(GameController(game), terminal)
    handle_key(screen, "X")
    assert screen.message == "X: no such key; ? lists the keys"
    game.finish()


def test_the_footer_of_a_replay_keeps_the_keys_for_its_turns_on_a_small_screen(
    screen: PlayScreen,
) -> None:
    footers = {
        columns: format_footer(screen.game, Viewport(columns, 14)).plain.strip()
        for columns in (80, 50, 36, 20)
    }
    assert footers == {
        80: "← → turns  P play  X review  Enter play from here  Tab hint  ? help  q quit",
        50: "← → turns  P play  X review  ? help  q quit",
        36: "← → turns  P play  ? help  q quit",
        20: "? help  q quit",
    }
