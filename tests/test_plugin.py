"""The pytest plug-in: transcripts as tests of a user's own project."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.games import altered, recorded

pytestmark = pytest.mark.slow  # starts the program again and again


def run(folder: Path, *words: str, **env: str) -> subprocess.CompletedProcess[str]:
    clean = {key: value for key, value in os.environ.items() if key != "CI"}
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-q", *words],
        cwd=folder, env=clean | env, capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "goldens" / "game.dmt"
    path.parent.mkdir()
    recorded(path, "hexworld", "optimal")
    return path


def test_a_transcript_is_collected_and_passes(tmp_path: Path, file: Path) -> None:
    done = run(tmp_path)
    assert done.returncode == 0
    assert "1 passed" in done.stdout


def test_a_mismatch_fails_with_the_report_and_the_command_that_accepts_it(
    tmp_path: Path, file: Path
) -> None:
    altered(file, '"(8,1)"', '"(8,2)"')
    done = run(tmp_path)
    assert done.returncode == 1
    assert "goldens/game.dmt:13: turn 1: state: expected (8,2), got (8,1)" in done.stdout
    assert "to accept the change: pytest goldens/game.dmt --dmplay-update" in done.stdout
    assert "Traceback" not in done.stdout


def test_the_command_that_accepts_a_change_can_be_typed(tmp_path: Path, file: Path) -> None:
    altered(file, '"(8,1)"', '"(8,2)"')
    file.rename(file.with_name("the walk.dmt"))
    told = "to accept the change: pytest 'goldens/the walk.dmt' --dmplay-update"
    assert told in run(tmp_path).stdout


def test_what_only_trust_mends_is_not_to_be_accepted(tmp_path: Path, file: Path) -> None:
    altered(file, '"hexworld"', '"../lamp.py:Lamp"')
    done = run(tmp_path)
    assert "if it is yours, add --trust (in pytest, dmplay_trust = true)\n" in done.stdout
    assert "to accept the change" not in done.stdout


def test_an_unfinished_transcript_fails(tmp_path: Path, file: Path) -> None:
    file.write_text(file.read_text().rpartition("end:")[0])
    done = run(tmp_path)
    assert done.returncode == 1
    assert "unfinished: no end line" in done.stdout


def test_no_escape_of_a_file_reaches_the_report(tmp_path: Path, file: Path) -> None:
    altered(file, '"(8,1)"', r'"\u001b]0;pwned\u0007"')
    for words in ((), ("--dmplay-update", "-rP")):
        told = run(tmp_path, *words).stdout
        assert r"u001b]0;pwned" in told or r"\x1b]0;pwned" in told
        assert "\x1b" not in told


def test_who_was_not_asked_again_is_in_the_report(tmp_path: Path, file: Path) -> None:
    recorded(file, "hexworld", "script:e", force=True)
    assert "turn; not re-asked: script" in run(tmp_path, "-rP").stdout


def test_a_game_that_can_be_played_on_is_not_rewritten_and_no_traceback_says_so(
    tmp_path: Path, file: Path
) -> None:
    text = recorded(file, "crying-baby", "random", turns=2, force=True)
    file.write_text(text.replace("random", "human").partition("turn: 2")[0])
    done = run(tmp_path, "--dmplay-update")
    assert "goldens/game.dmt: this game can still be played on: finish it\n" in done.stdout
    assert "Traceback" not in done.stdout


def test_update_rewrites(tmp_path: Path, file: Path) -> None:
    right = file.read_text()
    altered(file, '"(8,1)"', '"(8,2)"')
    done = run(tmp_path, "--dmplay-update")
    assert done.returncode == 0
    assert file.read_text() == right


def test_update_is_refused_where_ci_is_set(tmp_path: Path, file: Path) -> None:
    altered(file, '"(8,1)"', '"(8,2)"')
    before = file.read_text()
    done = run(tmp_path, "--dmplay-update", CI="true")
    assert done.returncode == 4
    assert "--dmplay-update: not where CI is set" in done.stderr
    assert file.read_text() == before


def test_files_of_other_kinds_are_left_alone(tmp_path: Path) -> None:
    (tmp_path / "game.txt").write_text("not ours")
    assert "no tests ran" in run(tmp_path).stdout
