"""The player's progress in lessons: one JSON file in the state folder."""

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from datetime import UTC, date, datetime
from pathlib import Path
from time import strftime
from typing import Any, NamedTuple, Protocol, TypeVar

from dmplay.core import safe_files
from dmplay.core.state_files import StateFile, require_line, require_whole_number

PASSED, REVEALED = "passed", "revealed"  # the results of a finished step
STEPS, OLD_LESSONS = "steps", "lessons"  # sections of the file; older versions wrote the second
QUESTIONS = "questions"  # the section of puzzles and mistakes
MAX_RIGHT_ANSWERS = 3  # since the last miss of a question, after which it does not return
# Keys of a step's tables that change its words or its display, and not its question.
WORDING_KEYS = ("goal", "result", "tolerance", "board", "belief", "watch", "watch_first", "notes")
DEFAULT_VALUES: Mapping[str, object] = {"seed": 0, "parameters": {}, "seats": {}, "after": []}
KEY_DIGITS = 16


class LessonInList(Protocol):
    """The facts of a lesson that a list of lessons needs."""

    @property
    def number(self) -> int:
        """The number of the lesson."""

    @property
    def title(self) -> str:
        """The title of the lesson."""

    @property
    def step_keys(self) -> tuple[str, ...]:
        """The key of each step in the file of progress."""

    @property
    def old_key(self) -> str:
        """The key of the lesson in the files of older versions."""


LessonT = TypeVar("LessonT", bound=LessonInList)


class StepRecord(NamedTuple):
    """The result of a finished step: passed, or revealed after three wrong tries."""

    result: str
    tries: int
    hints: int


class LessonProgress(NamedTuple):
    """The results of a lesson's steps, None for those that are not finished."""

    steps: tuple[StepRecord | None, ...] = ()
    date: str = ""  # day of the last result

    @property
    def finished_count(self) -> int:
        """The number of finished steps."""
        return sum(step is not None for step in self.steps)

    @property
    def is_finished(self) -> bool:
        """True if all steps are finished."""
        return bool(self.steps) and self.finished_count == len(self.steps)

    @property
    def first_open_step(self) -> int:
        """The index of the first step that is not finished; 0 if all are."""
        return next((index for index, step in enumerate(self.steps) if step is None), 0)


def current_day() -> date:
    """Return the day in UTC, which is the same for all players."""
    return datetime.now(UTC).date()


def load_progress(lesson: LessonInList) -> LessonProgress:
    """Return the progress in a lesson."""
    [progress] = load_all_progress([lesson])
    return progress


def load_all_progress(lessons: Sequence[LessonInList]) -> list[LessonProgress]:
    """Return the progress in each of these lessons; the file is read once.

    The results that an older version wrote for a lesson become those of its steps.
    """
    content = PROGRESS_FILE.read()
    if any(_list_old_results(content, lesson) for lesson in lessons):
        content = (
            PROGRESS_FILE.update(lambda changed: _move_old_results(changed, lessons)) or content
        )
    entries = content.get(STEPS, {})
    return [
        LessonProgress(
            tuple(
                parse_step_entry(entries[key]) if key in entries else None
                for key in lesson.step_keys
            ),
            max((entries[key]["date"] for key in lesson.step_keys if key in entries), default=""),
        )
        for lesson in lessons
    ]


def _list_old_results(content: Mapping[str, Any], lesson: LessonInList) -> list[Any]:
    """Return the results of a lesson's steps by an older version, [] if it had other steps."""
    rows = content.get(OLD_LESSONS, {}).get(lesson.old_key, {}).get("steps", [])
    return list(rows) if len(rows) == len(lesson.step_keys) else []


def _move_old_results(content: dict[str, Any], lessons: Sequence[LessonInList]) -> None:
    """Move the results that older versions wrote for these lessons to their steps."""
    for lesson in lessons:
        rows = _list_old_results(content, lesson)
        if rows:
            day = content[OLD_LESSONS].pop(lesson.old_key)["date"]
            entries = content.setdefault(STEPS, {})
            for key, row in zip(lesson.step_keys, rows, strict=True):
                if row:
                    entries.setdefault(key, {**row, "date": day})


def find_next_lesson(
    lessons: Sequence[LessonT], progress: Sequence[LessonProgress]
) -> LessonT | None:
    """Return the first lesson that is not finished; None if all are."""
    pairs = zip(lessons, progress, strict=True)
    return next((lesson for lesson, results in pairs if not results.is_finished), None)


def format_finished_count(progress: Sequence[LessonProgress]) -> str:
    """Return the number of lessons that are finished as text, such as "3 of 17 done"."""
    return f"{sum(results.is_finished for results in progress)} of {len(progress)} done"


def save_step(lesson: LessonInList, index: int, result: StepRecord) -> None:
    """Save the result of a step; print a warning if that fails. A passed step remains passed."""

    def change(content: dict[str, Any]) -> None:
        """Add the result of the step."""
        _move_old_results(content, [lesson])
        entries, key = content.setdefault(STEPS, {}), lesson.step_keys[index]
        if key not in entries or entries[key]["result"] != PASSED:
            entries[key] = {**result._asdict(), "date": strftime("%Y-%m-%d")}

    PROGRESS_FILE.update(change)


def make_step_keys(lesson: Mapping[str, Any], folder: Path) -> tuple[str, ...]:
    """Return the key of each step of a lesson's file, made of its problem and its question.

    The words of the lesson, its place and the order of its steps are no part of them. A file that
    the question names is, by its contents.
    """
    keys: list[str] = []
    for step in lesson["steps"]:
        position = {**DEFAULT_VALUES, **lesson["position"], **step.get("position", {})}
        task = step["predict"] if "predict" in step else step["play"]
        question = {name: task[name] for name in task if name not in WORDING_KEYS}
        text = json.dumps(_normalize([position, question], folder), sort_keys=True, default=str)
        key = hashlib.sha256(text.encode(errors="replace")).hexdigest()[:KEY_DIGITS]
        keys.append(key + f" {keys.count(key) + 1}" * (key in keys))
    return tuple(keys)


def _normalize(value: object, folder: Path) -> object:
    """Return a value of a lesson's file such that equal questions have equal values."""
    if isinstance(value, dict):
        return {name: _normalize(entry, folder) for name, entry in value.items()}
    if isinstance(value, list):
        return [_normalize(entry, folder) for entry in value]
    if isinstance(value, str):
        source, colon, name = value.strip().partition(":")
        path = folder / source
        with suppress(OSError):
            if path.suffix and os.path.isfile(path):
                return hashlib.sha256(safe_files.read_bytes(path)).hexdigest() + colon + name
        return value.strip()
    is_integer = isinstance(value, int) and not isinstance(value, bool)
    return float(str(value)) if is_integer else value


def parse_step_entry(entry: Any) -> StepRecord:
    """Return the result of a step; raise ValueError, TypeError or KeyError if it is invalid."""
    if entry["result"] not in (PASSED, REVEALED):
        raise ValueError(entry)
    numbers = (require_whole_number(entry[name]) for name in ("tries", "hints"))
    require_line(entry["date"])
    return StepRecord(entry["result"], *numbers)


def _check_old_lesson(entry: Any) -> None:
    """Raise ValueError, TypeError or KeyError unless an older version wrote this lesson."""
    require_line(entry["date"])
    if not isinstance(entry["steps"], list):
        raise TypeError(entry)
    for row in filter(None, entry["steps"]):
        parse_step_entry({**row, "date": entry["date"]})


class QuestionProgress(NamedTuple):
    """The progress with one question: the right answers since the last miss, and its next day."""

    right_count: int
    due: date | None  # None if the question does not return

    def is_due(self, today: date) -> bool:
        """Return whether the question returns today."""
        return self.due is not None and self.due <= today

    @property
    def is_learned(self) -> bool:
        """True if the question does not return."""
        return self.due is None


def parse_question_entry(entry: Any) -> QuestionProgress:
    """Return the progress with a question; raise ValueError, TypeError or KeyError if invalid."""
    right_count = require_whole_number(entry["right"], MAX_RIGHT_ANSWERS)
    due = date.fromisoformat(entry["due"]) if entry["due"] else None
    return QuestionProgress(right_count, due)


PROGRESS_FILE = StateFile(
    "lessons.json",
    "progress in lessons",
    {
        STEPS: (dict, parse_step_entry),
        OLD_LESSONS: (dict, _check_old_lesson),
        QUESTIONS: (dict, parse_question_entry),
    },
)
