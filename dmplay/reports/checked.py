"""What `dmplay check` prints."""

from collections.abc import Mapping
from json import dumps

from dmplay.conformance import check
from dmplay.describe import counted
from dmplay.finding import problems
from dmplay.game.errand import Printout

FAULT_CODE = 2


def report(name: str, given: Mapping[str, object], *, json: bool) -> Printout:
    """A line for each fault of a problem, or one that says there is none."""
    loaded = problems.found(name, given)
    faults = check(loaded.problem)
    code = FAULT_CODE if faults else 0
    if json:
        told = {"problem": loaded.name, "faults": [one._asdict() for one in faults]}
        return Printout(dumps(told), code=code)
    if not faults:
        return Printout(f"ok {loaded.name}: every law is kept")
    rows = [*(one.of(name) for one in faults), f"{loaded.name}: {counted(len(faults), 'fault')}"]
    return Printout("\n".join(rows), code=code)
