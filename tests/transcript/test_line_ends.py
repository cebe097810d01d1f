"""Tests that a transcript whose only change is its line ends verifies, with a remark."""

from pathlib import Path

import pytest

from dmplay.evaluation.grading import grade_files
from dmplay.game.transcript_verification import rewrite_file, verify
from tests.support.games import record_game
from tests.support.programs import run_dmplay

REMARK = "line ends changed, for example by mail or an editor"
CHANGES = {
    "CRLF": lambda raw: raw.replace(b"\n", b"\r\n"),
    "mixed": lambda raw: raw.replace(b"\n", b"\r\n", 5),
    "no last newline": lambda raw: raw.rstrip(b"\n"),
    "byte order mark": lambda raw: b"\xef\xbb\xbf" + raw,
    "one blank line": lambda raw: raw + b"\n",
    "several blank lines": lambda raw: raw + b"\n\n\n",
    "blank lines with spaces": lambda raw: raw + b"\n \n\t  \n",
    "spaces without a newline": lambda raw: raw + b"  ",
    "no last newline, but spaces": lambda raw: raw.rstrip(b"\n") + b"  ",
    "CRLF and a blank line": lambda raw: (raw + b"\n").replace(b"\n", b"\r\n"),
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
    report = verify(changed_path)
    assert (report.findings, report.summary) == ([], f"3 turns; {REMARK}")
    (grade,) = grade_files([changed_path]).grades
    assert (grade.verified, grade.remarks) == (True, (REMARK,))


def test_update_writes_the_line_ends_of_dmplay(changed_path: Path) -> None:
    rewrite_file(changed_path)
    assert changed_path.read_bytes() == (changed_path.parent / "original").read_bytes()


def test_another_change_is_still_found(changed_path: Path) -> None:
    changed_path.write_bytes(changed_path.read_bytes().replace(b'"ignore"', b'"sing"', 1))
    assert not verify(changed_path).is_ok


def test_a_game_with_other_line_ends_is_resumed(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="e\nquit\n")
    path = tmp_path / "g.dmt"
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    run_dmplay(tmp_path, "resume", "g.dmt", stdin="ne\nquit\n")
    assert b"\r" not in path.read_bytes()
    assert verify(path).summary == "2 turns; not recomputed: human"


@pytest.mark.parametrize("added", [b"\n", b"\n\n", b"  \n", b"\r\n\r\n"])
def test_an_unfinished_game_with_blank_lines_at_its_end_is_resumed(
    added: bytes, tmp_path: Path
) -> None:
    words = ("hexworld", "--seed", "7", "--frames", "-o", "g.dmt")
    run_dmplay(tmp_path, *words, stdin="e\nquit\n")
    path = tmp_path / "g.dmt"
    raw = path.read_bytes()
    path.write_bytes(raw[: raw.index(b"end:")] + added)
    run_dmplay(tmp_path, "resume", "g.dmt", stdin="ne\nquit\n")
    report = verify(path)
    assert (report.findings, report.summary) == ([], "2 turns; not recomputed: human")


def test_a_note_below_the_end_keeps_its_spaces(tmp_path: Path) -> None:
    path = tmp_path / "g.dmt"
    record_game(path, "hexworld", "random", turns=2)
    noted = path.read_bytes() + b"# a good game  \n"
    path.write_bytes(noted)
    assert verify(path).summary == "2 turns"
    path.write_bytes(noted + b"\n")
    assert verify(path).summary == f"2 turns; {REMARK}"
    rewrite_file(path)
    assert path.read_bytes() == noted
    path.write_bytes(noted.rstrip())
    assert verify(path).summary == f"2 turns; {REMARK}"


def test_a_line_after_an_empty_one_below_the_end_is_refused_by_its_reason(tmp_path: Path) -> None:
    path = tmp_path / "g.dmt"
    content = record_game(path, "hexworld", "random", turns=2)
    path.write_text(f"{content}\n# a note\n")
    (finding,) = verify(path).findings
    assert "got lines after the end of the game, expected only notes" in str(finding)


@pytest.mark.parametrize("ending", ['end: {"reason": "turn', "# a note"])
def test_a_torn_end_line_stays_torn(tmp_path: Path, ending: str) -> None:
    content = record_game(tmp_path / "g.dmt", "hexworld", "random", turns=2)
    (tmp_path / "g.dmt").write_text(content[: content.index("end:")] + ending)
    assert verify(tmp_path / "g.dmt").is_unfinished
