"""Problems written as files that other programs read."""

from collections.abc import Mapping
from pathlib import Path

from dmplay.describe import one_line
from dmplay.disk import write
from dmplay.errors import BadParameter, TooMuch
from dmplay.files.writing import SUFFIXES, written
from dmplay.finding import problems


def converted(name: str, wanted: Mapping[str, object], path: Path, *, force: bool) -> str:
    """Writes a problem as a file of the kind that its name ends in; tells what was written."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise BadParameter(f"-o: got {path}, expected a name in {', '.join(SUFFIXES)}")
    loaded = problems.resolve(name, wanted)
    try:
        lines = [*written(loaded.problem, suffix, problems.docs(loaded.problem))]
    except (BadParameter, TooMuch) as error:
        raise BadParameter(f"{loaded.name}: {error}") from None
    write(path, lines, force=force)
    kind = loaded.problem.kind
    return one_line(f"{path}: {loaded.name}, {'an' if kind == 'MDP' else 'a'} {kind}")
