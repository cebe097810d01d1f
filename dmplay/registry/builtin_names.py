"""The names of the built-in problems, listed without importing any of them."""

from functools import cache
from pathlib import Path

NUMBER_PREFIX = "game_"  # of a folder, as a package's name cannot begin with a digit


@cache
def problem_names() -> tuple[str, ...]:
    """Return the name of every built-in problem, those of the book first; folders are read once."""
    keys = []
    for file in (Path(__file__).parent.parent / "problems").glob("*/rules.py"):
        is_of_book = "Source: appendix F" in file.read_text(encoding="utf-8")
        keys.append((not is_of_book, stem_to_name(file.parent.name)))
    return tuple(name for _, name in sorted(keys))


def stem_to_name(stem: str) -> str:
    """Return the command-line name of a problem's folder."""
    is_number = stem.startswith(NUMBER_PREFIX) and stem[len(NUMBER_PREFIX) :].isdecimal()
    return stem.removeprefix(NUMBER_PREFIX) if is_number else stem.replace("_", "-")


def name_to_stem(name: str) -> str:
    """Return the folder's name for a problem's command-line name."""
    return f"{NUMBER_PREFIX}{name}" if name.isdecimal() else name.replace("-", "_")
