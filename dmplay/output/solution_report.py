"""Reports of solutions, which are computed once and cached."""

import hashlib
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from json import dumps, loads
from pathlib import Path
from typing import Any

from dmplay import __version__
from dmplay.core.safe_files import read_bytes, user_folder, write_bytes
from dmplay.core.text import format_json_report
from dmplay.core.work_budget import report_progress_to
from dmplay.errors import DmplayError
from dmplay.evaluation.solutions.options import SolveOptions
from dmplay.evaluation.solutions.solution import Solution
from dmplay.evaluation.solutions.solve import solve_with_options
from dmplay.evaluation.sweep import Setting, sweep
from dmplay.output.tables import format_table
from dmplay.registry import problems
from dmplay.terminal.progress import ProgressBar


def load_or_solve(
    name: str, parameters: Mapping[str, object], solve_options: SolveOptions
) -> dict[str, Any]:
    """Return the solution of a problem as data, from the user's cache folder if it is there.

    Its key is made of name, parameters, options and the version and file times of the
    code. Solutions of user-defined problems are not cached, because their code may change.
    """
    loaded = problems.resolve_problem(name, parameters)
    if not problems.is_built_in(loaded.problem):
        return _make_solution_data(solve_with_options(loaded.problem, solve_options))
    option_values = solve_options.episodes, solve_options.turns, solve_options.work
    # Changed code solves again.
    package_files = sorted(Path(__file__).parent.parent.rglob("*.py"))
    source_times = [file.stat().st_mtime_ns for file in package_files]
    key_parts = [
        loaded.name, loaded.parameters, *option_values, solve_options.method, __version__,
        *source_times,
    ]  # fmt: skip
    key = dumps(key_parts, sort_keys=True, default=str)
    root = user_folder(os.environ, "XDG_CACHE_HOME", ".cache")
    file = root / "solve" / f"{hashlib.sha256(key.encode()).hexdigest()[:16]}.json"
    with suppress(OSError):  # a file that is torn or changed is computed again
        checksum, _, text = read_bytes(file).partition(b"\n")
        if checksum == _compute_checksum(text):
            data: dict[str, Any] = loads(text)
            return data
    data = _make_solution_data(solve_with_options(loaded.problem, solve_options))
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        text = dumps(data).encode()
        write_bytes(file, [_compute_checksum(text), b"\n", text], continues=True)
    except (DmplayError, OSError):
        pass  # a solution that cannot be saved is computed again
    return data


def _make_solution_data(solution: Solution) -> dict[str, Any]:
    """Return the text of a solution, and its numbers that the text does not have.

    `values` and `bounds` are those at the start. `cells` are the strategies, plans and best actions
    of each row of the table.
    """
    data: dict[str, Any] = {
        "method": solution.method,
        "result": solution.result,
        "rows": solution.rows,
    }
    data |= solution.accuracy.data
    agents = solution.problem.agents if solution.problem else ()
    with suppress(DmplayError):
        data["values"] = {agent: solution.value(seat=agent) for agent in agents}
    if solution.start_bounds:
        data["bounds"] = solution.start_bounds
    cells = [
        {name: cell for name, cell in row.items() if isinstance(cell, tuple | dict)}
        for row in solution.table
    ]
    return data | ({"cells": cells} if any(cells) else {})


def _compute_checksum(data: bytes) -> bytes:
    """Return the checksum of a cached solution, in hexadecimal digits."""
    return hashlib.sha256(data).hexdigest().encode()


def report_solution(
    name: str,
    parameters: Mapping[str, object],
    solve_options: SolveOptions,
    *,
    json: bool = False,
    motion: bool = True,
) -> str:
    """Return the solution of a problem as text or JSON; show progress while it is computed.

    If a parameter has several values, return a table of the solutions instead.
    """
    settings = sweep(name, "", **parameters)
    if len(settings) > 1:
        return _report_sweep(name, settings, solve_options, json=json, motion=motion)
    with ProgressBar(f"solving {name}", quiet=json, motion=motion) as bar, report_progress_to(bar):
        data = load_or_solve(name, parameters, solve_options)
    if json:
        loaded = problems.resolve_problem(name, parameters)
        header = {"problem": loaded.name, "parameters": loaded.parameters}
        return format_json_report(header | data)
    title = " ".join([name, *(f"{key}={value}" for key, value in parameters.items())])
    return "\n".join(
        [f"{title}: {data['method']}", data["result"], "", format_table(data["rows"], 6)]
    )


def _report_sweep(
    name: str, settings: Sequence[Setting], solve_options: SolveOptions, *, json: bool, motion: bool
) -> str:
    """Return the method, the values and the result of each setting, as JSON or as a table."""
    solved = []
    with ProgressBar(f"solving {name}", quiet=json, motion=motion) as bar:
        for index, setting in enumerate(settings):
            with report_progress_to(bar.subtask(index, len(settings))):
                data = load_or_solve(name, setting.parameters, solve_options)
            solved.append((setting, data))
    if json:
        facts = [{"parameters": setting.parameters} | data for setting, data in solved]
        return format_json_report({"problem": name, "settings": facts})
    rows = [
        {
            **setting.parameters,
            "method": data["method"],
            **{f"value of {seat}": value for seat, value in data.get("values", {}).items()},
            "accuracy": data.get("accuracy", ""),
            "result": data["result"],
        }
        for setting, data in solved
    ]
    return "\n".join([f"{name}: {len(settings)} settings", "", format_table(rows, 6)])
