"""Solutions on the terminal: found once, kept, and told."""

import hashlib
import os
from collections.abc import Mapping
from json import dumps, loads
from pathlib import Path

from dmplay import __version__
from dmplay.budget import report_progress_to
from dmplay.core import Problem
from dmplay.disk import user_folder
from dmplay.finding import problems
from dmplay.reports.progress import ProgressBar
from dmplay.reports.tables import format_table
from dmplay.solutions.every import solve_problem
from dmplay.solutions.played import SimulationOptions, use_simulation_options
from dmplay.solutions.solution import Solution


def load_or_solve(
    name: str, parameters: Mapping[str, object], simulation_options: SimulationOptions
) -> Solution:
    """The solution, kept in the user's cache folder by name, parameters and the code's state.

    That of a problem from elsewhere is found anew: its code may be another by now.
    """
    loaded = problems.resolve_problem(name, parameters)
    if not problems.builtin_stem(loaded.problem):
        return _solve(loaded.problem, simulation_options)
    asked = simulation_options.episodes, simulation_options.turns, simulation_options.work
    made = [loaded.name, loaded.parameters, *asked, __version__, *_source_times()]
    key = dumps(made, sort_keys=True, default=str)
    root = user_folder(os.environ, "XDG_CACHE_HOME", ".cache")
    file = root / "solve" / f"{hashlib.sha256(key.encode()).hexdigest()[:16]}.json"
    try:
        return Solution(**loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        pass
    found = _solve(loaded.problem, simulation_options)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(dumps(found._asdict()), encoding="utf-8")
    except OSError:
        pass  # a solution that is not kept is found again
    return found


def _solve(problem: Problem, simulation_options: SimulationOptions) -> Solution:
    """The solution, in which as much is simulated as was wished; refused where nothing is."""
    with use_simulation_options(simulation_options):
        found = solve_problem(problem)
    simulation_options.check_options_used(found.method)
    return found


def _source_times() -> list[int]:
    """The times of this package's files: another checkout solves anew."""
    return [file.stat().st_mtime_ns for file in sorted(Path(__file__).parent.parent.rglob("*.py"))]


def report_solution(
    name: str,
    parameters: Mapping[str, object],
    simulation_options: SimulationOptions,
    *,
    json: bool = False,
    motion: bool = True,
) -> str:
    """The solution of a problem; while it is sought, how far that is."""
    with ProgressBar(f"solving {name}", quiet=json, motion=motion) as bar, report_progress_to(bar):
        found = load_or_solve(name, parameters, simulation_options)
    if json:
        loaded = problems.resolve_problem(name, parameters)
        told = {"problem": loaded.name, "parameters": loaded.parameters}
        return dumps(told | found._asdict())
    title = " ".join([name, *(f"{key}={one}" for key, one in parameters.items())])
    return "\n".join([f"{title}: {found.method}", found.result, "", format_table(found.rows, 6)])
