"""A program that does not keep the protocol loses its game, and nothing else."""

import contextlib
import shlex
import sys
import time
from pathlib import Path

import pytest

from dmplay.game.game import Game
from dmplay.game.request import GameRequest
from dmplay.game.start import start_new_game
from tests.bots import abuser
from tests.support.games import values, verified

pytestmark = pytest.mark.slow
PATIENCE = 10_000  # looks
COMMAND = f"bot:clock=0.2,{shlex.quote(sys.executable)} -S -E {abuser.__file__}"
TOLD = {
    "silent": "silent: did not answer in 0.2 s",
    "deaf": "deaf: did not read what it was told in 0.2 s",
    "dead": "dead: was ended by SIGKILL",
    "late": "late: answered after more than 0.2 s",
    "garbled": "garbled: said 'ne': Expecting value: line 1 column 1 (char 0)",
    "illegal": "illegal: unknown action '101'; did you mean 11 or 10 or 100?",
    "flooding": "garbled: said 1000 lines that answer nothing",
    "forking": "dead: ended with exit code 0",
    "endless line": "garbled: said a line of over 65536 characters",
    "wrong id": "garbled: answered id 77, expected 1",
    "wrong version": "garbled: speaks protocol 2, expected 1",
    "exits early": r"dead: ended with exit code 3; it says 'this'",
}


def played(kind: str, folder: Path) -> Game:
    """A game in which this comes to pass."""
    agent, record = f"{COMMAND} {kind!r} {folder / 'number'}", folder / f"{kind}.dmt"
    wanted = GameRequest("travelers-dilemma", seed=7, turns=1000, agent=agent, record_path=record)
    game = start_new_game(wanted)
    while game.play_agent_turn():
        pass
    game.finish()
    return game


def left(folder: Path) -> list[str]:
    """The processes that live on in the group of a program."""
    group = (folder / "number").read_text().strip()
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it ended meanwhile
            state, _, its, *_ = path.read_text().rpartition(")")[2].split()
            found += [state] if its == group and state != "Z" else []
    return found


@pytest.fixture(autouse=True)
def _state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


@pytest.mark.parametrize("kind", abuser.ABUSES)
def test_an_abuse_is_a_forfeit_in_a_line_and_nothing_is_left_of_it(
    kind: str, tmp_path: Path
) -> None:
    game = played(kind, tmp_path)
    path = tmp_path / f"{kind}.dmt"
    assert game.narrator.forfeit_reason == f"agent1 forfeits, {TOLD[kind]}"
    assert game.narrator.describe_result().startswith("forfeit after ")
    assert '"reason": "forfeit"' in values(path, "end")[0]
    assert path.read_text().endswith(f"\n# {game.narrator.forfeit_reason}\n")
    verified(path)
    tries = 0
    while left(tmp_path) and tries < PATIENCE:  # what is killed takes a moment to be gone
        tries += 1
        time.sleep(0.001)
    assert left(tmp_path) == []


def test_what_a_program_says_on_its_standard_error_is_kept(tmp_path: Path) -> None:
    (log,) = played("exits early", tmp_path).log_paths
    assert log.read_text() == "no more\x1b[2J of\nthis\n"
