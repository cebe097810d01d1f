"""Tests of the files in which dmplay remembers things: nothing in them is lost."""

import json
from datetime import date
from pathlib import Path

import pytest

from dmplay.core.state_files import StateFile, warn_once
from dmplay.game.player_records import RECORDS_FILE, load_records
from dmplay.tutor.progress import PROGRESS_FILE
from dmplay.tutor.spaced_repetition import load_question_progress, save_first_answer

TODAY = date(2026, 11, 28)
RESULT = {"return": -27, "turns": 10, "seed": 7, "day": "2026-11-28"}
RECORD = {"problem": "catch", "parameters": {}, "turns": None, "seat": "agent", "last": RESULT}
RECORDS = {"dmplay": 1, "records": [{**RECORD, "best": None}]}
PROGRESS = {
    "dmplay": 1,
    "steps": {"a": {"result": "passed", "tries": 1, "hints": 0, "date": "2026-11-28"}},
    "questions": {"puzzle catch:7": {"right": 1, "due": "2026-11-28"}},
    "of a colleague": [1, 2.5, None],
}
CASES = [(PROGRESS_FILE, PROGRESS), (RECORDS_FILE, RECORDS)]


@pytest.fixture(autouse=True)
def _state_in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the state of a test in its own folder, and print its warnings again."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    (tmp_path / "dmplay").mkdir()
    warn_once.cache_clear()


def change_file(file: StateFile) -> None:
    """Change a file as dmplay does after an answer or a game."""
    file.update(lambda content: content.update(changed=True))


def list_files_aside(file: StateFile) -> list[Path]:
    """Return the files that were kept aside, in order."""
    return sorted(file.path.parent.glob(f"{file.path.stem}-unreadable*.json"))


@pytest.mark.parametrize(("file", "content"), CASES)
@pytest.mark.parametrize(
    "damage",
    [
        lambda raw: raw[:-9],
        lambda raw: raw + b"more",
        lambda raw: b"[" + raw + b"]",
        lambda raw: raw.replace(b"1", b"\0", 1),
        lambda raw: b"",
        lambda raw: b"[" * 100_000,
        lambda raw: b"\xff" + raw,
        lambda raw: raw.replace(b'"dmplay": 1', b'"dmplay": "one"'),
        lambda raw: raw.replace(b'"dmplay": 1', b'"dmplay": true'),
        lambda raw: raw.replace(b'"dmplay": 1, ', b""),
        lambda raw: raw.replace(b"2026-11-28", b"2026\\n11-28"),
        lambda raw: raw.replace(b"puzzle", b"\\n").replace(b'": 1', b'": -1'),
    ],
)
def test_contents_that_cannot_be_read_are_kept_aside_with_one_line(
    file: StateFile, content: object, damage: object, capsys: pytest.CaptureFixture[str]
) -> None:
    assert callable(damage)
    damaged = damage(json.dumps(content).encode())
    file.path.write_bytes(damaged)
    for _ in range(2):
        file.read()
        change_file(file)
    [aside] = list_files_aside(file)
    assert aside.read_bytes() == damaged
    [line] = capsys.readouterr().err.splitlines()
    assert line.startswith(f"warning: {file.purpose}: {file.path}: ")
    assert line.endswith(f"; dmplay keeps the old file as {aside}")
    assert json.loads(file.path.read_text())["changed"]


@pytest.mark.parametrize(("file", "content"), CASES)
@pytest.mark.parametrize("version", ["2", "1.5", "1e400", "99999999999999999999"])
def test_a_file_of_a_later_version_is_neither_read_nor_written(
    file: StateFile, content: dict[str, object], version: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = json.dumps(content).replace('"dmplay": 1', f'"dmplay": {version}')
    file.path.write_text(text)
    for _ in range(2):
        assert file.read() == {}
        change_file(file)
    assert file.path.read_text() == text
    assert not list_files_aside(file)
    for line in capsys.readouterr().err.splitlines():
        assert f"{file.path} was written by a later version of dmplay" in line


def test_one_entry_that_cannot_be_read_does_not_hide_the_others() -> None:
    entries = {"good": {"right": 1, "due": "2026-11-28"}, "bad": {"right": -10, "due": ""}}
    content = {"dmplay": 1, "questions": entries}
    PROGRESS_FILE.path.write_text(json.dumps(content))
    save_first_answer("bad", is_right=True, today=TODAY)
    assert load_question_progress() == {"good": (1, TODAY), "bad": (3, None)}
    [aside] = list_files_aside(PROGRESS_FILE)
    assert json.loads(aside.read_text()) == content


@pytest.mark.parametrize("right", [-10, -1, 4, 2**70, True, 1.5, "1", None, [], float("nan")])
def test_numbers_beyond_their_range_are_not_read(right: object) -> None:
    entries = {"puzzle catch:7": {"right": right, "due": ""}}
    PROGRESS_FILE.path.write_text(json.dumps({"dmplay": 1, "questions": entries}))
    assert load_question_progress() == {}
    RECORDS_FILE.path.write_text(
        json.dumps({"dmplay": 1, "records": [{**RECORD, "best": {**RESULT, "seed": right}}]})
    )
    assert bool(load_records()) == (right == 4)


def test_a_folder_in_place_of_the_file_is_kept_aside() -> None:
    PROGRESS_FILE.path.mkdir()
    (PROGRESS_FILE.path / "inside").write_text("mine")
    save_first_answer("puzzle catch:7", is_right=False, today=TODAY)
    [aside] = list_files_aside(PROGRESS_FILE)
    assert (aside / "inside").read_text() == "mine"
    assert load_question_progress()


def test_sections_of_others_and_a_second_file_aside_are_kept() -> None:
    PROGRESS_FILE.path.write_text(json.dumps(PROGRESS))
    change_file(PROGRESS_FILE)
    assert {"dmplay": 1, **PROGRESS_FILE.read()} == {**PROGRESS, "changed": True}
    for text in ("first", "second"):
        PROGRESS_FILE.path.write_text(text)
        change_file(PROGRESS_FILE)
    assert {path.read_text() for path in list_files_aside(PROGRESS_FILE)} == {"first", "second"}


@pytest.mark.parametrize(("file", "content"), CASES)
@pytest.mark.parametrize("damaged", [None, "", "{"])
def test_a_file_that_a_symbolic_link_names_is_written_through_the_link(
    file: StateFile,
    content: dict[str, object],
    damaged: str | None,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "mine").mkdir()
    target, link = tmp_path / "mine" / "state.json", tmp_path / "dmplay" / file.name
    if damaged is not None:
        target.write_text(damaged or json.dumps(content))
    link.symlink_to(Path("..", "mine", "state.json"))
    change_file(file)
    assert link.is_symlink()
    saved = json.loads(target.read_text())
    assert saved == {"dmplay": 1, **(content if damaged == "" else {}), "changed": True}
    aside = [path.read_text() for path in list_files_aside(file)]
    assert (aside, bool(capsys.readouterr().err)) == ([damaged] * bool(damaged), bool(damaged))
