"""Conversion of problems to files that other programs read."""

from collections.abc import Mapping
from pathlib import Path

from dmplay.core.safe_files import write_file
from dmplay.core.text import escape_newlines
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.formats.writer import FILE_SUFFIXES, iter_problem_lines
from dmplay.registry import problems


def convert_problem(name: str, parameters: Mapping[str, object], path: Path, *, force: bool) -> str:
    """Write a problem to a file in the format of its suffix; return a line on the file.

    Raise BadParameter if the suffix is unknown or the format cannot hold the problem.
    """
    suffix = path.suffix.lower()
    if suffix not in FILE_SUFFIXES:
        raise BadParameter(
            f"-o: got {path}, expected a name that ends in {', '.join(FILE_SUFFIXES)}"
        )
    loaded = problems.resolve_problem(name, parameters)
    try:
        lines = [
            *iter_problem_lines(loaded.problem, suffix, problems.problem_docstring(loaded.problem))
        ]
    except (BadParameter, BudgetExceeded) as error:
        raise BadParameter(f"{loaded.name}: {error}") from None
    write_file(path, lines, force=force)
    kind = loaded.problem.kind
    return escape_newlines(f"{path}: {loaded.name}, {'an' if kind == 'MDP' else 'a'} {kind}")
