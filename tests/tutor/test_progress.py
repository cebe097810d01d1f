"""Tests of the file of progress."""

import json
from pathlib import Path

import pytest

from dmplay.tutor import progress
from dmplay.tutor.lesson_list import list_builtin_outlines, load_builtin_lessons
from dmplay.tutor.progress import PASSED, REVEALED, LessonProgress, StepRecord


@pytest.fixture(autouse=True)
def _state_in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the progress of a test in its own folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


FIRST, SECOND, *_ = list_builtin_outlines()


def test_nothing_is_done_at_first() -> None:
    assert progress.load_progress(FIRST) == LessonProgress((None, None, None))
    assert not progress.load_progress(FIRST).is_finished


def test_a_step_is_saved_and_the_next_one_is_open() -> None:
    progress.save_step(FIRST, 0, StepRecord(PASSED, 2, 1))
    loaded = progress.load_progress(FIRST)
    assert loaded.steps == (StepRecord(PASSED, 2, 1), None, None)
    assert loaded.first_open_step == 1
    assert len(loaded.date) == len("2026-01-31")


def test_a_passed_step_remains_passed() -> None:
    progress.save_step(FIRST, 0, StepRecord(PASSED, 1, 0))
    progress.save_step(FIRST, 0, StepRecord(REVEALED, 3, 1))
    assert progress.load_progress(FIRST).steps[0] == StepRecord(PASSED, 1, 0)


def test_a_revealed_step_can_still_be_passed() -> None:
    progress.save_step(FIRST, 0, StepRecord(REVEALED, 3, 1))
    progress.save_step(FIRST, 0, StepRecord(PASSED, 1, 0))
    assert progress.load_progress(FIRST).steps[0] == StepRecord(PASSED, 1, 0)


def test_the_next_lesson_is_the_first_open_one() -> None:
    for index in range(FIRST.step_count):
        progress.save_step(FIRST, index, StepRecord(PASSED, 1, 0))
    lessons = [FIRST, SECOND]
    loaded = progress.load_all_progress(lessons)
    assert progress.find_next_lesson(lessons, loaded) == SECOND
    assert progress.count_finished(lessons, loaded) == "1 of 2 done"


def test_outlines_agree_with_the_lessons() -> None:
    assert [
        (lesson.number, lesson.title, lesson.step_count, lesson.progress_key)
        for lesson in load_builtin_lessons()
    ] == [*map(tuple, list_builtin_outlines())]


@pytest.mark.parametrize(
    "content",
    ["", "[]", "{", '{"dmplay": 2}', '{"dmplay": 1, "lessons": []}', "\x00", "[" * 100_000],
)
def test_a_corrupt_file_gives_one_warning(content: str, capsys: pytest.CaptureFixture[str]) -> None:
    progress._warn_once.cache_clear()
    path = progress.progress_path()
    path.parent.mkdir(parents=True)
    path.write_text(content)
    for _ in range(2):
        assert progress.load_progress(FIRST).finished_count == 0
    message = f"warning: {path} is not a file of progress; dmplay starts a new one\n"
    assert capsys.readouterr().err == message
    progress.save_step(FIRST, 0, StepRecord(PASSED, 1, 0))
    assert json.loads(path.read_text())["lessons"].keys() == {"first-walk"}


@pytest.mark.parametrize(
    "entry",
    [
        [],
        {"steps": [None], "date": ""},
        {"steps": [None, None, {"result": "passed"}], "date": ""},
        {"steps": [None, None, 5], "date": ""},
        {"steps": [None] * 3},
    ],
)
def test_an_entry_that_does_not_fit_the_lesson_counts_as_nothing(entry: object) -> None:
    path = progress.progress_path()
    path.parent.mkdir(parents=True)
    path.write_text(json.dumps({"dmplay": 1, "lessons": {"first-walk": entry}}))
    assert progress.load_progress(FIRST).finished_count == 0


def test_other_entries_of_the_file_are_kept() -> None:
    path = progress.progress_path()
    path.parent.mkdir(parents=True)
    path.write_text(json.dumps({"dmplay": 1, "puzzles": {"solved": 3}}))
    progress.save_step(FIRST, 0, StepRecord(PASSED, 1, 0))
    assert json.loads(path.read_text())["puzzles"] == {"solved": 3}


def test_a_folder_that_cannot_be_written_gives_one_warning(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    progress._warn_once.cache_clear()
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    progress.save_step(FIRST, 0, StepRecord(PASSED, 1, 0))
    progress.save_step(FIRST, 1, StepRecord(PASSED, 1, 0))
    message = capsys.readouterr().err
    assert message.startswith("warning: the progress in lessons is not saved: ")
    assert message.count("\n") == 1
