"""Tests of signals, kills and hand-overs between players in games at a terminal."""

import json
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.support.games import assert_verified, read_values
from tests.support.programs import run_dmplay
from tests.support.terminals import CTRL_C, CTRL_D, CTRL_Z, ENTER, Terminal

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)]
)
def test_a_signal_ends_the_game_with_its_code_and_a_complete_transcript(
    number: int, code: int, tmp_path: Path
) -> None:
    with Terminal("hexworld", "--seed", "7", "-o", "game.dmt", folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 1 ").signal(number)
        assert terminal.ended() == code
        assert terminal.left_clean()
        assert "Traceback" not in terminal.printed
    end = json.loads(read_values(assert_verified(tmp_path / "game.dmt"), "end")[0])
    assert (end["reason"], end["turns"]) == ("interrupted", 1)


def test_ctrl_c_ends_the_game_like_sigint(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", "-o", "game.dmt", folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 1 ").press(CTRL_C)
        assert terminal.ended() == 130
        assert terminal.left_clean()
    assert_verified(tmp_path / "game.dmt")


EARLY_SIGNAL_CODE = """
import os, signal
from dmplay.__main__ import main
from dmplay.ui.screen.event_loop import ScreenEventLoop
handle_signals = ScreenEventLoop._handle_signals
def send_early_signal(self, early_signals):
    os.kill(os.getpid(), signal.SIGHUP)
    return handle_signals(self, early_signals)
ScreenEventLoop._handle_signals = send_early_signal
main()
"""


def test_a_signal_before_the_screen_handles_signals_ends_the_game(tmp_path: Path) -> None:
    command = (sys.executable, "-c", EARLY_SIGNAL_CODE)
    with Terminal("hexworld", "--seed", "7", folder=tmp_path, command=command) as terminal:
        assert terminal.ended() == 129
        assert terminal.left_clean()
        assert "Traceback" not in terminal.text


IGNORED_INTERRUPT_CODE = """
import time, weakref
import dmplay.__main__ as program
class Loaded:
    pass
def interrupt(_):
    raise KeyboardInterrupt  # Python ignores it here, as in a callback of an import
def load():
    loaded = Loaded()
    reference = weakref.ref(loaded, interrupt)
    del loaded
    for _ in range(1000):
        time.sleep(0.01)  # an interrupt without a signal is raised between two sleeps
    print("not interrupted")
program._dispatch = load
program.main()
"""


def test_an_interrupt_that_python_ignores_ends_the_program(tmp_path: Path) -> None:
    command = (sys.executable, "-c", IGNORED_INTERRUPT_CODE)
    with Terminal(folder=tmp_path, command=command) as terminal:
        assert terminal.ended() == 130
        assert terminal.text.strip() == ""


DROPPED_INTERRUPT_CODE = """
import os, signal, time
import dmplay.__main__ as program
def load():
    drop = "try: os.kill(os.getpid(), signal.SIGINT)\\nexcept BaseException: pass"
    exec(compile(drop, "numpy", "exec"), {"__name__": "numpy.random", "os": os, "signal": signal})
    for _ in range(1000):
        time.sleep(0.01)  # an interrupt without a signal is raised between two sleeps
    print("not interrupted")
program._dispatch = load
program.main()
"""


def test_an_interrupt_that_numpy_would_drop_while_it_is_imported_ends_the_program(
    tmp_path: Path,
) -> None:
    command = (sys.executable, "-c", DROPPED_INTERRUPT_CODE)
    with Terminal(folder=tmp_path, command=command) as terminal:
        assert terminal.ended() == 130
        assert terminal.text.strip() == ""


@pytest.mark.parametrize("wait", [0, 15, 30, 60, 90, 120, 150, 250])
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)]
)
def test_a_signal_before_the_first_key_restores_the_terminal(
    number: int, code: int, wait: int, tmp_path: Path
) -> None:
    # Before main() is called the interpreter handles signals, so wait until main() is reached.
    code_with_marker = "from dmplay.__main__ import main; print('up', flush=True); main()"
    command = (sys.executable, "-c", code_with_marker)
    with Terminal("hexworld", "--seed", "7", folder=tmp_path, command=command) as terminal:
        terminal.until(lambda: b"up" in terminal.raw)
        time.sleep(wait / 1000)
        terminal.signal(number)
        assert terminal.ended() == code
        assert terminal.left_clean()
        assert '/dmplay/__main__.py"' not in terminal.printed  # no traceback into dmplay


SLOW_IMPORT_SOURCE = """
import time
from dmplay.problems.crying_baby.rules import CryingBaby
class Slow:
    def __set_name__(self, owner, name):  # out of which Python lets no fault as it was
        print("importing", flush=True)
        time.sleep(0.3)
class Named:
    slow = Slow()
class Baby(CryingBaby):
    \'\'\'A baby.\'\'\'
"""
ENDLESS_IMPORT_SOURCE = """
print("importing", flush=True)
while True:
    pass
"""


@pytest.mark.parametrize(
    "content", [SLOW_IMPORT_SOURCE, ENDLESS_IMPORT_SOURCE], ids=["slow", "endless"]
)
def test_ctrl_c_while_a_file_is_imported_exits_with_130(content: str, tmp_path: Path) -> None:
    (tmp_path / "slow.py").write_text(content)
    with Terminal("./slow.py", folder=tmp_path) as terminal:
        terminal.until(lambda: b"importing" in terminal.raw).signal(signal.SIGINT)
        assert terminal.ended() == 130
        assert "unexpected" not in terminal.printed


@contextmanager
def play_in_shell(folder: Path) -> Iterator[Terminal]:
    """Start a game from a shell and yield after its first turn; then quit and verify the
    transcript.
    """
    bash = ("bash", "--norc", "--noprofile", "-i")
    with Terminal(command=bash, folder=folder, env={"PS1": "ready> "}) as terminal:
        terminal.until("ready>").press("stty -a > before\r").calm()
        terminal.press(f"{sys.executable} -m dmplay hexworld --seed 7 -o game.dmt\r").ready()
        terminal.press("h", "turn 1 ").calm()
        yield terminal
        terminal.press("q", "transcript: game.dmt").calm()
        terminal.press("echo code=$?\r", "code=0").press("exit\r")
        assert terminal.ended() == 0
    assert_verified(folder / "game.dmt")


def stop_game(terminal: Terminal, *, by_signal: bool) -> None:
    """Stop the game by its key, or by a signal as another program would."""
    if by_signal:
        os.kill(os.tcgetpgrp(terminal.child.child_fd), signal.SIGTSTP)
    else:
        terminal.press(CTRL_Z)
    terminal.until("Stopped").calm()


@pytest.mark.parametrize("by_signal", [False, True])
def test_a_stopped_game_restores_the_terminal_and_fg_resumes_it(
    by_signal: bool, tmp_path: Path
) -> None:
    with play_in_shell(tmp_path) as terminal:
        stop_game(terminal, by_signal=by_signal)
        assert terminal.raw.rfind(b"\x1b[?1049l") > terminal.raw.rfind(b"\x1b[?1049h")
        assert terminal.raw.rfind(b"\x1b[?25h") > terminal.raw.rfind(b"\x1b[?25l")
        terminal.press("stty -a > after\r").calm().press("fg\r", "turn 1 ").calm()
        terminal.press("h", "turn 2 ")
    assert (tmp_path / "before").read_text() == (tmp_path / "after").read_text()


@pytest.mark.parametrize("by_signal", [False, True])
def test_a_game_stops_while_a_command_is_typed_and_fg_restores_the_command(
    by_signal: bool, tmp_path: Path
) -> None:
    with play_in_shell(tmp_path) as terminal:
        terminal.press(":").press("hint", ":hint").calm()
        stop_game(terminal, by_signal=by_signal)
        terminal.press("fg\r", ":hint").calm()
        assert terminal.raw.rfind(b"\x1b[?25h") > terminal.raw.rfind(b"\x1b[?25l")
        terminal.press(ENTER, ", by optimal")


@pytest.mark.parametrize("typing", [False, True])
def test_a_game_stopped_by_sigstop_takes_the_terminal_back_after_fg(
    typing: bool, tmp_path: Path
) -> None:
    with play_in_shell(tmp_path) as terminal:
        if typing:
            terminal.press(":").press("hint", ":hint").calm()
        os.kill(os.tcgetpgrp(terminal.child.child_fd), signal.SIGSTOP)
        terminal.until("Stopped").calm().press("stty sane; clear\r", "ready>").calm()
        terminal.press("fg\r", ":hint" if typing else "turn 1 ").calm()
        if typing:
            terminal.press(ENTER, ", by optimal").calm()
        terminal.press("h", "turn 2 ")


def test_plain_mode_hands_over_between_players_with_different_observations(tmp_path: Path) -> None:
    arguments = ("multicaregiver-crying-baby", "--vs", "human", "--seed", "3", "--plain")
    with Terminal(*arguments, folder=tmp_path) as terminal:
        terminal.until("caregiver1 action>").press(f"feed; belief{ENTER}")
        terminal.until("pass the keyboard to caregiver2; press Enter when ready.")
        assert "feed" not in terminal.text
        assert "caregiver1" not in terminal.text  # the first caregiver's output is cleared
        terminal.press(ENTER).until("caregiver2 action>").press(f"sing{ENTER}")
        terminal.until("pass the keyboard to caregiver1").press(ENTER)
        terminal.until("turn 1. chose feed, heard quiet.").calm().press(f"{CTRL_D}")
        assert terminal.ended() == 0


def test_the_shell_hands_over_between_players_with_different_observations(tmp_path: Path) -> None:
    with Terminal("shell", folder=tmp_path) as terminal:
        command = "play multicaregiver-crying-baby --vs human --seed 3"
        terminal.ready().press(f"{command}{ENTER}", "t0 caregiver1]>").calm()
        terminal.press(f"feed; belief{ENTER}", "pass the keyboard to caregiver2;")
        assert "heard" not in terminal.text  # the first caregiver's board is cleared
        terminal.press(ENTER, "t0 caregiver2]>").calm().press(
            f"sing{ENTER}", "pass the keyboard to caregiver1"
        )
        assert "chose" not in terminal.calm().text
        terminal.press(ENTER, "turn 1. chose feed, heard quiet.").until("t1 caregiver1]>").calm()
        terminal.press(f"undo{ENTER}", "undone. turn 0.").until("t0 caregiver1]>").calm()
        terminal.press(f"feed{ENTER}", "pass the keyboard to caregiver2").calm()
        assert terminal.press(CTRL_C, "to quit, press").calm().press(CTRL_C).ended() == 130
        assert terminal.left_clean()


def test_leaving_the_screen_for_the_shell_shows_nothing_of_the_next_player(tmp_path: Path) -> None:
    with Terminal("shell", folder=tmp_path) as terminal:
        command = "play multicaregiver-crying-baby --vs human --seed 3"
        terminal.ready().press(f"{command}{ENTER}", "t0 caregiver1]>").calm()
        terminal.press(f"screen{ENTER}", "you: caregiver1").calm().press(
            "i", "pass the keyboard to caregiver2"
        )
        terminal.press(ENTER, "you: caregiver2").press(
            "f", "pass the keyboard to caregiver1"
        ).calm()
        terminal.press("q", "pass the keyboard to caregiver1; press Enter when ready.")
        assert "heard" not in terminal.calm().text
        terminal.press(ENTER, "t1 caregiver1]>").press(CTRL_D)
        assert terminal.ended() == 0


def test_a_script_for_two_players_does_not_wait_for_a_handover(tmp_path: Path) -> None:
    lines = "play multicaregiver-crying-baby --vs human --seed 3\nfeed; sing\nfeed\n"
    arguments = [word for line in lines.split("\n") if line for word in ("-e", line)]
    with Terminal(*arguments, folder=tmp_path) as terminal:
        assert terminal.ended() == 0
        assert "is next: nobody" not in terminal.printed
    result = run_dmplay(tmp_path, "shell", stdin=lines)
    assert "caregiver1 chose" not in result.stderr
    assert result.returncode == 0


def test_keys_typed_before_the_screen_is_ready_are_played_but_not_echoed(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", "-o", "game.dmt", folder=tmp_path) as terminal:
        terminal.until("q quit")
        terminal.press("hh", "turn 2 ").calm()
        assert "hh" not in terminal.text
        assert terminal.press("q").ended() == 0
    assert_verified(tmp_path / "game.dmt")


def test_a_killed_game_keeps_every_turn_and_resumes_with_the_same_uniforms(tmp_path: Path) -> None:
    keys = "hyulnbhh"
    for name, pieces in (("whole", [keys]), ("killed", [keys[:4], keys[4:]])):
        turn = 0
        for number, piece in enumerate(pieces):
            arguments = ("resume",) if number else ("hexworld", "--seed", "7", "-o")
            with Terminal(*arguments, f"{name}.dmt", folder=tmp_path) as terminal:
                terminal.ready()
                for turn, key in enumerate(piece, turn + 1):  # noqa: B020 - continues the count
                    terminal.press(key, f"turn {turn} ")
                if piece is not pieces[-1]:
                    terminal.signal(signal.SIGKILL)
                    assert terminal.ended() == 137
                    assert read_values(tmp_path / "killed.dmt", "turn")[-1] == "4"
                else:
                    assert terminal.press("q").ended() == 0
    assert (tmp_path / "killed.dmt").read_bytes() == (tmp_path / "whole.dmt").read_bytes()
    assert_verified(tmp_path / "killed.dmt")


def test_resume_without_a_file_resumes_the_killed_game(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 1 ").signal(signal.SIGKILL)
        assert terminal.ended() == 137
    with Terminal("resume", folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 2 ").press("q")
        assert terminal.ended() == 0
