"""Tests that a program that violates the protocol forfeits its game and does no other harm."""

import contextlib
import shlex
import sys
import time
from pathlib import Path

import pytest

from dmplay.game.game import Game
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from tests.external.bots import abuser
from tests.support.games import assert_verified, read_values

pytestmark = pytest.mark.slow
MAX_POLLS = 10_000  # number of polls
COMMAND = f"bot:clock=0.2,{shlex.quote(sys.executable)} -S -E {abuser.__file__}"
EXPECTED_MESSAGES = {
    "silent": "silent: the bot did not answer within 0.2 s",
    "deaf": "deaf: the bot did not read its input within 0.2 s",
    "dead": "dead: the bot was ended by signal SIGKILL",
    "late": "late: the bot answered after more than 0.2 s",
    "garbled": "garbled: the bot sent 'ne': Expecting value, at column 1",
    "illegal": "illegal: unknown action '101'; did you mean 11 or 10 or 100?",
    "flooding": "garbled: the bot sent 1000 lines without an answer",
    "forking": "dead: the bot ended with exit code 0",
    "endless line": "garbled: the bot sent a line of more than 65536 characters",
    "wrong id": "garbled: got id 77, expected 1",
    "wrong version": "garbled: got protocol 2, expected 1",
    "exits early": r"dead: the bot ended with exit code 3; its stderr ends with 'this'",
}


def play_abuse(kind: str, folder: Path) -> Game:
    """Play a game against a program that misbehaves in this way."""
    agent, record = f"{COMMAND} {kind!r} {folder / 'number'}", folder / f"{kind}.dmt"
    request = GameRequest("travelers-dilemma", seed=7, turns=1000, agent=agent, record_path=record)
    game = start_new_game(request)
    while game.play_agent_turn():
        pass
    game.finish()
    return game


def list_live_processes(folder: Path) -> list[str]:
    """Return the states of the live processes in the process group of a program."""
    group = (folder / "number").read_text().strip()
    states = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # the process ended in the meantime
            state, _, process_group, *_ = path.read_text().rpartition(")")[2].split()
            states += [state] if process_group == group and state != "Z" else []
    return states


@pytest.fixture(autouse=True)
def _state_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


@pytest.mark.parametrize("kind", abuser.ABUSES)
def test_an_abuse_is_a_forfeit_with_one_line_and_leaves_no_process(
    kind: str, tmp_path: Path
) -> None:
    game = play_abuse(kind, tmp_path)
    path = tmp_path / f"{kind}.dmt"
    assert game.narrator.end_explanation == f"agent1 forfeits, {EXPECTED_MESSAGES[kind]}"
    assert game.narrator.describe_result().startswith("forfeit after ")
    assert '"reason": "forfeit"' in read_values(path, "end")[0]
    assert path.read_text().endswith(f"\n# {game.narrator.end_explanation}\n")
    assert_verified(path)
    poll_count = 0
    while (
        list_live_processes(tmp_path) and poll_count < MAX_POLLS
    ):  # killed processes disappear late
        poll_count += 1
        time.sleep(0.001)
    assert list_live_processes(tmp_path) == []


def test_the_standard_error_of_a_program_is_logged(tmp_path: Path) -> None:
    (log,) = play_abuse("exits early", tmp_path).log_paths
    assert log.read_text() == "no more\x1b[2J of\nthis\n"
