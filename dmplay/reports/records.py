"""Your best and your last games, as a table or as data."""

from json import dumps

from dmplay.describe import align_columns
from dmplay.records import ProblemRecord, load_records

HEADINGS = ("problem", "seat", "best", "turns", "seed", "day", "last")


def report_records(*, json: bool) -> str:
    """A row for each problem, variant and set of parameters."""
    known = load_records()
    if json:
        return dumps([one.to_json() for one in known])
    if not known:
        return "no game was played to its end"
    return "\n".join(align_columns([HEADINGS, *map(_record_row, known)]))


def _record_row(record: ProblemRecord) -> tuple[str, ...]:
    best = record.best
    told = (f"{best.discounted_return:.6g}", *map(str, best[1:])) if best else ("-",) * 4
    return (_problem_label(record), record.seat, *told, f"{record.last.discounted_return:.6g}")


def _problem_label(record: ProblemRecord) -> str:
    """The problem, and what of it is not as usual."""
    changed = [f"{name}={dumps(value)}" for name, value in record.parameters.items()]
    limit = [] if record.turns is None else [f"--turns {record.turns}"]
    return " ".join([record.problem, *changed, *limit])
