"""Tests of the file of progress."""

import json
from pathlib import Path

import pytest

from dmplay.core.state_files import warn_once
from dmplay.tutor import progress
from dmplay.tutor.lesson_list import (
    LessonOutline,
    list_builtin_outlines,
    load_builtin_lessons,
    load_lessons,
)
from dmplay.tutor.progress import PASSED, PROGRESS_FILE, REVEALED, LessonProgress, StepRecord


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
    for index in range(len(FIRST.step_keys)):
        progress.save_step(FIRST, index, StepRecord(PASSED, 1, 0))
    lessons = [FIRST, SECOND]
    loaded = progress.load_all_progress(lessons)
    assert progress.find_next_lesson(lessons, loaded) == SECOND
    assert progress.format_finished_count(loaded) == "1 of 2 done"


def test_outlines_agree_with_the_lessons() -> None:
    names = [name for name in LessonOutline._fields if name != "position"]
    lessons, outlines = (
        [[getattr(it, name) for name in names] for it in items]
        for items in (load_builtin_lessons(), list_builtin_outlines())
    )
    assert lessons == outlines


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
def test_an_old_entry_that_does_not_fit_the_lesson_counts_as_nothing(entry: object) -> None:
    path = PROGRESS_FILE.path
    path.parent.mkdir(parents=True)
    path.write_text(json.dumps({"dmplay": 1, "lessons": {"first-walk": entry}}))
    assert progress.load_progress(FIRST).finished_count == 0


def test_a_folder_that_cannot_be_written_gives_one_warning(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    warn_once.cache_clear()
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    progress.save_step(FIRST, 0, StepRecord(PASSED, 1, 0))
    progress.save_step(FIRST, 1, StepRecord(PASSED, 1, 0))
    message = capsys.readouterr().err
    assert message.startswith("warning: progress in lessons: not saved: ")
    assert message.count("\n") == 1


OLDER = Path(__file__).parent / "older_progress"  # written by version 0.1.0


@pytest.fixture(name="week")
def older_lesson(tmp_path: Path) -> Path:
    """Return a folder with a lesson, and with progress that an older version wrote."""
    folder = tmp_path / "week3"
    folder.mkdir()
    text = (OLDER / "01-cries.toml").read_text()
    (folder / "01-cries.toml").write_text(text)
    old = (OLDER / "lessons.json").read_text().replace("/home/ada/week3", str(folder))
    PROGRESS_FILE.path.parent.mkdir(parents=True)
    PROGRESS_FILE.path.write_text(old)
    return folder


def list_finished(folder: Path) -> list[bool]:
    """Return whether each step of the first lesson of a folder is finished."""
    [results] = progress.load_all_progress(load_lessons(str(folder)).lessons[:1])
    return [step is not None for step in results.steps]


def test_the_progress_of_an_older_version_is_carried_over(week: Path) -> None:
    lesson = next(it for it in list_builtin_outlines() if it.name == "bayes-at-the-cradle")
    assert [step and step.tries for step in progress.load_progress(lesson).steps] == [2, 1, 1, None]
    assert list_finished(week) == [True, False]
    progress.save_step(lesson, 3, StepRecord(PASSED, 1, 0))
    content = json.loads(PROGRESS_FILE.path.read_text())
    assert content["questions"].keys() == {"puzzle hexworld:1", "puzzle hexworld:2"}
    assert content["lessons"] == {}
    assert progress.load_progress(lesson).is_finished


@pytest.mark.parametrize(
    ("old", "new", "finished"),
    [
        ("Predict first", "First predict", [True, False]),
        ("What is now", "How large is now", [True, False]),
        ("What a cry tells", "Cries", [True, False]),
        ("tolerance = 0.01", "tolerance = 0.02\nboard = false", [True, False]),
        ("seed = 11", "seed = 12", [False, False]),
        ('history = ["ignore crying"]', 'history = ["feed crying"]', [False, False]),
        ('history = ["feed crying"]', 'history = ["ignore quiet"]', [True, False]),
        ('problem = "crying-baby"', 'problem = "crying-baby"\nseats = {}', [True, False]),
    ],
)
def test_progress_belongs_to_the_question_and_not_to_its_words(
    week: Path, old: str, new: str, finished: list[bool]
) -> None:
    assert list_finished(week) == [True, False]
    path = week / "01-cries.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    assert list_finished(week) == finished


def test_progress_does_not_depend_on_place_name_and_order(week: Path, tmp_path: Path) -> None:
    assert list_finished(week) == [True, False]
    copy = tmp_path / "elsewhere"
    copy.mkdir()
    head, first, second = (week / "01-cries.toml").read_text().split("[[steps]]")
    (copy / "04-babies.toml").write_text("[[steps]]".join([head, second, first]))
    assert list_finished(copy) == [False, True]


def test_progress_belongs_to_the_contents_of_a_problem_file(week: Path) -> None:
    assert list_finished(week) == [True, False]
    path = week / "01-cries.toml"
    text = path.read_text().replace('"crying-baby"', '"./baby.pomdp"')
    path.write_text(text)
    (week / "baby.pomdp").write_text("discount: 0.9")
    progress.save_step(load_lessons(str(week)).lessons[0], 1, StepRecord(PASSED, 1, 0))
    (week / "baby.pomdp").rename(week / "cradle.pomdp")
    path.write_text(text.replace("./baby", "cradle"))
    assert list_finished(week) == [False, True]
    (week / "cradle.pomdp").write_text("discount: 0.8")
    assert list_finished(week) == [False, False]


def test_every_step_of_the_built_in_lessons_has_its_own_key() -> None:
    keys = [key for lesson in list_builtin_outlines() for key in lesson.step_keys]
    assert len({*keys}) == len(keys)
