"""Tests that a transcript whose only change is its line ends verifies, with a remark."""

from pathlib import Path

import pytest

from dmplay.evaluation.grading import grade_files
from dmplay.game.transcript_files import rewrite_file, verify_file
from tests.support.games import record_game
from tests.support.programs import run_dmplay

REMARK = "line ends changed, as by mail or an editor"
CHANGES = {
    "CRLF": lambda raw: raw.replace(b"\n", b"\r\n"),
    "mixed": lambda raw: raw.replace(b"\n", b"\r\n", 5),
    "no last newline": lambda raw: raw.rstrip(b"\n"),
    "byte order mark": lambda raw: b"\xef\xbb\xbf" + raw,
    "all": lambda raw: b"\xef\xbb\xbf" + raw.replace(b"\n", b"\r\n").rstrip(b"\r\n"),
}


@pytest.fixture(params=CHANGES)
def changed_path(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """A game whose file came back with other line ends, and with the original beside it."""
    path = tmp_path / "g.dmt"
    record_game(path, "crying-baby", "feed-when-crying", turns=3)
    (tmp_path / "original").write_bytes(path.read_bytes())
    path.write_bytes(CHANGES[request.param](path.read_bytes()))
    assert path.read_bytes() != (tmp_path / "original").read_bytes()
    return path


def test_a_file_with_other_line_ends_verifies_with_a_remark(changed_path: Path) -> None:
    report = verify_file(changed_path)
    assert (report.findings, report.summary) == ([], f"3 turns; {REMARK}")
    (grade,) = grade_files([changed_path]).grades
    assert (grade.verified, grade.remarks) == (True, (REMARK,))


def test_update_writes_the_line_ends_of_dmplay(changed_path: Path) -> None:
    rewrite_file(changed_path)
    assert changed_path.read_bytes() == (changed_path.parent / "original").read_bytes()


def test_another_change_is_still_found(changed_path: Path) -> None:
    changed_path.write_bytes(changed_path.read_bytes().replace(b'"ignore"', b'"sing"', 1))
    assert not verify_file(changed_path).is_ok


def test_a_game_with_other_line_ends_is_resumed(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="e\nquit\n")
    path = tmp_path / "g.dmt"
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    run_dmplay(tmp_path, "resume", "g.dmt", stdin="ne\nquit\n")
    assert b"\r" not in path.read_bytes()
    assert verify_file(path).summary == "2 turns; not re-asked: human"


@pytest.mark.parametrize("ending", ['end: {"reason": "turn', "# a note"])
def test_a_torn_end_line_stays_torn(tmp_path: Path, ending: str) -> None:
    content = record_game(tmp_path / "g.dmt", "hexworld", "random", turns=2)
    (tmp_path / "g.dmt").write_text(content[: content.index("end:")] + ending)
    assert verify_file(tmp_path / "g.dmt").is_unfinished
