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
from dmplay.advice.ghost import GHOST_NOTE_PREFIX
from dmplay.core import Problem
from dmplay.errors import DmplayError
from dmplay.finding import agents, problems
from dmplay.game.game import REPEATED_UNIFORMS_NOTE, Game
from dmplay.game.saves import saves_folder
from dmplay.transcript.format import EVENT_KEYS, HUMAN_PLAYER, NATURAL_END_REASONS
from dmplay.transcript.reading import Transcript, read_transcript
from dmplay.transcript.recorder import Recorder

FORMAT_VERSION = 1
RESULT_KEYS = ("return", "turns", "seed", "day")  # of a result


class GameResult(NamedTuple):
    """How a game came out."""

    discounted_return: float
    turns: int
    seed: int
    date: str

    def to_json(self) -> dict[str, object]:
        """The same as data."""
        return dict(zip(RESULT_KEYS, self, strict=True))


@dataclass(frozen=True)
class ProblemRecord:
    """The games of one kind: problem, parameters other than usual, turn limit and seat."""

    problem: str
    parameters: Mapping[str, object]
    turns: int | None
    seat: str
    last: GameResult
    best: GameResult | None = field(default=None, kw_only=True)

    @property
    def key(self) -> str:
        """What tells this kind from others."""
        return _record_key(self.problem, self.parameters, self.turns, self.seat)

    def merge_later(self, later: "ProblemRecord") -> "ProblemRecord":
        """This record after a later game."""
        known = [one for one in (self.best, later.best) if one]
        best = max(known, key=lambda one: one.discounted_return, default=None)
        return replace(later, best=best)

    def to_json(self) -> dict[str, object]:
        """The same as data."""
        return vars(self) | {"last": self.last.to_json(), "best": self.best and self.best.to_json()}


def record_finished_game(recorder: Recorder) -> None:
    """Adds a game that ended, if a person played it to its end."""
    over = recorder.session.end_reason in NATURAL_END_REASONS and not recorder.write_error
    if (
        not over
        or None not in recorder.session.seated_policies
        or disk.is_output_device(recorder.path)
    ):
        return
    with contextlib.suppress(DmplayError, OSError):  # a file that was changed meanwhile
        transcript = read_transcript(recorder.path)
        record = _record_from_transcript(transcript, recorder.session.problem)
        if record and record.best and not (_is_new_best(record) and _is_verified(recorder.path)):
            record = replace(record, best=None)
        if record:
            _save_record(record)


def load_records() -> list[ProblemRecord]:
    """Every record, by problem; none, with one warning, where the file is not one of records."""
    path = _records_path()
    try:
        told = json.loads(disk.read_bytes(path), parse_constant=float)
        known = (
            [_parse_record(one) for one in told["records"]]
            if told["dmplay"] == FORMAT_VERSION
            else None
        )
    except FileNotFoundError:
        return []
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        known = None
    if known is None:
        _warn_once(f"{path} holds no records; they begin anew")
    return sorted(known or [], key=lambda one: one.key)


def record_for_game(game: Game) -> ProblemRecord | None:
    """The record of the kind of game that is played; None where it could not count."""
    seat = _person_seat(game.problem, game.player_names)
    if seat is None or game.request is None or problems.depends_on_location(game.problem_name):
        return None
    usual = problems.parameter_values(problems.load_problem(game.problem_name))
    own = problems.parameter_values(game.problem)
    changed = {name: value for name, value in own.items() if value != usual[name]}
    return find_record(load_records(), game.problem_name, changed, game.request.turns, seat)


def find_record(
    records: Sequence[ProblemRecord],
    problem: str,
    parameters: Mapping[str, object],
    turns: int | None,
    seat: str,
) -> ProblemRecord | None:
    """The record of one kind among those that are known."""
    key = _record_key(problem, parameters, turns, seat)
    return next((one for one in records if one.key == key), None)


def _record_key(
    problem: str, parameters: Mapping[str, object], turns: int | None, seat: str
) -> str:
    return json.dumps([problem, parameters, turns, seat], sort_keys=True, default=str)


def _records_path() -> Path:
    return saves_folder(os.environ).parent / "records.json"


@cache  # one warning
def _warn_once(message: str) -> None:
    print(f"warning: {message}", file=sys.stderr)


def _person_seat(problem: Problem, seats: Sequence[str]) -> str | None:
    """The seat of the one person among the usual partners."""
    people = [name for name, who in zip(problem.agents, seats, strict=True) if who == HUMAN_PLAYER]
    if len(people) != 1:
        return None
    others = [(seat, who) for seat, who in enumerate(seats) if who != HUMAN_PLAYER]
    usual = all(who == agents.load_roster(problem, seat).default_partner for seat, who in others)
    return people[0] if usual else None


def _record_from_transcript(transcript: Transcript, problem: Problem) -> ProblemRecord | None:
    """What a transcript adds; None where no person came to the end of a game of this kind."""
    header = transcript.header
    seat = _person_seat(problem, [*header.seats.values()])
    told = transcript.end_block["end"] if transcript.end_block else None
    if seat is None or not isinstance(told, dict) or problems.depends_on_location(header.problem):
        return None
    result = GameResult(told["return"][seat], told["turns"], header.seed, strftime("%Y-%m-%d"))
    alone = header.branched is None and not (header.peeked or header.reveal)
    alone &= not any(block.kind in EVENT_KEYS for block in transcript.blocks)
    alone &= not any(
        note == REPEATED_UNIFORMS_NOTE or note.startswith(GHOST_NOTE_PREFIX)
        for note in transcript.notes
    )
    best = result if alone else None
    return ProblemRecord(header.problem, header.parameters, header.turns, seat, result, best=best)


def _is_new_best(record: ProblemRecord) -> bool:
    """Whether the best game of a record is better than the best so far."""
    best = next((one.best for one in load_records() if one.key == record.key), None)
    return best is None or (
        record.best is not None and record.best.discounted_return > best.discounted_return
    )


def _is_verified(path: Path) -> bool:
    from dmplay.game.checking import verify_file  # not needed before

    return verify_file(
        path, trusted=True
    ).is_ok  # of an installed problem, whose code was run already


def _save_record(record: ProblemRecord) -> None:
    """Writes a record down; of two programs at once, one waits."""
    place = _records_path()
    try:
        place.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        with disk.exclusive_lock(place.with_suffix(".lock")):
            known = {one.key: one for one in load_records()}
            before = known.get(record.key)
            known[record.key] = before.merge_later(record) if before else record
            told = {"dmplay": FORMAT_VERSION, "records": [one.to_json() for one in known.values()]}
            disk.write_file(place, json.dumps(told, indent=1) + "\n", force=True, private=True)
    except (DmplayError, OSError) as error:
        _warn_once(f"records are not kept: {error}")


def _parse_record(data: Any) -> ProblemRecord:
    """A record of what stands in the file; raises ValueError and its like where it is none."""
    kinds = {"problem": str, "parameters": dict, "turns": int | None, "seat": str}
    if not all(isinstance(data[name], kind) for name, kind in kinds.items()):
        raise ValueError(data)
    best = data["best"] and _parse_result(data["best"])
    problem, parameters, turns, seat = (data[name] for name in kinds)
    return ProblemRecord(problem, parameters, turns, seat, _parse_result(data["last"]), best=best)


def _parse_result(data: Any) -> GameResult:
    result = GameResult(*(data[name] for name in RESULT_KEYS))
    number = isinstance(result.discounted_return, int | float) and math.isfinite(
        result.discounted_return
    )
    whole = isinstance(result.turns, int) and isinstance(result.seed, int)
    if not (number and whole and isinstance(result.date, str)):
        raise ValueError(data)
    return result
