"""Tests of the days on which missed questions return."""

import json
from datetime import date, timedelta
from pathlib import Path

import pytest

from dmplay.tutor.progress import PROGRESS_FILE, QuestionProgress
from dmplay.tutor.spaced_repetition import (
    load_question_progress,
    save_first_answer,
    update_schedule,
)

TODAY = date(2026, 11, 28)


@pytest.fixture(autouse=True)
def _state_in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the progress of a test in its own folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


def test_a_missed_question_returns_after_1_3_and_7_days_and_is_then_learned() -> None:
    progress, day, days = update_schedule(None, is_right=False, today=TODAY), TODAY, list[int]()
    while progress.due:
        days.append((progress.due - day).days)
        day = progress.due
        progress = update_schedule(progress, is_right=True, today=day)
    assert days == [1, 3, 7]
    assert progress.is_learned


def test_a_question_that_is_right_at_first_does_not_return() -> None:
    assert update_schedule(None, is_right=True, today=TODAY).is_learned


def test_a_miss_begins_the_days_again() -> None:
    progress = QuestionProgress(2, TODAY)
    assert update_schedule(progress, is_right=False, today=TODAY) == (0, TODAY + timedelta(1))


def test_a_right_answer_before_the_day_changes_nothing() -> None:
    progress = QuestionProgress(1, TODAY + timedelta(2))
    assert update_schedule(progress, is_right=True, today=TODAY) == progress


def test_the_progress_is_in_the_file_of_the_lessons() -> None:
    PROGRESS_FILE.path.parent.mkdir(parents=True)
    PROGRESS_FILE.path.write_text(
        '{"dmplay": 1, "lessons": {"first-walk": {"steps": [], "date": ""}}}'
    )
    save_first_answer("puzzle catch:7", is_right=False, today=TODAY)
    content = json.loads(PROGRESS_FILE.path.read_text())
    assert content["lessons"] == {"first-walk": {"steps": [], "date": ""}}
    assert content["questions"] == {"puzzle catch:7": {"right": 0, "due": "2026-11-29"}}
    assert load_question_progress() == {"puzzle catch:7": (0, date(2026, 11, 29))}


@pytest.mark.parametrize(
    "entry", [7, {"right": 1}, {"right": "1", "due": ""}, {"right": 1, "due": "soon"}]
)
def test_an_invalid_entry_counts_as_never_asked(entry: object) -> None:
    PROGRESS_FILE.path.parent.mkdir(parents=True)
    PROGRESS_FILE.path.write_text(json.dumps({"dmplay": 1, "questions": {"puzzle catch:7": entry}}))
    assert load_question_progress() == {}
    save_first_answer("puzzle catch:7", is_right=True, today=TODAY)
    assert load_question_progress()["puzzle catch:7"].is_learned
