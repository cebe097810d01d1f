"""What a name of a problem finds, and how names with a path are told from another folder."""

import os
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from dmplay.core import Problem

PYTHON_SUFFIX = ".py"
DATA_SUFFIXES = (".pomdp", ".mdp", ".dpomdp", ".nfg", ".efg")
CURRENT_FOLDER = Path()


class LookupResult(NamedTuple):
    """A problem, the name that finds it again, and what it came from."""

    name: str
    problem: Problem
    origin: str = ""  # by which another is told: a file's hash, a library's version


class ProblemSource(NamedTuple):
    """One way to find a problem: which names it takes, what it finds, and in which module."""

    accepts: Callable[[str], bool]
    load: Callable[[str], LookupResult]
    load_module: Callable[[str], ModuleType] | None = None  # None where there is no code
    safe: bool = False  # whether it runs no code but dmplay's, so that a transcript may name it


def names_python_file(name: str) -> bool:
    """Whether a name points into a Python file, or is one."""
    return name.partition(":")[0].endswith(PYTHON_SUFFIX)


def names_bot(name: str) -> bool:
    """Whether a name of an agent is a program to be run."""
    return name.startswith("bot:")


def names_data_file(name: str) -> bool:
    """Whether a name is that of a file that is read, and never run."""
    return Path(name).suffix.lower() in DATA_SUFFIXES


def rebase_name(name: str, old_folder: Path, new_folder: Path) -> str:
    """A name as it is told from one folder, told from another; one without a path stays."""
    place, colon, rest = (name, "", "") if names_data_file(name) else name.partition(":")
    path = names_data_file(place) or place.endswith(PYTHON_SUFFIX)
    if not path or names_bot(name) or _is_same_folder(old_folder, new_folder, place):
        return name
    return os.path.relpath(old_folder / place, new_folder) + colon + rest


def transcript_folder(path: Path) -> Path:
    """The folder from which a transcript tells of paths: its own, or for a stream this one."""
    return CURRENT_FOLDER if path.is_relative_to("/dev") else path.parent


def _is_same_folder(old_folder: Path, new_folder: Path, path: str) -> bool:
    return old_folder.resolve() == new_folder.resolve() and not Path(path).is_absolute()
