"""The sources of problems, and names with a path that is relative to a folder."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from dmplay.core.problem import Problem

PYTHON_SUFFIX = ".py"
DATA_SUFFIXES = (".pomdp", ".mdp", ".dpomdp", ".nfg", ".efg")
CURRENT_FOLDER = Path()
AGENT_FILE_PREFIXES = ("learned:", "policy:")


class LookupResult(NamedTuple):
    """A problem, the name that loads it again, and its origin."""

    name: str
    problem: Problem
    origin: str = ""  # identifies the source: a file's hash, or a library's version


class ProblemSource(NamedTuple):
    """One source of problems: which names it accepts, how it loads them, and their module."""

    accepts: Callable[[str], bool]
    load: Callable[[str], LookupResult]
    load_module: Callable[[str], ModuleType] | None = None  # None if there is no code
    safe: bool = False  # whether it runs only dmplay's code, so that a transcript may name it


def names_python_file(name: str) -> bool:
    """Return whether a name points into a Python file or a problem's folder, or is one."""
    return name.partition(":")[0].endswith(PYTHON_SUFFIX) or names_folder(name)


def names_folder(name: str) -> bool:
    """Return whether a name points into a problem's folder, which ends with a slash."""
    return name.partition(":")[0].endswith(("/", os.sep))


def names_bot(name: str) -> bool:
    """Return whether an agent's name is a program to run."""
    return name.startswith("bot:")


def names_agent_file(name: str) -> bool:
    """Return whether an agent's name is that of a file with a policy, which is never run."""
    return name.startswith(AGENT_FILE_PREFIXES)


def names_data_file(name: str) -> bool:
    """Return whether a name is that of a data file, which is parsed and never run."""
    return os.path.splitext(name)[1].lower() in DATA_SUFFIXES


def rebase_name(name: str, old_folder: Path, new_folder: Path) -> str:
    """Return a name with its path made relative to `new_folder`, unchanged if it has no path."""
    if names_agent_file(name):
        kind, _, path = name.partition(":")
        is_same = _is_same_folder(old_folder, new_folder, path)
        return name if is_same else f"{kind}:{os.path.relpath(old_folder / path, new_folder)}"
    source, colon, remainder = (name, "", "") if names_data_file(name) else name.partition(":")
    has_path = names_data_file(source) or names_python_file(source)
    if not has_path or names_bot(name) or _is_same_folder(old_folder, new_folder, source):
        return name
    slash = "/" if names_folder(source) else ""
    return os.path.relpath(old_folder / source, new_folder) + slash + colon + remainder


def resolve_recorded_name(
    name: str, folder: Path, *, trusted: bool, assigned_names: Mapping[str, str] | None = None
) -> tuple[str, bool]:
    """Return the name to load for one in a transcript, and whether its code may be imported.

    A path in the recorded name is relative to `folder`, in the returned one to the current folder.
    `assigned_names` are the names of an assignment: as the transcript writes them, and as they are
    loaded. If they are given, `trusted` covers only these, because people who hand in a transcript
    choose the names in it and the files in its folder.
    """
    if assigned_names is not None and name in assigned_names:
        return assigned_names[name], trusted
    return rebase_name(name, folder, CURRENT_FOLDER), trusted and assigned_names is None


def transcript_folder(path: Path) -> Path:
    """Return the folder to which paths in a transcript are relative: its own.

    For a stream under `/dev` it is the current folder.
    """
    return CURRENT_FOLDER if path.is_relative_to("/dev") else path.parent


def _is_same_folder(old_folder: Path, new_folder: Path, path: str) -> bool:
    """Return whether two folders are the same and a path is relative to them."""
    return old_folder.resolve() == new_folder.resolve() and not Path(path).is_absolute()
