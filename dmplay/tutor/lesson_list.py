"""The built-in lessons, and those in a teacher's folder."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from dmplay.core.toml_files import read_toml
from dmplay.errors import BadParameter, DmplayError, UnknownName
from dmplay.tutor.lesson import TutorLesson, extract_lesson_name
from dmplay.tutor.progress import load_progress, make_step_keys

BUILTIN_FOLDER = Path(__file__).parent / "lessons"
LESSON_SUFFIX = ".toml"
FIRST_GAME_PATH = BUILTIN_FOLDER / f"first{LESSON_SUFFIX}"
SETTINGS_FILE = "dmplay.toml"  # may be in a folder of lessons, and is none


class LessonOutline(NamedTuple):
    """The facts of a built-in lesson for a list of lessons, which are quick to read."""

    number: int
    title: str
    chapter: str  # the part of the book
    minutes: int
    step_keys: tuple[str, ...]
    name: str
    position: Mapping[str, Any]  # with the keys problem and seed

    @property
    def old_key(self) -> str:
        """The key of the lesson in the files of progress of older versions."""
        return self.name


class LessonSet(NamedTuple):
    """The lessons of a source, and the faults of those that cannot be read."""

    lessons: Sequence[TutorLesson]
    faults: Mapping[Path, DmplayError]


def list_builtin_paths() -> list[Path]:
    """Return the files of the built-in lessons, by number; the first game has none."""
    return sorted(BUILTIN_FOLDER.glob(f"[0-9]*{LESSON_SUFFIX}"))


def list_builtin_words() -> list[str]:
    """Return the words that open a built-in lesson: the first game, then numbers and names."""
    stems = [path.stem.partition("-") for path in list_builtin_paths()]
    pairs = [(number.lstrip("0"), name) for number, _, name in stems]
    return [FIRST_GAME_PATH.stem, *(word for pair in pairs for word in pair)]


def list_builtin_outlines() -> list[LessonOutline]:
    """Return the outlines of the built-in lessons, by number, without their quantities."""
    return [*map(_read_outline, list_builtin_paths())]


def find_unplayed_first_game() -> LessonOutline | None:
    """Return the lesson of a first game, which the screen explains; None once it is finished."""
    lesson = _read_outline(FIRST_GAME_PATH)
    return None if load_progress(lesson).is_finished else lesson


def load_first_game() -> TutorLesson:
    """Return the lesson of a first game, which is none of the numbered lessons."""
    from dmplay.tutor.lesson_file_reader import read_lesson  # imports the solvers

    return read_lesson(FIRST_GAME_PATH, 0, is_builtin=True)


def _read_outline(path: Path) -> LessonOutline:
    """Return the outline of a built-in lesson."""
    table = read_toml(path)
    facts: Any = (table[key] for key in ("title", "chapter", "minutes", "position"))
    step_keys, name = make_step_keys(table, path.parent), extract_lesson_name(path)
    title, chapter, minutes, position = facts
    number = _lesson_number(path, 0)
    return LessonOutline(number, title, chapter, minutes, step_keys, name, position)


def load_builtin_lessons() -> list[TutorLesson]:
    """Return the built-in lessons, by number."""
    from dmplay.tutor.lesson_file_reader import read_lesson  # imports the solvers

    return [
        read_lesson(path, _lesson_number(path, 0), is_builtin=True) for path in list_builtin_paths()
    ]


def load_lessons(source: str, *, trusted: bool = False) -> LessonSet:
    """Return the lessons of a source: '' for the built-in ones, else a folder or a file.

    Those of a folder are in the order of their file names. A number at the beginning of a file name
    is the number of the lesson. Code outside dmplay runs only if it is trusted. Raise an error if
    there is no valid lesson.
    """
    from dmplay.tutor.lesson_file_reader import read_lesson  # imports the solvers

    if not source:
        return LessonSet(load_builtin_lessons(), {})
    folder, lessons = Path(source), list[TutorLesson]()
    paths = sorted({*folder.glob(f"*{LESSON_SUFFIX}")} - {folder / SETTINGS_FILE})
    paths = [folder] if folder.is_file() else paths
    if not paths:
        raise BadParameter(f"{folder}: expected lessons, files that end with {LESSON_SUFFIX}")
    faults: dict[Path, DmplayError] = {}
    for order, path in enumerate(paths, 1):
        try:
            lessons.append(read_lesson(path, _lesson_number(path, order), trusted=trusted))
        except DmplayError as error:
            faults[path] = error
    if not lessons:
        raise next(iter(faults.values()))
    return LessonSet(lessons, faults)


def find_lesson(lesson_set: LessonSet, word: str) -> TutorLesson:
    """Return the lesson with this number or name.

    Raise the fault of its file if it is invalid, and UnknownName if there is no such file, or
    BadParameter if the word is a folder of lessons.
    """
    lessons, faults = lesson_set
    if word == FIRST_GAME_PATH.stem and lessons[0].is_builtin:
        return load_first_game()
    for lesson in lessons:
        if word in {str(lesson.number), lesson.name, lesson.path.stem}:
            return lesson
    for path, error in faults.items():
        if word in {str(_lesson_number(path, 0)), extract_lesson_name(path), path.stem}:
            raise error
    if any(Path(word).glob(f"*{LESSON_SUFFIX}")):
        folder = os.path.join(os.curdir, word)
        raise BadParameter(f"unknown lesson {word!r}; {folder} opens the folder of lessons")
    names = [str(lesson.number) if word.isdecimal() else lesson.name for lesson in lessons]
    names = [FIRST_GAME_PATH.stem, *names] if lessons[0].is_builtin else names
    raise UnknownName("lesson", word, names)


def _lesson_number(path: Path, default: int) -> int:
    """Return the number at the beginning of a file name, or the default if there is none."""
    digits = path.stem[: len(path.stem) - len(path.stem.lstrip("0123456789"))]
    return int(digits) if digits else default
