"""A pytest plugin that verifies every `.dmt` transcript that pytest collects.

The option `--dmplay-update` rewrites the files instead, but not if CI is set. User-defined problems
and agents are imported only with `dmplay_trust = true` in the pytest configuration. With
`dmplay_frames = false`, the recorded drawings of turns are not compared.
"""

import os
from collections.abc import Iterable
from pathlib import Path
from shlex import quote

import pytest

from dmplay.core.text import escape_unprintable
from dmplay.errors import DmplayError, TranscriptMismatch

TRANSCRIPT_SUFFIX = ".dmt"
REWRITTEN = "rewritten"  # section of a report with the differences


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option `--dmplay-update` and the settings `dmplay_trust` and `dmplay_frames`."""
    group = parser.getgroup("dmplay", "golden transcripts")
    group.addoption("--dmplay-update", action="store_true", help="rewrite transcripts that differ")
    parser.addini(
        "dmplay_trust",
        "import the user-defined problems and agents that transcripts name",
        "bool",
        False,
    )
    parser.addini("dmplay_frames", "compare the recorded drawings of turns", "bool", True)


def pytest_configure(config: pytest.Config) -> None:
    """Raise UsageError for `--dmplay-update` if CI is set: no person reviews changes there."""
    if config.getoption("--dmplay-update") and os.environ.get("CI"):
        raise pytest.UsageError(
            "--dmplay-update: not allowed while the environment variable CI is set"
        )


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Return a collector for a transcript file, and None for any other file."""
    if file_path.suffix != TRANSCRIPT_SUFFIX:
        return None
    collected: pytest.Collector = TranscriptFile.from_parent(parent, path=file_path)
    return collected


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Name the transcripts that were rewritten."""
    for outcome in ("passed", "failed"):
        for report in terminalreporter.getreports(outcome):
            if any(REWRITTEN in title for title, _ in report.sections):
                terminalreporter.write_line(f"rewrote {escape_unprintable(report.fspath)}")


class TranscriptFile(pytest.File):
    """A collected file with one transcript."""

    def collect(self) -> Iterable[pytest.Item]:
        """Yield the single test item of the file."""
        yield TranscriptItem.from_parent(self, name="verify")


class TranscriptItem(pytest.Item):
    """A test item that verifies its transcript, or rewrites it."""

    def runtest(self) -> None:
        """Verify the transcript; raise TranscriptMismatch with the report if it fails."""
        from dmplay.game import transcript_verification

        trusted = bool(self.config.getini("dmplay_trust"))
        path = Path(os.path.relpath(self.path))
        if self.config.getoption("--dmplay-update"):
            diff = transcript_verification.rewrite_file(path, trusted=trusted, keeps_line_ends=True)
            if diff:
                self.add_report_section("call", REWRITTEN, escape_unprintable(diff))
        compares_frames = bool(self.config.getini("dmplay_frames"))
        report = transcript_verification.verify(
            path, trusted=trusted, compares_frames=compares_frames
        )
        self.add_report_section("call", "compared", escape_unprintable(report.summary))
        if not report.is_ok:
            accept = f"\nto accept the change: pytest {quote(str(path))} --dmplay-update"
            raise TranscriptMismatch(f"{report}{accept if report.is_replayable else ''}")

    def repr_failure(
        self, excinfo: pytest.ExceptionInfo[BaseException], style: object = None
    ) -> str:
        """Return the message of a dmplay error, and the traceback of any other error."""
        if isinstance(excinfo.value, DmplayError):
            return escape_unprintable(str(excinfo.value))
        return str(super().repr_failure(excinfo))

    def reportinfo(self) -> tuple[Path, int, str]:
        """Return the location and the name of the item for test reports."""
        return self.path, 0, f"transcript {self.path.name}"
