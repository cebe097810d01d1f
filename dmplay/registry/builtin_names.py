"""The names of the built-in problems, listed without importing any of them."""

from functools import cache
from pathlib import Path

NAME_BY_STEM = {"game_2048": "2048"}  # a module's name cannot begin with a digit


@cache
def problem_names() -> tuple[str, ...]:
    """Return the name of every built-in problem; the folder is listed once."""
    folder = Path(__file__).parent.parent / "problems"
    stems = (file.stem for file in folder.glob("*.py") if not file.stem.startswith("_"))
    return tuple(sorted(stem_to_name(stem) for stem in stems))


def stem_to_name(stem: str) -> str:
    """Return the command-line name of a problem's module."""
    return NAME_BY_STEM.get(stem, stem.replace("_", "-"))


def name_to_stem(name: str) -> str:
    """Return the module's name for a problem's command-line name."""
    special = {name: stem for stem, name in NAME_BY_STEM.items()}
    return special.get(name, name.replace("-", "_"))
