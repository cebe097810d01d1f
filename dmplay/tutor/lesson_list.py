"""The built-in lessons, and those in a teacher's folder."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from dmplay.core.toml_files import read_toml
from dmplay.errors import BadParameter, UnknownName
from dmplay.tutor.lesson import TutorLesson, name_of_file
from dmplay.tutor.progress import make_step_keys

BUILTIN_FOLDER = Path(__file__).parent / "lessons"
LESSON_SUFFIX = ".toml"
SETTINGS_FILE = "dmplay.toml"  # may be in a folder of lessons, and is none


class LessonOutline(NamedTuple):
    """The number, title and steps of a built-in lesson, which are quick to read."""

    number: int
    title: str
    step_keys: tuple[str, ...]
    old_key: str


def list_builtin_paths() -> list[Path]:
    """Return the files of the built-in lessons, by number."""
    return sorted(BUILTIN_FOLDER.glob(f"*{LESSON_SUFFIX}"))


def list_builtin_outlines() -> list[LessonOutline]:
    """Return the outlines of the built-in lessons, by number, without their quantities."""
    outlines = []
    for path in list_builtin_paths():
        table = read_toml(path)
        facts = str(table["title"]), make_step_keys(table, path.parent), name_of_file(path)
        outlines.append(LessonOutline(_number_of(path, 0), *facts))
    return outlines


def load_builtin_lessons() -> list[TutorLesson]:
    """Return the built-in lessons, by number."""
    from dmplay.tutor.lesson_reader import read_lesson  # imports the solvers

    return [
        read_lesson(path, _number_of(path, 0), is_builtin=True) for path in list_builtin_paths()
    ]


def load_folder(folder: Path) -> list[TutorLesson]:
    """Return the lessons in a folder, in the order of their file names.

    A number at the beginning of a file name is the number of the lesson.
    """
    from dmplay.tutor.lesson_reader import read_lesson  # imports the solvers

    paths = sorted({*folder.glob(f"*{LESSON_SUFFIX}")} - {folder / SETTINGS_FILE})
    if not paths:
        raise BadParameter(f"{folder}: expected lessons, files that end with {LESSON_SUFFIX}")
    return [read_lesson(path, _number_of(path, order)) for order, path in enumerate(paths, 1)]


def load_lessons(source: str) -> list[TutorLesson]:
    """Return the lessons of a source: '' for the built-in ones, else a folder or a file."""
    from dmplay.tutor.lesson_reader import read_lesson  # imports the solvers

    if not source:
        return load_builtin_lessons()
    path = Path(source)
    return [read_lesson(path, _number_of(path, 1))] if path.is_file() else load_folder(path)


def find_lesson(lessons: Sequence[TutorLesson], word: str) -> TutorLesson:
    """Return the lesson with this number or name; raise UnknownName if there is none."""
    for lesson in lessons:
        if word in {str(lesson.number), lesson.name, lesson.path.stem}:
            return lesson
    names = [str(lesson.number) if word.isdecimal() else lesson.name for lesson in lessons]
    raise UnknownName("lesson", word, names)


def _number_of(path: Path, default: int) -> int:
    """Return the number at the beginning of a file name, or the default if there is none."""
    digits = path.stem[: len(path.stem) - len(path.stem.lstrip("0123456789"))]
    return int(digits) if digits else default
