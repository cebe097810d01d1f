"""Leaks are detected: each test plants one in a place that the other tests check."""

from pathlib import Path

import numpy as np
import pytest

from dmplay.core.arrays import Array, Bools
from dmplay.game.game import Game
from dmplay.game.narration import Narrator
from dmplay.terminal.painter import Painter
from dmplay.ui.shell import commands
from dmplay.ui.shell.commands import Command
from dmplay.views import generic
from tests.privacy.command_arguments import list_actions
from tests.privacy.front_ends import (
    FRONT_ENDS,
    TRANSCRIPT_PATH,
    Response,
    assert_indistinguishable,
    iter_readable_files,
    play_both,
)
from tests.privacy.handover import play_handover
from tests.privacy.indistinguishable_pairs import USER_PROBLEM, Pair, Side, find_pair
from tests.privacy.other_terminals import (
    assert_no_leak_outside,
    iter_lines,
    list_completions,
    start_unfinished_game,
)
from tests.support.user_problems import Vault

LEAK_MESSAGE = "can be told apart"
every_front_end = pytest.mark.parametrize("front", FRONT_ENDS)


@pytest.fixture
def twins() -> Pair:
    """Two games of a user-defined problem."""
    return find_pair(USER_PROBLEM, 0)


@every_front_end
def test_a_command_that_reveals_the_state_is_detected(
    front: str, twins: Pair, game_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    command = Command("tell", "", "", lambda table, _: str(table.game.session.state))
    monkeypatch.setitem(commands.COMMANDS_BY_NAME, "tell", command)
    lines = [*list_actions(twins), "tell"]
    with pytest.raises(AssertionError, match=LEAK_MESSAGE):
        assert_indistinguishable(
            *play_both(
                twins,
                game_folder,
                lambda side: FRONT_ENDS[front](twins.begun(side, TRANSCRIPT_PATH), lines),
            )
        )


@every_front_end
def test_a_view_that_reveals_the_state_is_detected(
    front: str, twins: Pair, game_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The view gets the state, which no view receives, from the problem."""
    leaked_states: list[str] = []

    def terminal(self: Vault, s: Array) -> Bools:
        leaked_states.append(str(s))
        return np.zeros(len(s), bool)

    monkeypatch.setattr(Vault, "terminal", terminal)
    monkeypatch.setattr(generic, "describe_turn", lambda view: leaked_states[-1])
    monkeypatch.setattr(
        Narrator, "visible_turn_facts", lambda self, view: {"seen": leaked_states[-1]}
    )
    lines = list_actions(twins)
    with pytest.raises(AssertionError, match=LEAK_MESSAGE):
        assert_indistinguishable(
            *play_both(
                twins,
                game_folder,
                lambda side: FRONT_ENDS[front](twins.begun(side, TRANSCRIPT_PATH), lines),
            )
        )


def test_a_title_that_reveals_the_seed_is_detected(
    twins: Pair, game_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def titled(self: Painter) -> None:
        self.stream.write(f"\x1b]0;{games[-1].seed}\x07")

    games: list[Game] = []
    monkeypatch.setattr(Painter, "mark_screen_unknown", titled)

    def play(side: Side) -> list[Response]:
        games.append(twins.begun(side, TRANSCRIPT_PATH))
        return FRONT_ENDS["screen"](games[-1], [])

    with pytest.raises(AssertionError, match=LEAK_MESSAGE):
        assert_indistinguishable(*play_both(twins, game_folder, play))


@pytest.mark.parametrize("name", ["rock-paper-scissors", "multicaregiver-crying-baby"])
def test_a_command_that_reveals_the_other_choice_is_detected(
    name: str, game_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    command = Command("tell", "", "", lambda table, _: str(table.game._pending_choices))
    monkeypatch.setitem(commands.COMMANDS_BY_NAME, "tell", command)
    twins = find_pair(name, 1)
    with pytest.raises(AssertionError, match=LEAK_MESSAGE):
        assert_indistinguishable(
            *play_both(twins, game_folder, lambda side: play_handover(twins, side, ["tell"]))
        )


def test_a_file_that_other_users_can_read_is_detected(twins: Pair, game_folder: Path) -> None:
    def play(side: Side) -> list[Response]:
        start_unfinished_game(twins, side)
        TRANSCRIPT_PATH.chmod(0o644)
        return [*iter_readable_files(game_folder)]

    with pytest.raises(AssertionError, match=LEAK_MESSAGE):
        assert_indistinguishable(*play_both(twins, game_folder, play))


def test_a_replay_in_another_terminal_is_detected(
    twins: Pair, game_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "replay game.dmt --json --trust" in iter_lines(twins, "replay")
    monkeypatch.setattr(
        "dmplay.game.playback.mark_peeked_if_concealed", lambda transcript, *_, **__: transcript
    )
    with pytest.raises(AssertionError, match=LEAK_MESSAGE):
        assert_no_leak_outside(twins, monkeypatch, "replay", killed=True)


def test_a_completed_seed_is_detected(
    twins: Pair, game_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The seed is that of a game whose file says that it is over."""

    def play(side: Side) -> list[Response]:
        start_unfinished_game(twins, side, None).end_game()
        return list_completions(twins, side, monkeypatch)

    with pytest.raises(AssertionError, match=LEAK_MESSAGE):
        assert_indistinguishable(*play_both(twins, game_folder, play))
