"""The best and the last game of each problem, by variant, parameters, turn limit and seat.

They are saved in a file of the state folder when a game ends. The last game is any that reached its
natural end. The best is the one with the highest return among games that one person played against
the default partners: with no hints, ghost, undo or peeking, not on the uniforms of an
earlier game, from the first turn on, and accepted by `dmplay verify`.
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

from dmplay.core import safe_files
from dmplay.core.problem import Problem
from dmplay.errors import DmplayError, clip_message
from dmplay.game.game import REPEATED_UNIFORMS_PREFIX, Game
from dmplay.game.hints.ghost_agent import GHOST_NOTE_PREFIX
from dmplay.game.saves import saves_folder
from dmplay.registry import agents, problems
from dmplay.transcript.format import EVENT_KEYS, HUMAN_PLAYER, NATURAL_END_REASONS
from dmplay.transcript.reader import Transcript, read_transcript
from dmplay.transcript.recorder import Recorder

FORMAT_VERSION = 1
RESULT_KEYS = ("return", "turns", "seed", "day")  # the keys of a result


class GameResult(NamedTuple):
    """The result of one game."""

    discounted_return: float
    turns: int
    seed: int
    date: str

    def to_json(self) -> dict[str, object]:
        """Return the result as a JSON object."""
        return dict(zip(RESULT_KEYS, self, strict=True))


@dataclass(frozen=True)
class ProblemRecord:
    """The last and the best game with one problem, non-default parameters, turn limit and seat."""

    problem: str
    parameters: Mapping[str, object]
    turns: int | None
    seat: str
    last: GameResult
    best: GameResult | None = field(default=None, kw_only=True)

    @property
    def key(self) -> str:
        """The text that identifies the problem, parameters, turn limit and seat."""
        return _record_key(self.problem, self.parameters, self.turns, self.seat)

    def merge_later(self, later: "ProblemRecord") -> "ProblemRecord":
        """Return the later record, with the better of both best results."""
        results = [result for result in (self.best, later.best) if result]
        best = max(results, key=lambda result: result.discounted_return, default=None)
        return replace(later, best=best)

    def to_json(self) -> dict[str, object]:
        """Return the record as a JSON object."""
        return vars(self) | {"last": self.last.to_json(), "best": self.best and self.best.to_json()}


def record_finished_game(recorder: Recorder) -> None:
    """Save the record of a game that a person played to its natural end."""
    finished = recorder.session.end_reason in NATURAL_END_REASONS and not recorder.write_error
    if (
        not finished
        or None not in recorder.session.seated_policies
        or safe_files.is_output_device(recorder.path)
    ):
        return
    with contextlib.suppress(DmplayError, OSError):  # The file may have changed in the meantime.
        transcript = read_transcript(recorder.path)
        record = _record_from_transcript(transcript, recorder.session.problem)
        if (
            record
            and record.best
            and not (_is_new_best(record) and _is_verified(recorder.path, record))
        ):
            record = replace(record, best=None)
        if record:
            _save_record(record)


def load_records() -> list[ProblemRecord]:
    """Return all saved records, sorted by problem.

    If the file is invalid, warn once and return an empty list.
    """
    path = _records_path()
    try:
        data = json.loads(safe_files.read_bytes(path), parse_constant=float)
        records = (
            [_parse_record(entry) for entry in data["records"]]
            if data["dmplay"] == FORMAT_VERSION
            else None
        )
    except FileNotFoundError:
        return []
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        records = None
    if records is None:
        _warn_once(f"{path} is not a file of records; dmplay starts a new one")
    return sorted(records or [], key=lambda entry: entry.key)


def find_game_record(game: Game) -> ProblemRecord | None:
    """Return the record for the problem, parameters, limit and seat of a game.

    Return None if there is none, or if the game cannot count.
    """
    seat = _person_seat(game.problem, game.player_names)
    if seat is None or game.request is None or problems.depends_on_location(game.problem_name):
        return None
    default_parameters = problems.parameter_values(problems.load_problem(game.problem_name))
    current_parameters = problems.parameter_values(game.problem)
    changed = {
        name: value
        for name, value in current_parameters.items()
        if value != default_parameters[name]
    }
    return find_record(load_records(), game.problem_name, changed, game.request.turns, seat)


def find_record(
    records: Sequence[ProblemRecord],
    problem: str,
    parameters: Mapping[str, object],
    turns: int | None,
    seat: str,
) -> ProblemRecord | None:
    """Return the record with this problem, parameters, turn limit and seat, or None."""
    key = _record_key(problem, parameters, turns, seat)
    return next((record for record in records if record.key == key), None)


def _record_key(
    problem: str, parameters: Mapping[str, object], turns: int | None, seat: str
) -> str:
    """Return a JSON text that identifies a problem, parameters, turn limit and seat."""
    return json.dumps([problem, parameters, turns, seat], sort_keys=True, default=str)


def _records_path() -> Path:
    """Return the path of the file of records."""
    return saves_folder(os.environ).parent / "records.json"


@cache  # prints each warning only once
def _warn_once(message: str) -> None:
    """Print a warning to standard error, once for each message."""
    print(clip_message(f"warning: {message}"), file=sys.stderr)


def _person_seat(problem: Problem, seats: Sequence[str]) -> str | None:
    """Return the seat name of the only person; None unless all others are the default partners."""
    people = [
        name for name, player in zip(problem.agents, seats, strict=True) if player == HUMAN_PLAYER
    ]
    if len(people) != 1:
        return None
    others = [(seat, player) for seat, player in enumerate(seats) if player != HUMAN_PLAYER]
    has_default_partners = all(
        player == agents.load_roster(problem, seat).default_partner for seat, player in others
    )
    return people[0] if has_default_partners else None


def _record_from_transcript(transcript: Transcript, problem: Problem) -> ProblemRecord | None:
    """Return the record of one transcript, or None if no person reached the natural end.

    The result is also a candidate for the best game if nothing disqualifies it.
    """
    header = transcript.header
    seat = _person_seat(problem, [*header.seats.values()])
    end_data = transcript.end_block["end"] if transcript.end_block else None
    if (
        seat is None
        or not isinstance(end_data, dict)
        or problems.depends_on_location(header.problem)
    ):
        return None
    result = GameResult(
        end_data["return"][seat], end_data["turns"], header.seed, strftime("%Y-%m-%d")
    )
    is_eligible = header.branched is None and not (header.peeked or header.reveal)
    is_eligible &= not any(block.kind in EVENT_KEYS for block in transcript.blocks)
    is_eligible &= not any(
        note.startswith((REPEATED_UNIFORMS_PREFIX, GHOST_NOTE_PREFIX)) for note in transcript.notes
    )
    best = result if is_eligible else None
    return ProblemRecord(header.problem, header.parameters, header.turns, seat, result, best=best)


def _is_new_best(record: ProblemRecord) -> bool:
    """Return whether the best result of a record is better than the saved one."""
    best = next((entry.best for entry in load_records() if entry.key == record.key), None)
    return best is None or (
        record.best is not None and record.best.discounted_return > best.discounted_return
    )


def _is_verified(path: Path, record: ProblemRecord) -> bool:
    """Return whether `dmplay verify` accepts a transcript of a record.

    Only the code of the record's installed problem is imported, which ran during the game. The file
    may name another by now.
    """
    from dmplay.game.transcript_files import (
        verify,  # imported here because it is needed only now
    )

    played_names = {record.problem: record.problem}
    return verify(path, trusted=True, assigned_names=played_names).is_ok


def _save_record(record: ProblemRecord) -> None:
    """Merge a record into the file of records, under a lock; print a warning if that fails."""
    path = _records_path()
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        with safe_files.exclusive_lock(path.with_suffix(".lock")):
            records = {entry.key: entry for entry in load_records()}
            earlier = records.get(record.key)
            records[record.key] = earlier.merge_later(record) if earlier else record
            data = {
                "dmplay": FORMAT_VERSION,
                "records": [entry.to_json() for entry in records.values()],
            }
            safe_files.write_file(path, json.dumps(data, indent=1) + "\n", force=True, private=True)
    except (DmplayError, OSError) as error:
        _warn_once(f"records are not saved: {error}")


def _parse_record(data: Any) -> ProblemRecord:
    """Return the record of a JSON object; raise ValueError, TypeError or KeyError if invalid."""
    types = {"problem": str, "parameters": dict, "turns": int | None, "seat": str}
    if not all(isinstance(data[name], expected_type) for name, expected_type in types.items()):
        raise ValueError(data)
    best = data["best"] and _parse_result(data["best"])
    problem, parameters, turns, seat = (data[name] for name in types)
    return ProblemRecord(problem, parameters, turns, seat, _parse_result(data["last"]), best=best)


def _parse_result(data: Any) -> GameResult:
    """Return the result of a JSON object; raise ValueError, TypeError or KeyError if invalid."""
    result = GameResult(*(data[name] for name in RESULT_KEYS))
    is_number = isinstance(result.discounted_return, int | float) and math.isfinite(
        result.discounted_return
    )
    are_integers = isinstance(result.turns, int) and isinstance(result.seed, int)
    if not (is_number and are_integers and isinstance(result.date, str)):
        raise ValueError(data)
    return result
