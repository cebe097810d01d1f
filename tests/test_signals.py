"""Signals at any moment, and terminals that go or change: the game whole, with its ending."""

import os
import pty
import select
import signal
import subprocess
import sys
from itertools import cycle
from pathlib import Path

import pytest

from dmplay.game.checking import verify_file
from tests.kills.moments import Fuse
from tests.support.games import values, verified
from tests.support.programs import PATIENCE, within
from tests.support.terminals import (
    CTRL_D,
    CTRL_L,
    CTRL_Z,
    DMPLAY,
    READY,
    Terminal,
    clean_environment,
)

pytestmark = pytest.mark.slow  # starts the program again and again

TERM, INT, HUP = signal.SIGTERM, signal.SIGINT, signal.SIGHUP
GAME = ("hexworld", "--seed", "7", "-o", "g.dmt")
TYPED = "e\nundo\ne\nw\n"
NOTHING_FOUND = "interrupted: solving collaborative-predator-prey; nothing was found by then"
LONG = "hexworld --seed 7 --agent random --set rewards=[] --turns 90000 -o g.dmt"
FRONTS = {
    "plain": (GAME, TYPED),
    "json": ((*GAME, "--json"), TYPED),
    "quiet": ((*GAME, "--quiet"), TYPED),
    "agents": ((*GAME, "--agent", "random", "--turns", "4"), ""),
    "shell": (("shell",), f"play hexworld --seed 7 --record g.dmt\n{TYPED}"),
    "resume": (("resume", "g.dmt"), TYPED),
}


def before(folder: Path, front: str) -> None:
    """Puts in place what is there before."""
    (folder / "g.dmt").unlink(missing_ok=True)
    if front == "resume":
        within(Fuse(), folder, *GAME, stdin="e\n")


def calls(folder: Path, front: str) -> int:
    """How many calls reach for a file where no signal comes."""
    words, typed = FRONTS[front]
    before(folder, front)
    assert within(Fuse(tally=folder / "tally"), folder, *words, stdin=typed).returncode == 0
    return int((folder / "tally").read_text())


def left(folder: Path, front: str, moment: int, *signals: int) -> tuple[int, int, bool]:
    """The code, the turns and whether there is an end, where signals come at this call and after;
    what is left verifies, and nothing is traced back.
    """
    words, typed = FRONTS[front]
    before(folder, front)
    done = within(Fuse(moment, signals), folder, *words, stdin=typed)
    assert "Traceback" not in done.stderr, (front, moment, done.stderr)
    assert "unexpected" not in done.stderr, (front, moment, done.stderr)
    file = folder / "g.dmt"
    if not file.exists() or not file.stat().st_size:
        return done.returncode, 0, False
    report = verify_file(file)
    assert report.is_ok or report.is_unfinished, (front, moment, str(report))
    return done.returncode, report.turns, report.is_ok


@pytest.mark.parametrize("front", FRONTS)
def test_a_signal_at_any_moment_leaves_a_whole_game_with_its_ending(
    front: str, tmp_path: Path
) -> None:
    turns = set()
    for moment, number in zip(range(2, calls(tmp_path, front), 6), cycle((TERM, INT, HUP))):
        code, played, ended = left(tmp_path, front, moment, number)
        assert code in (128 + number, -number), (moment, number)  # its own before we listen
        assert ended or played <= (front == "resume"), (moment, number)  # before it is at the table
        turns.add(played)
    assert len(turns) > 1


@pytest.mark.parametrize("pair", [(INT, INT), (TERM, INT), (INT, TERM)])
def test_a_second_signal_does_not_cut_the_ending_short(
    pair: tuple[int, int], tmp_path: Path
) -> None:
    for moment in range(20, calls(tmp_path, "plain") - 5, 4):
        _, _, ended = left(tmp_path, "plain", moment, *pair)
        assert ended, moment


def test_an_interrupt_at_the_very_last_is_no_fault(tmp_path: Path) -> None:
    last = calls(tmp_path, "quiet")
    for moment in range(last - 3, last + 1):
        assert left(tmp_path, "quiet", moment, INT) == (130, 2, True)


@pytest.mark.parametrize("number", [TERM, INT])
def test_a_signal_while_something_is_solved_gives_the_cursor_back(
    number: int, tmp_path: Path
) -> None:
    with Terminal("solve", "collaborative-predator-prey", folder=tmp_path) as terminal:
        terminal.until(lambda: b"\x1b[?25l" in terminal.raw).signal(number)
        assert terminal.ended() == 128 + number
        assert terminal.left_clean()
        assert terminal.text.strip() == (NOTHING_FOUND if number == INT else "")


@pytest.mark.parametrize("number", [HUP, INT])
@pytest.mark.parametrize(
    ("line", "seen"),
    [
        (f"{LONG} --speed 99", "turn 3/"), (f"{LONG} --plain", "turn 3"),
        ("hexworld --seed 7 --json -o g.dmt", "event"),
    ],
)  # fmt: skip
def test_a_signal_on_a_terminal_ends_in_one_way(
    line: str, seen: str, number: int, tmp_path: Path
) -> None:
    with Terminal(*line.split(), folder=tmp_path) as terminal:
        if "--speed" in line:
            terminal.ready().press("P", seen).signal(number)
        else:
            terminal.until(lambda: seen in terminal.printed).signal(number)
        assert terminal.ended() == 128 + number
        assert terminal.left_clean()
        assert "Traceback" not in terminal.printed
    assert '"reason": "interrupted"' in values(verified(tmp_path / "g.dmt"), "end")[0]


@pytest.mark.parametrize(
    ("line", "typed", "seen"),
    [
        ("hexworld --seed 7 -o g.dmt", [("h", READY.decode())], "turn 1"),
        ("hexworld --seed 7 -o g.dmt --plain", [("w\n", "action>")], "turn 1."),
        ("hexworld --seed 7 -o g.dmt --json", [("w\n", "start")], '"turn": 1'),
        ("shell", [("play hexworld --seed 7 --record g.dmt\r", "dmplay>"), ("w\r", "t0]")], "t1]"),
        (f"{LONG} --plain", [], "turn 30."),
    ],
)
def test_a_terminal_that_goes_without_a_signal_ends_the_game_with_129(
    line: str, typed: list[tuple[str, str]], seen: str, tmp_path: Path
) -> None:
    ours, its = pty.openpty()
    env = clean_environment(tmp_path, TMPDIR=str(tmp_path))
    words = [*DMPLAY, *line.split()]
    with subprocess.Popen(words, stdin=its, stdout=its, stderr=its, env=env, cwd=tmp_path) as game:
        os.close(its)
        for keys, shown in typed:
            _until(ours, shown)
            os.write(ours, keys.encode())
        _until(ours, seen)
        os.close(ours)
        assert game.wait(PATIENCE) == 129
    assert not list(tmp_path.glob("*.log"))
    verified(tmp_path / "g.dmt")


def _until(terminal: int, seen: str) -> None:
    """Reads until this is printed."""
    printed = ""
    while seen not in printed:
        assert select.select([terminal], [], [], PATIENCE)[0], f"never saw {seen!r}: {printed}"
        printed += os.read(terminal, 1 << 16).decode(errors="replace")


def test_five_hundred_sizes_in_a_burst_leave_the_last_one_painted(tmp_path: Path) -> None:
    with Terminal(*GAME, folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 1 ").calm()
        for number in range(500):
            terminal.child.setwinsize(1 + number * 7 % 60, 1 + number * 13 % 200)
        terminal.resize(100, 30).calm()
        shown = terminal.text
        assert "turn 1 " in shown
        assert terminal.press(CTRL_L).calm().text == shown
        assert terminal.press("h", "turn 2 ").press("q").ended() == 0
        assert terminal.left_clean()
    verified(tmp_path / "g.dmt")


def test_a_prompt_outlives_five_hundred_sizes(tmp_path: Path) -> None:
    with Terminal("shell", folder=tmp_path) as terminal:
        terminal.ready().press("play hexworld --seed 7 --record g.dmt\r", "t0]>").calm()
        for number in range(500):
            terminal.child.setwinsize(1 + number * 7 % 60, 1 + number * 13 % 200)
        terminal.resize(80, 24).calm().press("e\r", "t1]>").calm().press(CTRL_D)
        assert terminal.ended() == 0
        assert "Traceback" not in terminal.printed
    verified(tmp_path / "g.dmt")


def test_lines_stop_and_go_on_as_other_programs_do(tmp_path: Path) -> None:
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
    verified(tmp_path / "g.dmt")
