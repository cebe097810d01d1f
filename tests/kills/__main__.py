"""Kills games at moments by lot, and tells whether a finished turn was ever lost:

`python -m tests.kills [--count N] [--seed S] [--workers N] [--case NAME]`.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from tests.kills.suite import ROW, Result, drawn, named, tried


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.kills", description=__doc__)
    parser.add_argument("--count", type=int, default=50, help="how many kills")
    parser.add_argument("--seed", type=int, default=1, help="of the moments")
    parser.add_argument("--workers", type=int, default=2, help="at once")
    parser.add_argument("--case", help="one alone, by the name it was told with")
    wanted = parser.parse_args()
    if wanted.case:
        results = [tried(named(wanted.case))]
    else:
        with ThreadPoolExecutor(wanted.workers) as pool:
            numbers = range(wanted.count)
            rows = [numbers[first : first + ROW] for first in numbers[::ROW]]
            found = pool.map(lambda row: [tried(drawn(wanted.seed, one)) for one in row], rows)
            results = [result for row in found for result in row]
    for line in report(results):
        print(line)
    return 1 if any(result.faults for result in results) else 0


def report(results: Sequence[Result]) -> list[str]:
    """The faults, and the counts of each act."""
    bad = [f"{one.case}: {fault}" for one in results for fault in one.faults]
    rows = [f"{'':8} {'tried':>6} {'killed':>6}  what was left"]
    for act in dict.fromkeys(one.case.act for one in results):
        rows.append(_row(act, [one for one in results if one.case.act == act]))
    count = {word: sum(f" {word}: " in row for row in bad) for word in ("lost", "unequal")}
    told = ", ".join(f"{number} {word}" for word, number in count.items())
    return [*bad, *rows, f"{_row('all', results)}; {told}"]


def _row(name: str, results: Sequence[Result]) -> str:
    left = Counter(result.left for result in results)
    told = ", ".join(f"{number} {what}" for what, number in sorted(left.items()))
    return f"{name:8} {len(results):6} {sum(one.killed for one in results):6}  {told}"


if __name__ == "__main__":
    sys.exit(main())
