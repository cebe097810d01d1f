"""The report of the player's best and last games, as a table or JSON."""

from json import dumps

from dmplay.core.text import align_columns, format_json_report, format_reward
from dmplay.game.player_records import ProblemRecord, load_records

HEADINGS = ("problem", "seat", "record", "turns", "seed", "day", "last", "best medal", "remark")


def report_records(*, json: bool) -> str:
    """Return a row for each problem, variant and set of parameters, as a table or JSON."""
    records = load_records()
    if json:
        return format_json_report({"records": [record.to_json() for record in records]})
    if not records:
        return "no finished games"
    return "\n".join(align_columns([HEADINGS, *map(_record_row, records)]))


def _record_row(record: ProblemRecord) -> tuple[str, ...]:
    """Return the table row of a record, with dashes if no game counts for it."""
    best = record.best
    best_cells = (
        (format_reward(best.discounted_return), *map(str, best[1:])) if best else ("-",) * 4
    )
    changed = [f"{name}={dumps(value)}" for name, value in record.parameters.items()]
    limit = [] if record.turns is None else [f"--turns {record.turns}"]
    return (
        " ".join([record.problem, *changed, *limit]),
        record.seat,
        *best_cells,
        format_reward(record.last.discounted_return),
        record.medal or "-",
        record.aids and f"last: no record, because of {record.aids}",
    )
