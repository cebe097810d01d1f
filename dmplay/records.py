"""Your best and your last game of each problem, under each of its variants and parameters.

They stand in a file of the state folder, to which games are added as they end. The last is any
that came to its end; the best is the one of most return among those that a person played alone:
against the usual partners, with no help or ghost, nothing taken back, no look at what is hidden,
under dice that were not just played before, from its first turn on, and as `dmplay verify` finds
it.
"""

import contextlib
import json
import math
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from time import strftime
from typing import Any, NamedTuple

from dmplay import disk
from dmplay.advice.ghost import GHOST
from dmplay.core import Problem
from dmplay.errors import DmplayError
from dmplay.finding import agents, problems
from dmplay.game.game import AGAIN, Game
from dmplay.game.saves import folder
from dmplay.transcript.format import EVENTS, NATURAL, PERSON
from dmplay.transcript.reading import Transcript, read
from dmplay.transcript.recorder import Recorder

VERSION = 1
TOLD = ("return", "turns", "seed", "day")  # of a result


class Result(NamedTuple):
    """How a game came out."""

    returned: float
    turns: int
    seed: int
    day: str

    def told(self) -> dict[str, object]:
        """The same as data."""
        return dict(zip(TOLD, self, strict=True))


@dataclass(frozen=True)
class Record:
    """The games of one kind: problem, parameters other than usual, turn limit and seat."""

    problem: str
    parameters: Mapping[str, object]
    turns: int | None
    seat: str
    last: Result
    best: Result | None = field(default=None, kw_only=True)

    @property
    def key(self) -> str:
        """What tells this kind from others."""
        return _key(self.problem, self.parameters, self.turns, self.seat)

    def joined(self, later: "Record") -> "Record":
        """This record after a later game."""
        known = [one for one in (self.best, later.best) if one]
        best = max(known, key=lambda one: one.returned, default=None)
        return replace(later, best=best)

    def told(self) -> dict[str, object]:
        """The same as data."""
        return vars(self) | {"last": self.last.told(), "best": self.best and self.best.told()}


def noted(recorder: Recorder) -> None:
    """Adds a game that ended, if a person played it to its end."""
    over = recorder.session.ending in NATURAL and not recorder.fault
    if not over or None not in recorder.session.followers or disk.stream(recorder.path):
        return
    with contextlib.suppress(DmplayError, OSError):  # a file that was changed meanwhile
        transcript = read(recorder.path)
        record = _record(transcript, recorder.session.problem)
        if record and record.best and not (_beats(record) and _verifies(recorder.path)):
            record = replace(record, best=None)
        if record:
            _add(record)


def all_records() -> list[Record]:
    """Every record, by problem; none, with one warning, where the file is not one of records."""
    path = _path()
    try:
        told = json.loads(disk.content(path), parse_constant=float)
        known = [_read(one) for one in told["records"]] if told["dmplay"] == VERSION else None
    except FileNotFoundError:
        return []
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        known = None
    if known is None:
        _warn(f"{path} holds no records; they begin anew")
    return sorted(known or [], key=lambda one: one.key)


def of(game: Game) -> Record | None:
    """The record of the kind of game that is played; None where it could not count."""
    seat = _seat(game.problem, game.seats)
    if seat is None or game.request is None or problems.is_elsewhere(game.name):
        return None
    usual = problems.parameters(problems.load(game.name))
    own = problems.parameters(game.problem)
    changed = {name: value for name, value in own.items() if value != usual[name]}
    return found(all_records(), game.name, changed, game.request.turns, seat)


def found(
    known: Sequence[Record],
    problem: str,
    parameters: Mapping[str, object],
    turns: int | None,
    seat: str,
) -> Record | None:
    """The record of one kind among those that are known."""
    key = _key(problem, parameters, turns, seat)
    return next((one for one in known if one.key == key), None)


def _key(problem: str, parameters: Mapping[str, object], turns: int | None, seat: str) -> str:
    return json.dumps([problem, parameters, turns, seat], sort_keys=True, default=str)


def _path() -> Path:
    return folder(os.environ).parent / "records.json"


@cache  # one warning
def _warn(told: str) -> None:
    print(f"warning: {told}", file=sys.stderr)


def _seat(problem: Problem, seats: Sequence[str]) -> str | None:
    """The seat of the one person among the usual partners."""
    people = [name for name, who in zip(problem.agents, seats, strict=True) if who == PERSON]
    if len(people) != 1:
        return None
    others = [(seat, who) for seat, who in enumerate(seats) if who != PERSON]
    usual = all(who == agents.roster(problem, seat).partner for seat, who in others)
    return people[0] if usual else None


def _record(transcript: Transcript, problem: Problem) -> Record | None:
    """What a transcript adds; None where no person came to the end of a game of this kind."""
    header = transcript.header
    seat = _seat(problem, [*header.seats.values()])
    told = transcript.end["end"] if transcript.end else None
    if seat is None or not isinstance(told, dict) or problems.is_elsewhere(header.problem):
        return None
    result = Result(told["return"][seat], told["turns"], header.seed, strftime("%Y-%m-%d"))
    alone = header.branched is None and not (header.peeked or header.reveal)
    alone &= not any(block.kind in EVENTS for block in transcript.blocks)
    alone &= not any(note == AGAIN or note.startswith(GHOST) for note in transcript.notes)
    best = result if alone else None
    return Record(header.problem, header.parameters, header.turns, seat, result, best=best)


def _beats(record: Record) -> bool:
    """Whether the best game of a record is better than the best so far."""
    best = next((one.best for one in all_records() if one.key == record.key), None)
    return best is None or (record.best is not None and record.best.returned > best.returned)


def _verifies(path: Path) -> bool:
    from dmplay.game.checking import check  # not needed before

    return check(path, trusted=True).ok  # of an installed problem, whose code was run already


def _add(record: Record) -> None:
    """Writes a record down; of two programs at once, one waits."""
    place = _path()
    try:
        place.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        with disk.alone(place.with_suffix(".lock")):
            known = {one.key: one for one in all_records()}
            before = known.get(record.key)
            known[record.key] = before.joined(record) if before else record
            told = {"dmplay": VERSION, "records": [one.told() for one in known.values()]}
            disk.write(place, json.dumps(told, indent=1) + "\n", force=True, private=True)
    except (DmplayError, OSError) as error:
        _warn(f"records are not kept: {error}")


def _read(told: Any) -> Record:
    """A record of what stands in the file; raises ValueError and its like where it is none."""
    kinds = {"problem": str, "parameters": dict, "turns": int | None, "seat": str}
    if not all(isinstance(told[name], kind) for name, kind in kinds.items()):
        raise ValueError(told)
    best = told["best"] and _result(told["best"])
    problem, parameters, turns, seat = (told[name] for name in kinds)
    return Record(problem, parameters, turns, seat, _result(told["last"]), best=best)


def _result(told: Any) -> Result:
    result = Result(*(told[name] for name in TOLD))
    number = isinstance(result.returned, int | float) and math.isfinite(result.returned)
    whole = isinstance(result.turns, int) and isinstance(result.seed, int)
    if not (number and whole and isinstance(result.day, str)):
        raise ValueError(told)
    return result
