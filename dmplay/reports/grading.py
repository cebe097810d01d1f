"""A table of what people handed in, for people and programs."""

from collections.abc import Sequence
from json import dumps
from pathlib import Path
from textwrap import fill

from dmplay.describe import counted, one_line
from dmplay.game import checking
from dmplay.game.errand import Printout
from dmplay.measure.assignment import read
from dmplay.measure.grading import PROVES, Grade, Graded
from dmplay.measure.grading import graded as grades
from dmplay.reports.progress import Bar
from dmplay.reports.tables import csv_of, table
from dmplay.signals import INTERRUPTED
from dmplay.solutions.solution import Row

WIDE = 80  # columns of a paragraph
LISTS = ("marks", "same", "tries", "unlike")  # of words


def graded(
    paths: Sequence[Path],
    assignment: Path | None = None,
    *,
    trusted: bool = False,
    form: str = "",
    motion: bool = True,
) -> Printout:
    """The grades of these files and folders, against an assignment where there is one."""
    files = [*checking.files(paths)]
    wanted = read(assignment) if assignment else None
    with Bar(f"grading {counted(len(files), 'file')}", quiet=bool(form), motion=motion) as bar:
        found = grades(files, wanted, trusted=trusted, progress=bar)
    whole = found.files == len(files)
    return Printout(written(found, len(files), form), code=0 if whole else INTERRUPTED)


def written(found: Graded, files: int, form: str = "") -> str:
    """The grades of so many files as a table, or as data."""
    rows = [_row(one) for one in found.grades]
    if form == "json":
        told = {"games": rows, "missing": found.missing, "files": found.files, "of": files}
        return dumps(told | {"proves": PROVES})
    if form == "csv":
        return csv_of([row | {key: _words(row[key]) for key in LISTS} for row in rows])
    holds = sum(one.verified for one in found.grades)
    head = f"{counted(len(rows), 'game')}, {holds} verified"
    if found.files < files:
        head += f"; interrupted after {found.files} of {counted(files, 'file')}"
    lacking = [f"{who} has no game of seed {_words(seeds)}" for who, seeds in found.missing.items()]
    games = table([_for_people(one) for one in found.grades])
    return "\n\n".join(filter(None, [head, games, "\n".join(lacking), fill(PROVES, WIDE)]))


def _row(one: Grade) -> Row:
    """A grade for programs."""
    return {"return" if key == "returned" else key: told for key, told in one._asdict().items()}


def _words(told: object) -> object:
    return ", ".join(map(str, told)) if isinstance(told, Sequence) else told


def _for_people(one: Grade) -> Row:
    """A grade with its numbers put together, and its faults last."""
    notes = [one.fault] if one.fault else []
    if one.unlike:
        notes.append(f"not as assigned: {', '.join(one.unlike)}")
    notes += [f"the same game as {', '.join(one.same)}"] if one.same else []
    notes += [f"tried again in {', '.join(one.tries)}"] if one.tries else []
    return {
        "file": one_line(one.path),
        "player": one_line(one.player or one.who),
        "game": one_line(f"{one.problem} {'' if one.seed is None else one.seed}"),
        "verified": "yes" if one.verified else "NO",
        "return": "-" if one.returned is None else one.returned,
        "regret": "-" if one.regret is None else f"{one.regret:.3g} ({one.best}/{one.valued} best)",
        "undo": one.undo,
        "reroll": one.reroll,
        "hints": one.hints,
        "strict": "hints" if one.strict == "hints" else "yes" if one.strict else "no",
        "peeked": "yes" if one.peeked else "no",
        "notes": one_line("; ".join(filter(None, [one.ending, *one.marks, *notes]))),
    }
