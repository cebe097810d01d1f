"""The names of the built-in problems, known without importing one."""

from functools import cache
from pathlib import Path

SPECIAL = {"game_2048": "2048"}  # a module's name cannot begin with a digit


@cache
def problem_names() -> tuple[str, ...]:
    """Every built-in problem, by listing the folder once."""
    folder = Path(__file__).parent.parent / "problems"
    stems = (file.stem for file in folder.glob("*.py") if not file.stem.startswith("_"))
    return tuple(sorted(name_of(stem) for stem in stems))


def name_of(stem: str) -> str:
    """The command-line name of a module."""
    return SPECIAL.get(stem, stem.replace("_", "-"))


def stem_of(name: str) -> str:
    """The module of a command-line name."""
    special = {name: stem for stem, name in SPECIAL.items()}
    return special.get(name, name.replace("-", "_"))
