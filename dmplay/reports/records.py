"""Your best and your last games, as a table or as data."""

from json import dumps

from dmplay.describe import aligned
from dmplay.records import Record, all_records

HEADINGS = ("problem", "seat", "best", "turns", "seed", "day", "last")


def listing(*, json: bool) -> str:
    """A row for each problem, variant and set of parameters."""
    known = all_records()
    if json:
        return dumps([one.told() for one in known])
    if not known:
        return "no game was played to its end"
    return "\n".join(aligned([HEADINGS, *map(_row, known)]))


def _row(record: Record) -> tuple[str, ...]:
    best = record.best
    told = (f"{best.returned:.6g}", *map(str, best[1:])) if best else ("-",) * 4
    return (_kind(record), record.seat, *told, f"{record.last.returned:.6g}")


def _kind(record: Record) -> str:
    """The problem, and what of it is not as usual."""
    changed = [f"{name}={dumps(value)}" for name, value in record.parameters.items()]
    limit = [] if record.turns is None else [f"--turns {record.turns}"]
    return " ".join([record.problem, *changed, *limit])
