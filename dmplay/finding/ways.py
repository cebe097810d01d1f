"""What a name of a problem finds, and how names with a path are told from another folder."""

import os
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from dmplay.core import Problem

CODE = ".py"
DATA = (".pomdp", ".mdp", ".dpomdp", ".nfg", ".efg")
HERE = Path()


class Found(NamedTuple):
    """A problem, the name that finds it again, and what it came from."""

    name: str
    problem: Problem
    origin: str = ""  # by which another is told: a file's hash, a library's version


class Way(NamedTuple):
    """One way to find a problem: which names it takes, what it finds, and in which module."""

    takes: Callable[[str], bool]
    find: Callable[[str], Found]
    module: Callable[[str], ModuleType] | None = None  # None where there is no code
    safe: bool = False  # whether it runs no code but dmplay's, so that a transcript may name it


def is_file(name: str) -> bool:
    """Whether a name points into a Python file, or is one."""
    return name.partition(":")[0].endswith(CODE)


def is_program(name: str) -> bool:
    """Whether a name of an agent is a program to be run."""
    return name.startswith("bot:")


def is_data(name: str) -> bool:
    """Whether a name is that of a file that is read, and never run."""
    return Path(name).suffix.lower() in DATA


def moved(name: str, before: Path, after: Path) -> str:
    """A name as it is told from one folder, told from another; one without a path stays."""
    place, colon, rest = (name, "", "") if is_data(name) else name.partition(":")
    path = is_data(place) or place.endswith(CODE)
    if not path or is_program(name) or _same(before, after, place):
        return name
    return os.path.relpath(before / place, after) + colon + rest


def beside(path: Path) -> Path:
    """The folder from which a transcript tells of paths: its own, or for a stream this one."""
    return HERE if path.is_relative_to("/dev") else path.parent


def _same(before: Path, after: Path, place: str) -> bool:
    return before.resolve() == after.resolve() and not Path(place).is_absolute()
