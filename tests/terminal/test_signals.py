"""Tests of signals at any moment, and of terminals that close or resize."""

import os
import pty
import select
import signal
import subprocess
import sys
from itertools import cycle
from pathlib import Path

import pytest

from dmplay.game.transcript_verification import verify
from dmplay.terminal.signals import defer_signals, exit_on_signals
from tests.crash_tests.kill_moments import Fuse
from tests.support.fork_server import PROGRAM_TIMEOUT_SECONDS
from tests.support.games import assert_verified, read_values
from tests.support.programs import run_wrapped
from tests.support.terminals import (
    CTRL_D,
    CTRL_L,
    CTRL_Z,
    DMPLAY_COMMAND,
    READY_SEQUENCE,
    Terminal,
    clean_environment,
)

pytestmark = pytest.mark.slow  # starts the program many times

TERM, INT, HUP = signal.SIGTERM, signal.SIGINT, signal.SIGHUP
GAME_ARGS = ("hexworld", "--seed", "7", "-o", "g.dmt")
TYPED_INPUT = "e\nundo\ne\nw\n"
SOLVE_INTERRUPTED_MESSAGE = "interrupted: solving collaborative-predator-prey; there is no result"
LONG_GAME_COMMAND = "hexworld --seed 7 --agent random --set rewards=[] --turns 90000 -o g.dmt"
FRONT_ENDS = {
    "plain": (GAME_ARGS, TYPED_INPUT),
    "json": ((*GAME_ARGS, "--json"), TYPED_INPUT),
    "quiet": ((*GAME_ARGS, "--quiet"), TYPED_INPUT),
    "agents": ((*GAME_ARGS, "--agent", "random", "--turns", "4"), ""),
    "shell": (("shell",), f"play hexworld --seed 7 --record g.dmt\n{TYPED_INPUT}"),
    "resume": (("resume", "g.dmt"), TYPED_INPUT),
}


def prepare_folder(folder: Path, front: str) -> None:
    """Remove the last transcript, and write one to resume if the front end is `resume`."""
    transcript, begun = folder / "g.dmt", folder / "begun"
    transcript.unlink(missing_ok=True)
    if front == "resume":
        if not begun.exists():
            run_wrapped(Fuse(), folder, *GAME_ARGS, stdin="e\n")
            transcript.rename(begun)
        transcript.write_bytes(begun.read_bytes())


def count_file_calls(folder: Path, front: str) -> int:
    """Run a game without signals and return the number of calls that access a file."""
    words, typed = FRONT_ENDS[front]
    prepare_folder(folder, front)
    assert run_wrapped(Fuse(tally=folder / "tally"), folder, *words, stdin=typed).returncode == 0
    return int((folder / "tally").read_text())


def run_with_signals(folder: Path, front: str, moment: int, *signals: int) -> tuple[int, int, bool]:
    """Run a game with signals from this call on; return the exit code, turns and if it ended.

    Assert that the transcript verifies and that no traceback is printed.
    """
    words, typed = FRONT_ENDS[front]
    prepare_folder(folder, front)
    result = run_wrapped(Fuse(moment, signals), folder, *words, stdin=typed)
    assert "Traceback" not in result.stderr, (front, moment, result.stderr)
    assert "unexpected" not in result.stderr, (front, moment, result.stderr)
    file = folder / "g.dmt"
    if not file.exists() or not file.stat().st_size:
        return result.returncode, 0, False
    report = verify(file)
    assert report.is_ok or report.is_unfinished, (front, moment, str(report))
    return result.returncode, report.turns, report.is_ok


@pytest.mark.parametrize("front", FRONT_ENDS)
def test_a_signal_at_any_moment_leaves_a_complete_transcript(front: str, tmp_path: Path) -> None:
    turns = set()
    for moment, number in zip(
        range(2, count_file_calls(tmp_path, front), 6), cycle((TERM, INT, HUP))
    ):
        code, turn_count, ended = run_with_signals(tmp_path, front, moment, number)
        # killed before the handlers are installed
        assert code in (128 + number, -number), (moment, number)
        # before the game starts
        assert ended or turn_count <= (front == "resume"), (moment, number)
        turns.add(turn_count)
    assert len(turns) > 1


@pytest.mark.parametrize("pair", [(INT, INT), (TERM, INT), (INT, TERM)])
def test_a_second_signal_does_not_prevent_the_end_line(
    pair: tuple[int, int], tmp_path: Path
) -> None:
    last = count_file_calls(tmp_path, "plain") - 5
    moments = range(20, last, 5)
    first = next(n for n in moments if run_with_signals(tmp_path, "plain", n, pair[0])[2])
    for moment in range(first + 1, last, 4):
        _, _, ended = run_with_signals(tmp_path, "plain", moment, *pair)
        assert ended, moment


def test_an_interrupt_during_the_last_calls_is_handled(tmp_path: Path) -> None:
    last = count_file_calls(tmp_path, "quiet")
    for moment in range(last - 3, last + 1):
        assert run_with_signals(tmp_path, "quiet", moment, INT) == (130, 2, True)


@pytest.mark.parametrize("number", [TERM, INT])
def test_a_signal_during_solving_restores_the_cursor(number: int, tmp_path: Path) -> None:
    with Terminal("solve", "collaborative-predator-prey", folder=tmp_path) as terminal:
        terminal.until(lambda: b"\x1b[?25l" in terminal.raw).signal(number)
        assert terminal.ended() == 128 + number
        assert terminal.left_clean()
        assert terminal.text.strip() == (SOLVE_INTERRUPTED_MESSAGE if number == INT else "")


@pytest.mark.parametrize("number", [HUP, INT])
@pytest.mark.parametrize(
    ("line", "expected_text"),
    [
        (f"{LONG_GAME_COMMAND} --speed 99", "chose"), (f"{LONG_GAME_COMMAND} --plain", "turn 3"),
        ("hexworld --seed 7 --json -o g.dmt", "event"),
    ],
)  # fmt: skip
def test_a_signal_on_a_terminal_ends_the_game_as_interrupted(
    line: str, expected_text: str, number: int, tmp_path: Path
) -> None:
    with Terminal(*line.split(), folder=tmp_path) as terminal:
        if "--speed" in line:
            terminal.ready().press("P", expected_text).signal(number)
        else:
            terminal.until(lambda: expected_text in terminal.printed).signal(number)
        assert terminal.ended() == 128 + number
        assert terminal.left_clean()
        assert "Traceback" not in terminal.printed
    assert '"reason": "interrupted"' in read_values(assert_verified(tmp_path / "g.dmt"), "end")[0]


@pytest.mark.parametrize(
    ("line", "typed", "expected_text"),
    [
        ("hexworld --seed 7 -o g.dmt", [("h", READY_SEQUENCE.decode())], "turn 1"),
        ("hexworld --seed 7 -o g.dmt --plain", [("w\n", "action>")], "turn 1."),
        ("hexworld --seed 7 -o g.dmt --json", [("w\n", "start")], '"turn": 1'),
        ("shell", [("play hexworld --seed 7 --record g.dmt\r", "dmplay>"), ("w\r", "t0]")], "t1]"),
        (f"{LONG_GAME_COMMAND} --plain", [], "turn 30."),
    ],
)
def test_a_terminal_that_closes_without_a_signal_ends_the_game_with_129(
    line: str, typed: list[tuple[str, str]], expected_text: str, tmp_path: Path
) -> None:
    controller, terminal = pty.openpty()
    env = clean_environment(tmp_path, TMPDIR=str(tmp_path))
    words = [*DMPLAY_COMMAND, *line.split()]
    with subprocess.Popen(
        words, stdin=terminal, stdout=terminal, stderr=terminal, env=env, cwd=tmp_path
    ) as game:
        os.close(terminal)
        for keys, prompt in typed:
            _read_until(controller, prompt)
            os.write(controller, keys.encode())
        _read_until(controller, expected_text)
        os.close(controller)
        assert game.wait(PROGRAM_TIMEOUT_SECONDS) == 129
    assert not list(tmp_path.glob("*.log"))
    assert_verified(tmp_path / "g.dmt")


def _read_until(terminal: int, text: str) -> None:
    """Read from the terminal until this text is printed."""
    printed = ""
    while text not in printed:
        assert select.select([terminal], [], [], PROGRAM_TIMEOUT_SECONDS)[0], (
            f"never saw {text!r}: {printed}"
        )
        printed += os.read(terminal, 1 << 16).decode(errors="replace")


def test_after_500_quick_resizes_the_last_size_is_painted(tmp_path: Path) -> None:
    with Terminal(*GAME_ARGS, folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 1 ").calm()
        for number in range(500):
            terminal.child.setwinsize(1 + number * 7 % 60, 1 + number * 13 % 200)
        terminal.resize(100, 30).calm()
        text = terminal.text
        assert "turn 1 " in text
        assert terminal.press(CTRL_L).calm().text == text
        assert terminal.press("h", "turn 2 ").press("q").ended() == 0
        assert terminal.left_clean()
    assert_verified(tmp_path / "g.dmt")


def test_a_prompt_survives_500_resizes(tmp_path: Path) -> None:
    with Terminal("shell", folder=tmp_path) as terminal:
        terminal.ready().press("play hexworld --seed 7 --record g.dmt\r", "t0]>").calm()
        for number in range(500):
            terminal.child.setwinsize(1 + number * 7 % 60, 1 + number * 13 % 200)
        terminal.resize(80, 24).calm().press("e\r", "t1]>").calm().press(CTRL_D)
        assert terminal.ended() == 0
        assert "Traceback" not in terminal.printed
    assert_verified(tmp_path / "g.dmt")


def test_a_game_in_plain_lines_can_be_suspended_and_continued(tmp_path: Path) -> None:
    bash = ("bash", "--norc", "--noprofile", "-i")
    with Terminal(command=bash, folder=tmp_path, env={"PS1": "ready> "}) as terminal:
        terminal.until("ready>").press("stty -a > before\r").calm()
        terminal.press(
            f"{sys.executable} -m dmplay hexworld --seed 7 -o g.dmt --plain\r", "action>"
        )
        terminal.press(CTRL_Z, "Stopped").calm().press("stty -a > after\r").calm()
        terminal.press("fg\r").calm().press("w\r", "turn 1.").press(CTRL_D, "transcript: g.dmt")
        terminal.calm().press("echo code=$?\r", "code=0").press("exit\r")
        assert terminal.ended() == 0
    assert (tmp_path / "before").read_text() == (tmp_path / "after").read_text()
    assert_verified(tmp_path / "g.dmt")


def raise_in_two_blocks() -> tuple[list[int], list[int]]:
    """Raise SIGTERM in an inner block; return the signals that it and the outer block received."""
    with defer_signals() as outer:
        with defer_signals() as inner:
            signal.raise_signal(TERM)
        received = list(inner), list(outer)
        outer.clear()
    return received


def test_a_deferred_signal_is_raised_after_the_outermost_block() -> None:
    with exit_on_signals():
        assert raise_in_two_blocks() == ([TERM], [TERM])


def test_signals_are_deferred_without_new_handlers_where_they_end_the_program() -> None:
    with exit_on_signals():
        handler = signal.getsignal(INT)
        with defer_signals():
            assert signal.getsignal(INT) is handler


def raise_deferred(number: int) -> None:
    """Raise a signal in a block that defers it."""
    with defer_signals() as received:
        signal.raise_signal(number)
        assert received == [number]


def test_a_deferred_signal_ends_the_program_as_if_it_came_after_the_block() -> None:
    with pytest.raises(KeyboardInterrupt):  # without a game, by Python's own handler
        raise_deferred(INT)
    with exit_on_signals():
        with pytest.raises(KeyboardInterrupt):
            raise_deferred(INT)
        with pytest.raises(SystemExit, match="143"):
            raise_deferred(TERM)
