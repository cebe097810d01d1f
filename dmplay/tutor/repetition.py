"""Puzzles and mistakes that return: an entry in the file of progress for each that was asked."""

from collections.abc import Mapping
from datetime import date, timedelta
from typing import Any, NamedTuple

from dmplay.tutor.progress import read_file, update_file

SECTION = "questions"  # of the file of progress
INTERVALS = (1, 3, 7)  # days until a question returns: after a miss, and after each right answer


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


def load_question_progress() -> dict[str, QuestionProgress]:
    """Return the progress with each question that was asked, by its key."""
    entries = read_file().get(SECTION)
    if not isinstance(entries, Mapping):
        return {}
    parsed = {key: _parse_entry(entry) for key, entry in entries.items()}
    return {key: progress for key, progress in parsed.items() if progress}


def save_answer(key: str, *, is_right: bool, today: date) -> None:
    """Save whether the first answer to a question was right, and when the question returns."""

    def change(content: dict[str, Any]) -> None:
        """Replace the entry of the question."""
        entries = content.get(SECTION)
        if not isinstance(entries, dict):
            entries = content[SECTION] = {}
        progress = schedule(_parse_entry(entries.get(key)), is_right=is_right, today=today)
        due = progress.due.isoformat() if progress.due else ""
        entries[key] = {"right": progress.right_count, "due": due}

    update_file(change)


def schedule(earlier: QuestionProgress | None, *, is_right: bool, today: date) -> QuestionProgress:
    """Return the progress after an answer.

    A question that was missed returns after 1 day. It returns again 3 and 7 days after right
    answers, and then it is learned. An answer before that day does not count.
    """
    if not is_right:
        return QuestionProgress(0, today + timedelta(INTERVALS[0]))
    if earlier is None or earlier.is_learned:
        return QuestionProgress(len(INTERVALS), None)
    if not earlier.is_due(today):
        return earlier
    right_count = earlier.right_count + 1
    days = INTERVALS[right_count] if right_count < len(INTERVALS) else None
    return QuestionProgress(right_count, today + timedelta(days) if days else None)


def _parse_entry(entry: object) -> QuestionProgress | None:
    """Return the progress of one entry; None if it is invalid."""
    if not isinstance(entry, Mapping):
        return None
    right_count, due = entry.get("right"), entry.get("due")
    if not isinstance(right_count, int) or not isinstance(due, str):
        return None
    try:
        return QuestionProgress(right_count, date.fromisoformat(due) if due else None)
    except ValueError:
        return None
