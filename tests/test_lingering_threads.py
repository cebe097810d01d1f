"""Tests that dmplay ends although a thread of user-defined code does not."""

from pathlib import Path

import pytest

from tests.support.programs import run_dmplay
from tests.support.user_problems import WALK_SOURCE

pytestmark = pytest.mark.slow
ENDLESS_THREAD = """
import threading, time

def watch():
    while True:
        time.sleep(0.1)

threading.Thread(target=watch, name="watcher").start()
"""
SHORT_THREAD = """
import threading, time

def save():
    time.sleep(0.3)
    open("saved", "w").close()

threading.Thread(target=save).start()
"""
EXIT_HANDLER = 'import atexit\natexit.register(lambda: open("cleaned", "w").close())\n'


@pytest.mark.parametrize(
    ("words", "typed", "code"),
    [
        ("run ./walk.py --episodes 5", "", 0),
        ("play ./walk.py --agent random --seed 1 -o game.dmt", "", 0),
        ("./walk.py --seed 1", "right\nup\n", 2),
    ],
    ids=["run", "a game of an agent", "a wrong word"],
)
def test_an_endless_thread_does_not_keep_the_program_alive(
    tmp_path: Path, words: str, typed: str, code: int
) -> None:
    (tmp_path / "walk.py").write_text(WALK_SOURCE + ENDLESS_THREAD + EXIT_HANDLER)
    result = run_dmplay(tmp_path, *words.split(), stdin=typed)
    assert result.returncode == code
    assert (
        result.stderr.splitlines()[-1]
        == "exited while threads of user code were still running: watcher"
    )
    assert result.stdout.count("\n") > 1
    assert (tmp_path / "cleaned").exists()
    if "-o" in words:
        assert run_dmplay(tmp_path, "verify", "game.dmt", "--trust").returncode == 0


def test_a_thread_that_ends_within_a_second_is_waited_for(tmp_path: Path) -> None:
    (tmp_path / "walk.py").write_text(WALK_SOURCE + SHORT_THREAD)
    result = run_dmplay(tmp_path, "run", "./walk.py", "--episodes", "5")
    assert (result.returncode, result.stderr) == (0, "")
    assert (tmp_path / "saved").exists()
