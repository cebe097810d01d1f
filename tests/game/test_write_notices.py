"""Tests of a transcript that cannot be written during a game.

The disk is full, or another program takes the file away: one line says so at once, and another one
when the file is written again.
"""

import io
import json
import os
import resource
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from dmplay.core.safe_files import is_game_running
from dmplay.game.command_line_results import PlayCommand
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_game, start_new_game
from dmplay.game.launch_requests import GameRequest, ResumeRequest
from dmplay.game.transcript_verification import verify
from dmplay.terminal.capabilities import Terminal, TerminalOptions
from dmplay.ui.game_launcher import play_game
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.shell.command_shell import Shell, run_script
from dmplay.ui.shell.commands import run_line
from dmplay.ui.shell.plain_mode import JsonReporter, Reporter, SentenceReporter, play_by_lines
from tests.support.screens import EmulatedPainter, EmulatedScreen

PIPE = Terminal(False, "a pipe", False, False, False)
SCREEN = Terminal(True, "", True, True, False, motion=False)
FULL, EMPTY = "# the disk is full\n", "# the disk has room again\n"  # comments, so never played
SIZE_LIMITS = resource.getrlimit(resource.RLIMIT_FSIZE)


def set_disk(*, full: bool) -> None:
    """Let every write to a file fail, or let writes succeed again."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (1, SIZE_LIMITS[1]) if full else SIZE_LIMITS)


@contextmanager
def with_room_afterwards() -> Iterator[None]:
    """Empty the disk before pytest reports the test: pytest may write its report to a file."""
    try:
        yield
    finally:
        set_disk(full=False)


class TypedLines(io.StringIO):
    """Typed lines; the comments FULL and EMPTY fill and empty the disk as they are read."""

    def readline(  # type: ignore[override] # typeshed derives StringIO from a stream of bytes
        self, size: int = -1, /
    ) -> str:
        """Return the next line."""
        line = super().readline()
        if line in (FULL, EMPTY):
            set_disk(full=line == FULL)
        return line

    def __next__(self) -> str:  # type: ignore[override] # as above
        if line := self.readline():
            return line
        raise StopIteration


def start_on_disk(path: Path, problem: str = "hexworld", **options: Any) -> GameController:
    return GameController(start_new_game(GameRequest(problem, seed=7, record_path=path, **options)))


def count_notices(printed: str, path: Path) -> tuple[int, int]:
    """Count the lines that report a failed write, and those that report its end."""
    return (
        sum(f"cannot write {path}: " in row for row in printed.splitlines()),
        sum(f"{path} can be written again" in row for row in printed.splitlines()),
    )


@pytest.mark.parametrize(
    "reporter", [SentenceReporter(PIPE), JsonReporter()], ids=["plain", "json"]
)
@with_room_afterwards()
def test_a_failed_write_is_reported_once_after_its_turn(
    reporter: Reporter, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "g.dmt"
    controller = start_on_disk(path)
    typed = TypedLines(f"e\n{FULL}w\nhint\ne\nundo\n{EMPTY}w\ne\n")
    play_by_lines(controller, PIPE, typed, reporter)
    rows = capsys.readouterr().out.splitlines()
    (failed,) = (index for index, row in enumerate(rows) if f"cannot write {path}: " in row)
    (restored,) = (index for index, row in enumerate(rows) if f"{path} can be written again" in row)
    assert failed < restored
    assert os.strerror(28) in rows[failed] or os.strerror(27) in rows[failed]
    assert "the game continues, and dmplay tries again each turn" in rows[failed]
    assert "and nothing is missing" in rows[restored]
    if isinstance(reporter, JsonReporter):
        assert json.loads(rows[failed])["event"] == "words"
        assert json.loads(rows[failed - 1])["turn"] == 2
    else:
        assert "turn 2." in rows[failed - 1]
    assert verify(path).is_ok
    assert verify(path).turns == 4


@with_room_afterwards()
def test_the_shell_reports_a_failed_write_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "g.dmt"
    controller = start_on_disk(path)
    run_script(Shell(controller, PIPE), TypedLines(f"e\n{FULL}w\ne\nsave\n{EMPTY}w\nsave\n"))
    rows = capsys.readouterr().out.splitlines()
    assert sum("the game continues" in row for row in rows) == 1
    assert sum("can be written again" in row for row in rows) == 1
    # `save` without a name tells how the transcript stands.
    assert sum(row.startswith(f"cannot write {path}: ") for row in rows) == 2
    assert rows[-1] == f"saved as you play: {path}"


@with_room_afterwards()
def test_a_game_of_agents_reports_a_failed_write_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "g.dmt"
    controller = start_on_disk(path, agent="random", turns=6)
    set_disk(full=True)
    play_by_lines(controller, PIPE, TypedLines(), SentenceReporter(PIPE))
    assert count_notices(capsys.readouterr().out, path) == (1, 0)
    assert controller.game.recorder
    assert controller.game.recorder.write_error


@with_room_afterwards()
def test_a_start_that_cannot_be_written_is_reported_before_the_first_choice(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "g.dmt"
    set_disk(full=True)
    controller = start_on_disk(path)
    play_by_lines(controller, PIPE, TypedLines(f"{EMPTY}e\n"), SentenceReporter(PIPE))
    rows = capsys.readouterr().out.splitlines()
    (failed,) = (index for index, row in enumerate(rows) if f"cannot write {path}" in row)
    assert failed < next(index for index, row in enumerate(rows) if "turn 1." in row)
    assert count_notices("\n".join(rows), path) == (1, 1)


@with_room_afterwards()
def test_an_error_that_is_gone_before_the_report_is_not_mentioned(tmp_path: Path) -> None:
    controller = start_on_disk(tmp_path / "g.dmt")
    set_disk(full=True)
    run_line(controller, "e")
    set_disk(full=False)
    run_line(controller, "w")
    assert not controller.take_write_notice()


@with_room_afterwards()
def test_a_game_that_could_not_be_written_is_not_called_kept(tmp_path: Path) -> None:
    path = tmp_path / "g.dmt"
    controller = start_on_disk(path)
    run_line(controller, "e")
    set_disk(full=True)
    assert f" cannot write {path}: " in run_line(controller, "restart")


@with_room_afterwards()
def test_the_screen_logs_a_failed_write_once_and_that_writing_works_again(tmp_path: Path) -> None:
    path = tmp_path / "g.dmt"
    controller = start_on_disk(path)
    screen = PlayScreen(controller, SCREEN)
    painter = EmulatedPainter(EmulatedScreen(), 80, 24)
    for key, full in (("l", False), ("h", True), ("l", True), ("h", False), ("l", False)):
        set_disk(full=full)
        handle_key(screen, key)
        screen.paint(painter)
    assert count_notices("\n".join(screen.log), path) == (1, 1)
    assert "the game continues" in screen.log[2]
    assert "turn 2." in screen.log[1]
    assert "can be written again" in screen.log[5]


@with_room_afterwards()
def test_each_person_of_a_game_with_private_views_finds_the_failure_in_the_log(
    tmp_path: Path,
) -> None:
    path = tmp_path / "g.dmt"
    people = ["caregiver1=human", "caregiver2=human"]
    controller = start_on_disk(path, "multicaregiver-crying-baby", seats=people)
    screen = PlayScreen(controller, SCREEN)
    painter = EmulatedPainter(EmulatedScreen(), 80, 24)
    set_disk(full=True)
    for action in ("feed", "feed"):
        run_line(controller, action)
        screen.paint(painter)
    for _ in range(2):
        controller.complete_handover()
        screen.paint(painter)
        assert count_notices("\n".join(screen.log), path) == (1, 0)
        run_line(controller, "feed")


# A transcript that another program takes away during the game


def remove_file(path: Path) -> None:
    path.unlink()


def remove_folder(path: Path) -> None:
    path.unlink()
    path.parent.rmdir()


def empty_file(path: Path) -> None:
    path.write_text("")


def shorten_file(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:20])


def append_to_file(path: Path) -> None:
    with path.open("a") as file:
        file.write("another line\n")


def replace_by_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def replace_by_file(path: Path) -> None:
    path.unlink()
    path.write_text("the file of another program\n")


def replace_by_fifo(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def remove_what_is_there(path: Path) -> None:
    """Remove the file or empty folder at a path."""
    path.parent.mkdir(exist_ok=True)
    if path.is_dir():
        path.rmdir()
    else:
        path.unlink(missing_ok=True)


def start_in_folder(tmp_path: Path, **options: Any) -> GameController:
    (tmp_path / "games").mkdir()
    return start_on_disk(tmp_path / "games" / "g.dmt", **options)


@pytest.mark.parametrize("problem", ["hexworld", "crying-baby"])
@pytest.mark.parametrize("take_away", [remove_file, empty_file])
@with_room_afterwards()
def test_a_file_that_was_removed_or_emptied_is_written_again(
    take_away: Callable[[Path], None], problem: str, tmp_path: Path
) -> None:
    actions = {"hexworld": ("e", "w", "e"), "crying-baby": ("feed", "sing", "feed")}[problem]
    controller = start_in_folder(tmp_path, problem=problem)
    path = controller.game.transcript_path
    assert path
    mode = path.stat().st_mode
    run_line(controller, actions[0])
    take_away(path)
    run_line(controller, actions[1])
    expected = f"{path} was removed or emptied; dmplay wrote it again, and nothing is missing"
    assert [controller.take_write_notice() for _ in range(2)] == [expected, ""]
    assert path.stat().st_mode == mode
    assert is_game_running(path)
    run_line(controller, actions[2])
    controller.end_game()
    assert (verify(path).findings, verify(path).turns) == ([], 3)


@with_room_afterwards()
def test_a_file_that_was_removed_before_the_last_line_is_complete(tmp_path: Path) -> None:
    controller = start_in_folder(tmp_path)
    path = controller.game.transcript_path
    assert path
    run_line(controller, "e")
    path.unlink()
    controller.end_game()
    assert verify(path).is_ok
    assert not verify(path).is_unfinished


@pytest.mark.parametrize(
    ("take_away", "reason"),
    [
        (remove_folder, "No such file or directory"),
        (replace_by_folder, "another file or folder has this path now"),
        (replace_by_file, "another file or folder has this path now"),
        (replace_by_fifo, "another file or folder has this path now"),
        (append_to_file, "another program changed it"),
        (shorten_file, "another program changed it"),
    ],
)
@with_room_afterwards()
def test_a_file_that_was_taken_away_is_reported_at_the_next_turn_and_left_alone(
    take_away: Callable[[Path], None], reason: str, tmp_path: Path
) -> None:
    controller = start_in_folder(tmp_path)
    path = controller.game.transcript_path
    assert path
    run_line(controller, "e")
    take_away(path)
    before = path.read_bytes() if path.is_file() else b""
    run_line(controller, "w")
    assert controller.take_write_notice() == (
        f"cannot write {path}: {reason}; the game continues, and dmplay tries again each turn"
    )
    run_line(controller, "e")
    assert not controller.take_write_notice()
    assert before == (path.read_bytes() if path.is_file() else b"")
    remove_what_is_there(path)
    run_line(controller, "w")
    assert controller.take_write_notice() == f"{path} can be written again, and nothing is missing"
    controller.end_game()
    assert (verify(path).findings, verify(path).turns) == ([], 4)


@pytest.mark.parametrize("is_json", [False, True])
@pytest.mark.parametrize(
    "take_away", [remove_folder, replace_by_folder, replace_by_file, shorten_file]
)
@with_room_afterwards()
def test_a_game_whose_file_was_taken_away_ends_with_one_error_and_exit_code_1(
    take_away: Callable[[Path], None],
    is_json: bool,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "games").mkdir()
    path = tmp_path / "games" / "g.dmt"

    def read_lines() -> Iterator[str]:
        yield "e\n"
        take_away(path)
        yield from ("w\n", "e\n", "quit\n")

    stdin = io.StringIO()
    lines = read_lines()
    monkeypatch.setattr(stdin, "readline", lambda: next(lines))
    monkeypatch.setattr(sys, "stdin", stdin)
    options = TerminalOptions(json=True) if is_json else TerminalOptions(plain=True)
    request = GameRequest("hexworld", seed=7, record_path=path)
    assert play_game(GameController(), PlayCommand(request, options)) == 1
    printed = capsys.readouterr()
    assert count_notices(printed.out, path) == (1, 0)
    assert f"error: cannot write {path}: " in printed.err
    assert "error: " not in printed.err.replace("error: cannot write", "", 1)
    for name in ("transcript: ", "replay: ", "resume: "):
        assert name not in printed.err


@with_room_afterwards()
def test_a_game_whose_file_was_removed_is_saved_elsewhere(tmp_path: Path) -> None:
    controller = start_in_folder(tmp_path)
    path, copy = controller.game.transcript_path, tmp_path / "copy.dmt"
    assert path
    run_line(controller, "e")
    path.unlink()
    assert run_line(controller, f"save {copy}").startswith(f"saved {copy}")
    assert verify(copy).turns == 1


@with_room_afterwards()
def test_a_game_that_is_resumed_is_written_again_too(tmp_path: Path) -> None:
    path = tmp_path / "g.dmt"
    controller = start_on_disk(path)
    run_line(controller, "e")
    controller.end_game("interrupted")
    resumed = GameController(start_game(ResumeRequest(path)))
    path.unlink()
    run_line(resumed, "w")
    resumed.end_game()
    assert (verify(path).findings, verify(path).turns) == ([], 2)
