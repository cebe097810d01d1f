"""Tests of the pytest plug-in, which collects transcripts as tests of a user's project."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.games import record_game, replace_in_file

pytestmark = pytest.mark.slow  # starts pytest many times
# other plug-ins, which take two thirds of a start
UNUSED_PLUGINS = ("-p", "no:hypothesispytest", "-p", "no:xdist", "-p", "no:anyio")


def run_pytest(folder: Path, *words: str, **env: str) -> subprocess.CompletedProcess[str]:
    clean = {key: value for key, value in os.environ.items() if key != "CI"}
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *UNUSED_PLUGINS, "-q", *words],
        cwd=folder, env=clean | env, capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.fixture
def transcript_path(tmp_path: Path) -> Path:
    path = tmp_path / "goldens" / "game.dmt"
    path.parent.mkdir()
    record_game(path, "hexworld", "optimal")
    return path


def test_a_transcript_is_collected_and_passes(tmp_path: Path, transcript_path: Path) -> None:
    result = run_pytest(tmp_path)
    assert result.returncode == 0
    assert "1 passed" in result.stdout


def test_a_mismatch_fails_with_the_report_and_the_command_that_accepts_it(
    tmp_path: Path, transcript_path: Path
) -> None:
    replace_in_file(transcript_path, '"(8,1)"', '"(8,2)"')
    result = run_pytest(tmp_path)
    assert result.returncode == 1
    assert "goldens/game.dmt:13: turn 1: state: expected (8,2), got (8,1)" in result.stdout
    assert "to accept the change: pytest goldens/game.dmt --dmplay-update" in result.stdout
    assert "Traceback" not in result.stdout


def test_the_command_that_accepts_a_change_can_be_typed(
    tmp_path: Path, transcript_path: Path
) -> None:
    replace_in_file(transcript_path, '"(8,1)"', '"(8,2)"')
    transcript_path.rename(transcript_path.with_name("the walk.dmt"))
    message = "to accept the change: pytest 'goldens/the walk.dmt' --dmplay-update"
    assert message in run_pytest(tmp_path).stdout


def test_an_untrusted_problem_file_suggests_trust_and_not_an_update(
    tmp_path: Path, transcript_path: Path
) -> None:
    replace_in_file(transcript_path, '"hexworld"', '"../lamp.py:Lamp"')
    result = run_pytest(tmp_path)
    assert (
        "problem '../lamp.py:Lamp' is code outside dmplay, so it is not imported; " in result.stdout
    )
    assert "if you trust its code, add --trust (in pytest, dmplay_trust = true)\n" in result.stdout
    assert "to accept the change" not in result.stdout


def test_an_unfinished_transcript_fails(tmp_path: Path, transcript_path: Path) -> None:
    transcript_path.write_text(transcript_path.read_text().rpartition("end:")[0])
    result = run_pytest(tmp_path)
    assert result.returncode == 1
    assert "unfinished: no end line" in result.stdout


def test_no_escape_sequence_of_a_file_reaches_the_report(
    tmp_path: Path, transcript_path: Path
) -> None:
    replace_in_file(transcript_path, '"(8,1)"', r'"\u001b]0;pwned\u0007"')
    for words in ((), ("--dmplay-update", "-rP")):
        output = run_pytest(tmp_path, *words).stdout
        assert r"u001b]0;pwned" in output or r"\x1b]0;pwned" in output
        assert "\x1b" not in output


def test_the_report_names_agents_that_were_not_asked_again(
    tmp_path: Path, transcript_path: Path
) -> None:
    record_game(transcript_path, "hexworld", "script:e", force=True)
    assert "turn; not recomputed: script" in run_pytest(tmp_path, "-rP").stdout


def test_a_game_that_can_be_continued_is_not_rewritten(
    tmp_path: Path, transcript_path: Path
) -> None:
    text = record_game(transcript_path, "crying-baby", "random", turns=2, force=True)
    transcript_path.write_text(text.replace("random", "human").partition("turn: 2")[0])
    result = run_pytest(tmp_path, "--dmplay-update")
    assert "goldens/game.dmt: this game can still be continued: finish it first\n" in result.stdout
    assert "Traceback" not in result.stdout


def test_drawings_can_be_left_out_of_the_comparison(tmp_path: Path, transcript_path: Path) -> None:
    text = record_game(transcript_path, "hexworld", "optimal", record_frames=True, force=True)
    transcript_path.write_text(text.replace("+10", "+11"))
    assert "frame: expected" in run_pytest(tmp_path).stdout
    (tmp_path / "pytest.ini").write_text("[pytest]\ndmplay_frames = false\n")
    assert "frame: expected" not in run_pytest(tmp_path).stdout


def test_update_rewrites_the_transcript(tmp_path: Path, transcript_path: Path) -> None:
    original = transcript_path.read_text()
    replace_in_file(transcript_path, '"(8,1)"', '"(8,2)"')
    result = run_pytest(tmp_path, "--dmplay-update")
    assert result.returncode == 0
    assert transcript_path.read_text() == original
    assert "\nrewrote goldens/game.dmt\n" in result.stdout
    assert "rewrote" not in run_pytest(tmp_path, "--dmplay-update").stdout


def test_update_keeps_the_line_ends_of_a_checkout(tmp_path: Path, transcript_path: Path) -> None:
    original = transcript_path.read_bytes().replace(b"\n", b"\r\n")
    for content in (original, original.replace(b'"(8,1)"', b'"(8,2)"')):
        transcript_path.write_bytes(content)
        result = run_pytest(tmp_path, "--dmplay-update")
        assert result.returncode == 0
        assert ("rewrote" in result.stdout) is (content != original)
        assert transcript_path.read_bytes() == original


@pytest.mark.parametrize(
    ("marker", "position", "line_end"),
    [
        (b"<<<<<<< HEAD", 0.0, b"\n"),
        (b"=======", 0.5, b"\r\n"),
        (b">>>>>>> other", 1.0, b"\n"),
        (b"||||||| base", 0.5, b"\n"),
    ],
)
def test_a_merge_conflict_is_named_with_its_line(
    tmp_path: Path, transcript_path: Path, marker: bytes, position: float, line_end: bytes
) -> None:
    lines = transcript_path.read_bytes().splitlines()
    index = round(position * len(lines))
    content = line_end.join([*lines[:index], marker, *lines[index:], b""])
    transcript_path.write_bytes(content)
    for words in ((), ("--dmplay-update",)):
        result = run_pytest(tmp_path, *words)
        assert f"goldens/game.dmt:{index + 1}: " in result.stdout
        assert f"got the merge conflict marker {marker.decode()[:7]}; resolve" in result.stdout
        assert result.returncode == 1
        assert transcript_path.read_bytes() == content


def test_update_is_refused_if_ci_is_set(tmp_path: Path, transcript_path: Path) -> None:
    replace_in_file(transcript_path, '"(8,1)"', '"(8,2)"')
    before = transcript_path.read_text()
    result = run_pytest(tmp_path, "--dmplay-update", CI="true")
    assert result.returncode == 4
    assert "--dmplay-update: not allowed while the environment variable CI is set" in result.stderr
    assert transcript_path.read_text() == before


def test_files_of_other_kinds_are_ignored(tmp_path: Path) -> None:
    (tmp_path / "game.txt").write_text("not ours")
    assert "no tests ran" in run_pytest(tmp_path).stdout
