"""Fuzz the command line: `python -m tests.fuzz [--cases N] [--seed S] [--kind K]`.

The cases are mutated transcripts, typed lines and keys, and faulty parameters, settings, problems
and game trees. Each case must end with a message of the program, soon, in little memory and in
printable characters; a changed fact must not verify. `--case KIND:NUMBER` shows one case again.
"""

import argparse
import gc
import importlib
import pkgutil
import sys
import time
from collections import Counter, defaultdict

import dmplay
from tests.fuzz import changed_facts
from tests.fuzz.case_kinds import KINDS, Kind, count_cases, draw_case
from tests.fuzz.case_runner import Result, run_case
from tests.fuzz.worker_pool import run_tasks, split_into_tasks

KINDS_BY_NAME = {kind.name: kind for kind in KINDS}
AXELROD_MODULE = "dmplay.agents.axelrod_strategy"  # slow to import, and fuzzed by its authors


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--cases", type=int, default=20_000, help="of all kinds, or of one")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=KINDS_BY_NAME, help="only cases of this kind")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--case", metavar="KIND:NUMBER", help="one case, and all about it")
    options = parser.parse_args()
    _import_package()
    if options.case:
        name, _, number = options.case.partition(":")
        return _show_case(KINDS_BY_NAME[name], options.seed, int(number))
    kinds = (
        {KINDS_BY_NAME[options.kind]: options.cases}
        if options.kind
        else _cases_by_kind(options.cases)
    )
    return _run_cases(kinds, options.seed, options.workers)


def _cases_by_kind(cases: int) -> dict[Kind, int]:
    return {kind: count_cases(kind, cases) for kind in KINDS}


def _import_package() -> None:
    """Import once the modules that every worker needs, so that no case waits for them."""
    for module in pkgutil.walk_packages(dmplay.__path__, "dmplay."):
        if module.name not in (AXELROD_MODULE, "dmplay.__main__"):
            importlib.import_module(module.name)
    importlib.import_module("pyspiel")  # reads game trees
    changed_facts.list_valid_transcripts()
    sys.dont_write_bytecode = True  # cases write no bytecode files
    gc.freeze()  # garbage collections in workers skip the imported modules


def _run_cases(kinds: dict[Kind, int], seed: int, workers: int) -> int:
    tasks = [
        task
        for kind, case_count in kinds.items()
        for task in split_into_tasks(kind, seed, case_count)
    ]
    start_time = time.monotonic()
    endings = Counter[tuple[str, str]]()
    faulty_results = list[Result]()
    for result in run_tasks(tasks, workers):
        endings[result.kind, result.ending] += 1
        faulty_results += [result] if result.faults else []
    seconds = time.monotonic() - start_time
    for kind in kinds:
        ending_counts = {end: n for (name, end), n in sorted(endings.items()) if name == kind.name}
        summary = ", ".join(
            f"{ending} {case_count}" for ending, case_count in ending_counts.items()
        )
        print(f"{kind.name:<9} {sum(ending_counts.values()):>8}  {summary}")
    _print_faults(faulty_results)
    total = endings.total()
    print(
        f"{total} cases, seed {seed}, {total / seconds:.0f} "
        f"a second; {len(faulty_results)} with a fault"
    )
    return 1 if faulty_results else 0


def _print_faults(faulty_results: list[Result]) -> None:
    """Print each fault once, with the cases in which it occurred."""
    cases_by_fault = defaultdict[tuple[str, str], list[str]](list)
    for result in sorted(faulty_results):
        for fault in result.faults:
            cases_by_fault[fault.kind, fault.what].append(f"{result.kind}:{result.number}")
    for (kind, message), cases in cases_by_fault.items():
        print(f"FAULT {kind}: {message}\n      {len(cases)} times: {' '.join(cases[:5])}")


def _show_case(kind: Kind, seed: int, number: int) -> int:
    """Run one case, print it and its result, and return the exit code."""
    fuzz_case = draw_case(kind, seed, number)
    print(
        f"words {fuzz_case.words}\ntyped {fuzz_case.typed!r}\nkeys "
        f"{fuzz_case.keys}, {fuzz_case.size}\npieces {fuzz_case.pieces}"
    )
    print(
        f"terminal {fuzz_case.terminal}, variables "
        f"{fuzz_case.variables}, changed {fuzz_case.changed!r}"
    )
    for name, content in fuzz_case.files.items():
        print(f"--- {name}\n{content.decode(errors='backslashreplace')}\n---")
    result = run_case(kind, seed, number)
    print(result.ending)
    for fault in result.faults:
        print(f"FAULT {fault.kind}: {fault.what}\n{fault.details}")
    return 1 if result.faults else 0


if __name__ == "__main__":
    sys.exit(main())
