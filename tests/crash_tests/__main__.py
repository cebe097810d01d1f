"""Kill games at random moments, and report whether a finished turn was ever lost:

`python -m tests.crash_tests [--count N] [--seed S] [--workers N] [--case NAME]`.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from tests.crash_tests.cases import KILLS_PER_ROW, Result, parse_case, run_case, sample_case


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.crash_tests", description=__doc__)
    parser.add_argument("--count", type=int, default=50, help="how many kills")
    parser.add_argument("--seed", type=int, default=1, help="of the moments")
    parser.add_argument("--workers", type=int, default=2, help="at once")
    parser.add_argument("--case", help="one alone, by the name it was told with")
    arguments = parser.parse_args()
    if arguments.case:
        results = [run_case(parse_case(arguments.case))]
    else:
        with ThreadPoolExecutor(arguments.workers) as pool:
            numbers = range(arguments.count)
            rows = [numbers[first : first + KILLS_PER_ROW] for first in numbers[::KILLS_PER_ROW]]
            row_results = pool.map(
                lambda row: [run_case(sample_case(arguments.seed, number)) for number in row], rows
            )
            results = [result for row in row_results for result in row]
    for line in format_report(results):
        print(line)
    return 1 if any(result.faults for result in results) else 0


def format_report(results: Sequence[Result]) -> list[str]:
    """Return the faults and the counts of each act, as lines."""
    fault_rows = [f"{result.case}: {fault}" for result in results for fault in result.faults]
    rows = [f"{'':8} {'tried':>6} {'killed':>6}  what was left"]
    for act in dict.fromkeys(result.case.act for result in results):
        rows.append(_format_row(act, [result for result in results if result.case.act == act]))
    count = {kind: sum(f" {kind}: " in row for row in fault_rows) for kind in ("lost", "unequal")}
    summary = ", ".join(f"{number} {kind}" for kind, number in count.items())
    return [*fault_rows, *rows, f"{_format_row('all', results)}; {summary}"]


def _format_row(name: str, results: Sequence[Result]) -> str:
    remains_counts = Counter(result.left for result in results)
    remains_text = ", ".join(
        f"{number} {remains}" for remains, number in sorted(remains_counts.items())
    )
    return (
        f"{name:8} {len(results):6} "
        f"{sum(case_result.killed for case_result in results):6}  {remains_text}"
    )


if __name__ == "__main__":
    sys.exit(main())
