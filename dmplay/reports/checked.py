"""What `dmplay check` prints."""

from collections.abc import Mapping
from json import dumps

from dmplay.conformance import check
from dmplay.describe import format_count
from dmplay.finding import problems
from dmplay.game.errand import Printout

VIOLATION_EXIT_CODE = 2


def report_violations(name: str, parameters: Mapping[str, object], *, json: bool) -> Printout:
    """A line for each fault of a problem, or one that says there is none."""
    loaded = problems.find_problem(name, parameters)
    faults = check(loaded.problem)
    code = VIOLATION_EXIT_CODE if faults else 0
    if json:
        told = {"problem": loaded.name, "faults": [one._asdict() for one in faults]}
        return Printout(dumps(told), exit_code=code)
    if not faults:
        return Printout(f"ok {loaded.name}: every law is kept")
    rows = [
        *(one.format_with_name(name) for one in faults),
        f"{loaded.name}: {format_count(len(faults), 'fault')}",
    ]
    return Printout("\n".join(rows), exit_code=code)
