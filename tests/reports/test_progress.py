"""The bar of long work: on a terminal's error channel, once it has taken a moment."""

import os
import pty
import sys

import pytest

from dmplay.reports.progress import ProgressBar


def drawn(
    monkeypatch: pytest.MonkeyPatch, *, late: bool, quiet: bool = False, motion: bool = True
) -> str:
    """What a terminal gets to see of some work."""
    lead, follow = pty.openpty()
    with os.fdopen(follow, "w") as terminal:
        monkeypatch.setattr(sys, "stderr", terminal)
        with ProgressBar("solving a problem", quiet=quiet, motion=motion) as bar:
            bar.start_time -= 10.0 if late else 0.0
            bar(0.25)
            bar(0.5)
        terminal.write("end")
        terminal.flush()
        seen = b""
        while not seen.endswith(b"end"):  # a terminal passes on a few thousand bytes at a time
            seen += os.read(lead, 100_000)
    os.close(lead)
    return seen.decode()


def test_long_work_has_a_bar_that_is_wiped_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = drawn(monkeypatch, late=True)
    assert "solving a problem" in seen
    assert seen.endswith("\x1b[2Kend")  # the line is erased


def test_without_motion_long_work_has_a_line_that_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    assert drawn(monkeypatch, late=True, motion=False) == "solving a problem ...\r\nend"


@pytest.mark.parametrize(("late", "quiet"), [(False, False), (True, True)])
def test_short_or_quiet_work_has_none(
    monkeypatch: pytest.MonkeyPatch, late: bool, quiet: bool
) -> None:
    assert drawn(monkeypatch, late=late, quiet=quiet) == "end"


def test_what_is_no_terminal_gets_none(capsys: pytest.CaptureFixture[str]) -> None:
    with ProgressBar("solving a problem") as bar:
        bar.start_time -= 10.0
        bar(0.5)
    assert capsys.readouterr().err == ""


def test_an_interruption_that_leaves_nothing_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(KeyboardInterrupt), ProgressBar("solving a problem"):
        raise KeyboardInterrupt
    told = "interrupted: solving a problem; nothing was found by then\n"
    assert capsys.readouterr().err == told
