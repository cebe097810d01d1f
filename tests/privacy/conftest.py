"""The folder in which the games of these tests are played."""

from pathlib import Path

import pytest


@pytest.fixture
def game_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to play in, with a fixed clock and fixed new seeds."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("LINES", "24")
    monkeypatch.setattr("time.strftime", lambda form, *_: "20300102")
    monkeypatch.setattr("os.urandom", bytes)
    monkeypatch.chdir(tmp_path)
    return tmp_path
