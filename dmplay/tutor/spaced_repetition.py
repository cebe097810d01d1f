"""Puzzles and mistakes that return: an entry in the file of progress for each that was asked."""

from datetime import date, timedelta
from typing import Any

from dmplay.tutor.progress import PROGRESS_FILE, QUESTIONS, QuestionProgress, parse_question_entry

INTERVALS = (1, 3, 7)  # days until a question returns: after a miss, and after each right answer


def load_question_progress() -> dict[str, QuestionProgress]:
    """Return the progress with each question that was asked, by its key."""
    entries = PROGRESS_FILE.read().get(QUESTIONS, {})
    return {key: parse_question_entry(entry) for key, entry in entries.items()}


def save_first_answer(key: str, *, is_right: bool, today: date) -> None:
    """Save whether the first answer to a question was right, and when the question returns."""

    def change(content: dict[str, Any]) -> None:
        """Replace the entry of the question."""
        entries = content.setdefault(QUESTIONS, {})
        earlier = parse_question_entry(entries[key]) if key in entries else None
        progress = update_schedule(earlier, is_right=is_right, today=today)
        due = progress.due.isoformat() if progress.due else ""
        entries[key] = {"right": progress.right_count, "due": due}

    PROGRESS_FILE.update(change)


def update_schedule(
    earlier: QuestionProgress | None, *, is_right: bool, today: date
) -> QuestionProgress:
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
