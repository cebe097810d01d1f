"""Tests of PettingZoo environments as problems, simultaneous and turn-based."""

from pathlib import Path

import pytest

import dmplay
from dmplay.core.session import Session
from dmplay.errors import BadParameter, UnknownName
from dmplay.game.action_input import Keyboard
from dmplay.game.key_preferences import DEFAULT_KEY_PREFERENCES
from dmplay.validation.conformance import check
from tests.support.external_problems import check_external_problem

pytestmark = pytest.mark.extra("pettingzoo")

CLASSIC_ENVIRONMENTS = ("classic/rps-v2", "classic/tictactoe-v3", "classic/connect_four-v3")
# from two other families
LARGE_ENVIRONMENTS = ("butterfly/knights_archers_zombies-v11", "sisl/pursuit-v5")


@pytest.mark.slow
def test_environments_can_be_played_recorded_undone_and_verified(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    results = [
        check_external_problem(f"pettingzoo:{name}", path, 20) for name in CLASSIC_ENVIRONMENTS
    ]
    large_results = [
        check_external_problem(f"pettingzoo:{name}", path, 4) for name in LARGE_ENVIRONMENTS
    ]
    assert [result.refused for result in [*results, *large_results]] == [""] * 5
    assert [check(dmplay.load_problem(result.name)) for result in results] == [[], [], []]


def test_in_a_turn_based_environment_the_others_wait_and_masks_are_legal_actions() -> None:
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


def test_in_a_simultaneous_environment_every_agent_acts() -> None:
    game = Session(dmplay.load_problem("pettingzoo:classic/rps-v2"), dmplay.SeededUniforms(1))
    game.advance([0, 1])
    assert game.total_rewards().tolist() == [-1.0, 1.0]
    assert [float(game.view(seat).observation) for seat in range(2)] == [1.0, 0.0]


def test_an_invalid_environment_is_an_error_of_one_line() -> None:
    with pytest.raises(UnknownName, match="did you mean classic/rps-v2"):
        dmplay.load_problem("pettingzoo:classic/rps-v1")
    with pytest.raises(
        BadParameter, match=r"leduc_holdem-v4: .*pip install 'pettingzoo\[classic\]'"
    ):
        dmplay.load_problem("pettingzoo:classic/leduc_holdem-v4")
    with pytest.raises(BadParameter, match=r"pettingzoo:classic/rps-v2\(moves=3\): .*'moves'"):
        dmplay.load_problem("pettingzoo:classic/rps-v2(moves=3)")
