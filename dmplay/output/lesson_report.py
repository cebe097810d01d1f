"""The list of lessons with the player's progress."""

from collections.abc import Sequence

from dmplay.core.text import align_columns, escape_newlines, format_json_report
from dmplay.game.command_line_results import Printout
from dmplay.tutor.lesson import TutorLesson
from dmplay.tutor.lesson_list import LessonOutline, list_builtin_outlines, load_lessons
from dmplay.tutor.progress import (
    REVEALED,
    LessonProgress,
    find_next_lesson,
    format_finished_count,
    load_all_progress,
)

INVALID_LESSON_EXIT_CODE = 2  # for a teacher; the other lessons are listed
LessonList = Sequence[TutorLesson | LessonOutline]


def report_lessons(source: str, *, as_json: bool) -> Printout:
    """Return the lessons of a source with the progress in each, as a table or as JSON.

    The faults of files that are not valid lessons are the error text.
    """
    lessons: LessonList
    lessons, faults = load_lessons(source) if source else (list_builtin_outlines(), {})
    progress = load_all_progress(lessons)
    text = (
        format_json_report(_build_progress(lessons, progress))
        if as_json
        else _format_table(lessons, progress, source)
    )
    errors = "\n".join(f"error: {escape_newlines(str(error))}" for error in faults.values())
    return Printout(text, stderr_text=errors, exit_code=INVALID_LESSON_EXIT_CODE * bool(faults))


def _format_table(lessons: LessonList, progress: Sequence[LessonProgress], source: str) -> str:
    """Return the lessons with the progress in each as a table, and the next one."""
    rows = [["", "lesson", "part", "steps", "minutes"]]
    for lesson, results in zip(lessons, progress, strict=True):
        steps = f"{results.finished_count}/{len(lesson.step_keys)}"
        mark = "done" if results.is_finished else ""
        row = [str(lesson.number), lesson.title, lesson.chapter, steps, str(lesson.minutes), mark]
        rows.append(row)
    rows[0].append("")
    return "\n".join([*align_columns(rows), _describe_next_lesson(lessons, progress, source)])


def _describe_next_lesson(
    lessons: LessonList, progress: Sequence[LessonProgress], source: str
) -> str:
    """Return the number of finished lessons, and the command that opens the next one."""
    text, next_lesson = format_finished_count(progress), find_next_lesson(lessons, progress)
    if next_lesson is None:
        return f"{text}."
    words = " ".join(filter(None, ("dmplay learn", source, str(next_lesson.number))))
    return f"{text}. next: {words} ({next_lesson.title})"


def _build_progress(lessons: LessonList, progress: Sequence[LessonProgress]) -> dict[str, object]:
    """Return the progress as data, for a course page."""
    rows = []
    for lesson, results in zip(lessons, progress, strict=True):
        finished = [step for step in results.steps if step]
        rows.append(
            {
                "number": lesson.number,
                "name": lesson.name,
                "title": lesson.title,
                "done": results.is_finished,
                "answers_shown": sum(step.result == REVEALED for step in finished),
                "date": results.date,
                "steps": [step and step._asdict() for step in results.steps],
            }
        )
    next_lesson = find_next_lesson(lessons, progress)
    return {"lessons": rows, "next": next_lesson and next_lesson.number}
