"""The report of `dmplay check`."""

from collections.abc import Mapping

from dmplay.core.text import format_count, format_json_report
from dmplay.game.command_line_results import Printout
from dmplay.registry import problems
from dmplay.validation.conformance import check

VIOLATION_EXIT_CODE = 2


def report_violations(name: str, parameters: Mapping[str, object], *, json: bool) -> Printout:
    """Check a problem against all invariants; return a report with one line per violation.

    If there are none, the report is one line that says so. The exit code is VIOLATION_EXIT_CODE if
    there is a violation, else 0.
    """
    loaded = problems.find_problem(name, parameters)
    violations = check(loaded.problem)
    exit_code = VIOLATION_EXIT_CODE if violations else 0
    if json:
        data = {"problem": loaded.name, "faults": [violation._asdict() for violation in violations]}
        return Printout(format_json_report(data), exit_code=exit_code)
    if not violations:
        return Printout(f"ok {loaded.name}: all invariants hold")
    lines = [
        *(violation.format_with_name(name) for violation in violations),
        f"{loaded.name}: {format_count(len(violations), 'violation')}",
    ]
    return Printout("\n".join(lines), exit_code=exit_code)
