"""Transcripts as test items: every `.dmt` file that pytest collects is verified.

`--dmplay-update` rewrites the files instead, never where CI is set. A problem or an agent of
your own needs `dmplay_trust = true` in the pytest configuration: only then is it imported.
"""

import os
from collections.abc import Iterable
from pathlib import Path
from shlex import quote

import pytest

from dmplay.errors import DmplayError, TranscriptMismatch
from dmplay.terminal import escape_unprintable

TRANSCRIPT_SUFFIX = ".dmt"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Adds `--dmplay-update` and `dmplay_trust`."""
    group = parser.getgroup("dmplay", "golden transcripts")
    group.addoption("--dmplay-update", action="store_true", help="rewrite transcripts that differ")
    parser.addini(
        "dmplay_trust", "import the problems and agents that transcripts name", "bool", False
    )


def pytest_configure(config: pytest.Config) -> None:
    """Refuses to rewrite goldens where nobody looks at them."""
    if config.getoption("--dmplay-update") and os.environ.get("CI"):
        raise pytest.UsageError("--dmplay-update: not where CI is set")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collects transcripts."""
    if file_path.suffix != TRANSCRIPT_SUFFIX:
        return None
    collected: pytest.Collector = TranscriptFile.from_parent(parent, path=file_path)
    return collected


class TranscriptFile(pytest.File):
    """A file that holds one transcript."""

    def collect(self) -> Iterable[pytest.Item]:
        """One item."""
        yield TranscriptItem.from_parent(self, name="verify")


class TranscriptItem(pytest.Item):
    """Verifies its transcript, or rewrites it."""

    def runtest(self) -> None:
        """Fails with the report of `dmplay verify`."""
        from dmplay.game import checking

        trusted = bool(self.config.getini("dmplay_trust"))
        path = Path(os.path.relpath(self.path))
        if self.config.getoption("--dmplay-update"):
            diff = checking.rewrite_file(path, trusted=trusted)
            if diff:
                self.add_report_section("call", "rewritten", escape_unprintable(diff))
        report = checking.verify_file(path, trusted=trusted)
        self.add_report_section("call", "compared", escape_unprintable(report.summary))
        if not report.is_ok:
            accept = f"\nto accept the change: pytest {quote(str(path))} --dmplay-update"
            raise TranscriptMismatch(f"{report}{accept if report.is_replayable else ''}")

    def repr_failure(
        self, excinfo: pytest.ExceptionInfo[BaseException], style: object = None
    ) -> str:
        """The report alone; a traceback only for what is no error of ours."""
        if isinstance(excinfo.value, DmplayError):
            return escape_unprintable(str(excinfo.value))
        return str(super().repr_failure(excinfo))

    def reportinfo(self) -> tuple[Path, int, str]:
        """The file."""
        return self.path, 0, f"transcript {self.path.name}"
