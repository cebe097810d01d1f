"""The player's progress in lessons: one JSON file in the state folder."""

import json
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from time import strftime
from typing import Any, NamedTuple, Protocol

from dmplay.core import safe_files
from dmplay.errors import DmplayError, clip_message
from dmplay.game.saves import saves_folder

FORMAT_VERSION = 1
PASSED, REVEALED = "passed", "revealed"  # the results of a finished step


class LessonInList(Protocol):
    """The facts of a lesson that a list of lessons needs."""

    @property
    def number(self) -> int:
        """The number of the lesson."""

    @property
    def title(self) -> str:
        """The title of the lesson."""

    @property
    def step_count(self) -> int:
        """The number of steps."""

    @property
    def progress_key(self) -> str:
        """The key of the lesson in the file of progress."""


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


def load_progress(lesson: LessonInList) -> LessonProgress:
    """Return the progress in a lesson; it is empty if the lesson has other steps by now."""
    return load_all_progress([lesson])[lesson.progress_key]


def load_all_progress(lessons: Sequence[LessonInList]) -> dict[str, LessonProgress]:
    """Return the progress in each of these lessons, by key; the file is read once."""
    entries = read_file().get("lessons", {})
    return {
        lesson.progress_key: _parse_entry(entries.get(lesson.progress_key), lesson)
        for lesson in lessons
    }


def find_next_lesson(
    lessons: Sequence[LessonInList], progress: Mapping[str, LessonProgress]
) -> LessonInList | None:
    """Return the first lesson that is not finished; None if all are."""
    open_lessons = (lesson for lesson in lessons if not progress[lesson.progress_key].is_finished)
    return next(open_lessons, None)


def count_finished(lessons: Sequence[LessonInList], progress: Mapping[str, LessonProgress]) -> str:
    """Return the number of lessons that are finished as text, such as "3 of 17 done"."""
    count = sum(progress[lesson.progress_key].is_finished for lesson in lessons)
    return f"{count} of {len(lessons)} done"


def save_step(lesson: LessonInList, index: int, result: StepRecord) -> None:
    """Save the result of a step under a lock; print a warning if that fails.

    A step that was passed remains passed.
    """

    def change(content: dict[str, Any]) -> None:
        """Add the result to the entry of the lesson."""
        entries = content.setdefault("lessons", {})
        steps = [*_parse_entry(entries.get(lesson.progress_key), lesson).steps]
        earlier = steps[index]
        if earlier is None or earlier.result != PASSED:
            steps[index] = result
        entries[lesson.progress_key] = {
            "steps": [step and step._asdict() for step in steps],
            "date": strftime("%Y-%m-%d"),
        }

    update_file(change)


def update_file(change: Callable[[dict[str, Any]], None]) -> None:
    """Change the contents of the file of progress under a lock; print a warning if that fails."""
    path = progress_path()
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        with safe_files.exclusive_lock(path.with_suffix(".lock")):
            content = read_file()
            change(content)
            text = json.dumps({"dmplay": FORMAT_VERSION, **content}, indent=1) + "\n"
            safe_files.write_file(path, text, force=True, private=True)
    except (DmplayError, OSError) as error:
        _warn_once(f"the progress in lessons is not saved: {error}")


def progress_path() -> Path:
    """Return the path of the file of progress."""
    return saves_folder(os.environ).parent / "lessons.json"


def read_file() -> dict[str, Any]:
    """Return the contents of the file of progress; {}, after one warning, if it is invalid."""
    path = progress_path()
    try:
        content = json.loads(safe_files.read_bytes(path), parse_constant=float)
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, RecursionError):
        content = None
    is_valid = isinstance(content, dict) and content.get("dmplay") == FORMAT_VERSION
    if not is_valid or not isinstance(content.get("lessons", {}), dict):
        _warn_once(f"{path} is not a file of progress; dmplay starts a new one")
        return {}
    return dict(content)


def _parse_entry(entry: object, lesson: LessonInList) -> LessonProgress:
    """Return the progress of one entry; without results if it does not fit the lesson."""
    blank = LessonProgress((None,) * lesson.step_count)
    if not isinstance(entry, Mapping):
        return blank
    rows, date = entry.get("steps"), entry.get("date")
    if not isinstance(rows, list) or len(rows) != lesson.step_count or not isinstance(date, str):
        return blank
    try:
        steps = tuple(None if row is None else StepRecord(**row) for row in rows)
    except TypeError:
        return blank
    return LessonProgress(steps, date)


@cache  # prints each warning only once
def _warn_once(message: str) -> None:
    """Print a warning to standard error, once for each message."""
    print(clip_message(f"warning: {message}"), file=sys.stderr)
