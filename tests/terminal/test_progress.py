"""Tests of the progress bar, which appears on a terminal's standard error after a delay."""

import os
import pty
import select
import sys

import pytest

from dmplay.terminal import progress
from dmplay.terminal.progress import ProgressBar


def capture_progress(
    monkeypatch: pytest.MonkeyPatch,
    *,
    late: bool,
    quiet: bool = False,
    motion: bool = True,
    line_delay_seconds: float = 60.0,
) -> str:
    """Return the output on a terminal during some work."""
    monkeypatch.setattr(progress, "LINE_DELAY_SECONDS", line_delay_seconds)
    monkeypatch.setattr(progress, "BAR_DELAY_SECONDS", 0.0 if late else 60.0)
    monkeypatch.setenv("TERM", "xterm")
    primary, secondary = pty.openpty()
    with os.fdopen(secondary, "w") as terminal:
        monkeypatch.setattr(sys, "stderr", terminal)
        with ProgressBar("solving a problem", quiet=quiet, motion=motion) as bar:
            if line_delay_seconds == 0.0 or (late and not motion):
                select.select([primary], [], [], 60.0)
            bar(0.25)
            bar(0.5)
        terminal.write("end")
        terminal.flush()
        output = b""
        while not output.endswith(b"end"):  # a terminal passes on a few thousand bytes at a time
            output += os.read(primary, 100_000)
    os.close(primary)
    return output.decode()


def test_long_work_has_a_bar_that_is_erased_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    output = capture_progress(monkeypatch, late=True)
    assert "solving a problem" in output
    assert output.endswith("\x1b[2Kend")  # the line is erased


def test_work_of_a_moment_has_a_line_that_is_erased(monkeypatch: pytest.MonkeyPatch) -> None:
    output = capture_progress(monkeypatch, late=False, line_delay_seconds=0.0)
    assert output == "solving a problem ...\r\x1b[Kend"


def test_without_motion_long_work_prints_a_permanent_line(monkeypatch: pytest.MonkeyPatch) -> None:
    assert capture_progress(monkeypatch, late=True, motion=False) == "solving a problem ...\r\nend"


@pytest.mark.parametrize(("late", "quiet"), [(False, False), (True, True)])
def test_short_or_quiet_work_has_no_bar(
    monkeypatch: pytest.MonkeyPatch, late: bool, quiet: bool
) -> None:
    assert capture_progress(monkeypatch, late=late, quiet=quiet) == "end"


def test_a_stream_that_is_not_a_terminal_gets_no_bar(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress, "BAR_DELAY_SECONDS", 0.0)
    with ProgressBar("solving a problem") as bar:
        bar(0.5)
    assert capsys.readouterr().err == ""


def test_an_interruption_without_a_result_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(KeyboardInterrupt), ProgressBar("solving a problem"):
        raise KeyboardInterrupt
    message = "interrupted: solving a problem; there is no result\n"
    assert capsys.readouterr().err == message
