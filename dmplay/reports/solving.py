"""Solutions on the terminal: found once, kept, and told."""

import hashlib
import os
from collections.abc import Mapping
from json import dumps, loads
from pathlib import Path

from dmplay import __version__
from dmplay.budget import watched
from dmplay.core import Problem
from dmplay.disk import user_folder
from dmplay.finding import problems
from dmplay.reports.progress import Bar
from dmplay.reports.tables import table
from dmplay.solutions.every import solution
from dmplay.solutions.played import Wish, wished
from dmplay.solutions.solution import Solution


def cached(name: str, parameters: Mapping[str, object], wish: Wish) -> Solution:
    """The solution, kept in the user's cache folder by name, parameters and the code's state.

    That of a problem from elsewhere is found anew: its code may be another by now.
    """
    loaded = problems.resolve(name, parameters)
    if not problems.stem(loaded.problem):
        return _found(loaded.problem, wish)
    asked = wish.episodes, wish.turns, wish.work
    made = [loaded.name, loaded.parameters, *asked, __version__, *_code()]
    key = dumps(made, sort_keys=True, default=str)
    root = user_folder(os.environ, "XDG_CACHE_HOME", ".cache")
    file = root / "solve" / f"{hashlib.sha256(key.encode()).hexdigest()[:16]}.json"
    try:
        return Solution(**loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        pass
    found = _found(loaded.problem, wish)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(dumps(found._asdict()), encoding="utf-8")
    except OSError:
        pass  # a solution that is not kept is found again
    return found


def _found(problem: Problem, wish: Wish) -> Solution:
    """The solution, in which as much is simulated as was wished; refused where nothing is."""
    with wished(wish):
        found = solution(problem)
    wish.check(found.method)
    return found


def _code() -> list[int]:
    """The times of this package's files: another checkout solves anew."""
    return [file.stat().st_mtime_ns for file in sorted(Path(__file__).parent.parent.rglob("*.py"))]


def solved(
    name: str,
    parameters: Mapping[str, object],
    wish: Wish,
    *,
    json: bool = False,
    motion: bool = True,
) -> str:
    """The solution of a problem; while it is sought, how far that is."""
    with Bar(f"solving {name}", quiet=json, motion=motion) as bar, watched(bar):
        found = cached(name, parameters, wish)
    if json:
        loaded = problems.resolve(name, parameters)
        told = {"problem": loaded.name, "parameters": loaded.parameters}
        return dumps(told | found._asdict())
    title = " ".join([name, *(f"{key}={one}" for key, one in parameters.items())])
    return "\n".join([f"{title}: {found.method}", found.result, "", table(found.rows, 6)])
