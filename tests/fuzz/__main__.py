"""What nobody means, said to dmplay: `python -m tests.fuzz [--cases N] [--seed S] [--kind K]`.

Mutated transcripts, typed lines and keys, parameters, settings and problems that are wrong: each
case must end in what the program says of it, soon, in little memory, in characters that print; and
a changed fact must not verify. `--case KIND:NUMBER` shows one again.
"""

import argparse
import gc
import importlib
import pkgutil
import sys
import time
from collections import Counter, defaultdict

import dmplay
from tests.fuzz import facts
from tests.fuzz.crew import results, shared
from tests.fuzz.kinds import KINDS, Kind, case, count
from tests.fuzz.trial import Result, tried

NAMED = {kind.name: kind for kind in KINDS}
AXELROD = "dmplay.policies._axelrod"  # loads for long, and is fuzzed by those who wrote it


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--cases", type=int, default=20_000, help="of all kinds, or of one")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=NAMED, help="only cases of this kind")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--case", metavar="KIND:NUMBER", help="one case, and all about it")
    wanted = parser.parse_args()
    _warm_up()
    if wanted.case:
        name, _, number = wanted.case.partition(":")
        return _show(NAMED[name], wanted.seed, int(number))
    kinds = {NAMED[wanted.kind]: wanted.cases} if wanted.kind else _by_share(wanted.cases)
    return _run(kinds, wanted.seed, wanted.workers)


def _by_share(cases: int) -> dict[Kind, int]:
    return {kind: count(kind, cases) for kind in KINDS}


def _warm_up() -> None:
    """Loads once what every worker needs, so that no case waits for it."""
    for module in pkgutil.walk_packages(dmplay.__path__, "dmplay."):
        if module.name not in (AXELROD, "dmplay.__main__"):
            importlib.import_module(module.name)
    facts.honest()
    sys.dont_write_bytecode = True  # no case leaves what Python makes of its own code
    gc.freeze()  # all of it stays: no worker looks through it for what may go


def _run(kinds: dict[Kind, int], seed: int, workers: int) -> int:
    tasks = [task for kind, many in kinds.items() for task in shared(kind, seed, many)]
    begun, endings, found = time.monotonic(), Counter[tuple[str, str]](), list[Result]()
    for result in results(tasks, workers):
        endings[result.kind, result.ending] += 1
        found += [result] if result.faults else []
    seconds = time.monotonic() - begun
    for kind in kinds:
        told = {end: n for (name, end), n in sorted(endings.items()) if name == kind.name}
        each = ", ".join(f"{ending} {many}" for ending, many in told.items())
        print(f"{kind.name:<9} {sum(told.values()):>8}  {each}")
    _tell(found)
    total = endings.total()
    print(f"{total} cases, seed {seed}, {total / seconds:.0f} a second; {len(found)} with a fault")
    return 1 if found else 0


def _tell(found: list[Result]) -> None:
    """Each fault once, with the cases in which it was seen."""
    alike = defaultdict[tuple[str, str], list[str]](list)
    for result in sorted(found):
        for fault in result.faults:
            alike[fault.kind, fault.what].append(f"{result.kind}:{result.number}")
    for (kind, what), where in alike.items():
        print(f"FAULT {kind}: {what}\n      {len(where)} times: {' '.join(where[:5])}")


def _show(kind: Kind, seed: int, number: int) -> int:
    """A case and what came of it."""
    drawn = case(kind, seed, number)
    print(f"words {drawn.words}\ntyped {drawn.typed!r}\nkeys {drawn.keys}, {drawn.size}")
    print(f"terminal {drawn.terminal}, variables {drawn.variables}, changed {drawn.changed!r}")
    for name, content in drawn.files.items():
        print(f"--- {name}\n{content.decode(errors='backslashreplace')}\n---")
    result = tried(kind, seed, number)
    print(result.ending)
    for fault in result.faults:
        print(f"FAULT {fault.kind}: {fault.what}\n{fault.rest}")
    return 1 if result.faults else 0


if __name__ == "__main__":
    sys.exit(main())
