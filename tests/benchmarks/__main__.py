"""How fast it is: `python -m tests.benchmarks [start] [keys] [batch] [--runs N]`.

Every number is a median of runs that take turns with one another, so that a busy moment of the
machine hits all of them alike. Nothing here passes or fails.
"""

import argparse
import compileall
from pathlib import Path

import dmplay
from tests.benchmarks import batch, keys, start

PARTS = {"start": start.report, "keys": keys.report, "batch": batch.report}
RUNS = {"start": 15, "keys": 60, "batch": 7}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("part", nargs="*", help=f"{', '.join(PARTS)}; all if not given")
    parser.add_argument("--runs", type=int, help=f"runs, or keys, of each kind; now {RUNS}")
    wanted = parser.parse_args()
    unknown = set(wanted.part) - set(PARTS)
    if unknown:
        parser.error(f"unknown part {unknown.pop()}, expected {', '.join(PARTS)}")
    compileall.compile_dir(str(Path(dmplay.__file__).parent), quiet=2)
    for name, report in PARTS.items():
        if name in (wanted.part or PARTS):
            report(wanted.runs or RUNS[name])


if __name__ == "__main__":
    main()
