"""Environments of PettingZoo are played, those in which all act at once and those of turns."""

from pathlib import Path

import pytest

import dmplay
from dmplay.conformance import check
from dmplay.errors import BadParameter, UnknownName
from dmplay.keys.keyboard import Keyboard
from dmplay.keys.keymap import DEFAULT_KEY_PREFERENCES
from dmplay.session import Session
from tests.support.guests import tried

PLAYED = ("classic/rps-v2", "classic/tictactoe-v3", "classic/connect_four-v3")
LARGE = ("butterfly/knights_archers_zombies-v11", "sisl/pursuit-v5")  # of two more families


@pytest.mark.slow
def test_they_play_record_undo_and_verify(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    found = [tried(f"pettingzoo:{name}", path, 20) for name in PLAYED]
    large = [tried(f"pettingzoo:{name}", path, 4) for name in LARGE]
    assert [one.refused for one in [*found, *large]] == [""] * 5
    assert [check(dmplay.load_problem(one.name)) for one in found] == [[], [], []]


def test_in_one_of_turns_the_others_wait_and_masks_say_what_is_legal() -> None:
    board = dmplay.load_problem("pettingzoo:classic/tictactoe-v3")
    game = Session(board, dmplay.SeededUniforms(1))
    game.advance([4, None])
    assert [game.is_inactive(0), game.is_inactive(1)] == [True, False]
    legal = game.legal_actions_mask(1)
    assert legal is not None
    assert legal.nonzero()[0].tolist() == [0, 1, 2, 3, 5, 6, 7, 8]
    assert board.draw_observation(game.view(1).observation) == ". . .\n. o .\n. . ."  # type: ignore[attr-defined]
    keyboard = Keyboard(board, [0, 1], DEFAULT_KEY_PREFERENCES)
    assert keyboard.parse_action(game.view(1), "3") == 3.0
    assert keyboard.find_key_action(1, "3") == (1, 3)
    assert [key for key, _, _ in keyboard.list_actions_with_keys(game.view(1))] == [*"012345678"]
    for action in (0, 3, 1, 5):
        game.advance(
            [action if game.is_inactive(1) else None, action if game.is_inactive(0) else None]
        )
    assert game.end_reason == "terminal"
    assert game.total_rewards().tolist() == [1.0, -1.0]


def test_in_one_of_all_at_once_nobody_waits() -> None:
    game = Session(dmplay.load_problem("pettingzoo:classic/rps-v2"), dmplay.SeededUniforms(1))
    game.advance([0, 1])
    assert game.total_rewards().tolist() == [-1.0, 1.0]
    assert [float(game.view(seat).observation) for seat in range(2)] == [1.0, 0.0]


def test_what_cannot_be_played_is_said_in_a_line() -> None:
    with pytest.raises(UnknownName, match="did you mean classic/rps-v2"):
        dmplay.load_problem("pettingzoo:classic/rps-v1")
    with pytest.raises(
        BadParameter, match=r"leduc_holdem-v4: .*pip install 'pettingzoo\[classic\]'"
    ):
        dmplay.load_problem("pettingzoo:classic/leduc_holdem-v4")
    with pytest.raises(BadParameter, match=r"pettingzoo:classic/rps-v2\(moves=3\): .*'moves'"):
        dmplay.load_problem("pettingzoo:classic/rps-v2(moves=3)")
