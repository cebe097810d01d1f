"""The best and the last game of each problem, by variant, parameters, turn limit and seat.

They are saved in a file of the state folder when a game ends. The last game is any that reached its
natural end. The best is the one with the highest return among games that one person played against
the default partners: with no hints, ghost, undo or peeking, not on the uniforms of an
earlier game, from the first turn on, and accepted by `dmplay verify`. The best medal of such games
is saved too, and why the last game does not count.
"""

import contextlib
import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import strftime
from typing import Any, NamedTuple, Protocol

from dmplay.core import safe_files
from dmplay.core.problem import Problem
from dmplay.core.session import Session
from dmplay.core.state_files import StateFile, require_line, require_whole_number
from dmplay.core.text import format_count, format_reward
from dmplay.errors import DmplayError
from dmplay.game.hints.ghost_agent import GHOST_NOTE_PREFIX
from dmplay.game.launch_requests import GameRequest
from dmplay.game.medals import MEDALS
from dmplay.game.verdict import Standing
from dmplay.registry import agents, problems
from dmplay.transcript.external_players import HUMAN_PLAYER
from dmplay.transcript.format import NATURAL_END_REASONS, REPEATED_UNIFORMS_PREFIX
from dmplay.transcript.reader import Transcript, read_transcript
from dmplay.transcript.recorder import Recorder

LOST_MEDAL = "this game now counts for no medal"
RECORDS = "records"  # the section of the file
RESULT_KEYS = ("return", "turns", "seed", "day")  # the keys of a result


class GameWithRecord(Protocol):
    """The facts of a `Game` that its record needs; games import this module."""

    @property
    def problem_name(self) -> str:
        """The name of its problem."""

    @property
    def player_names(self) -> Sequence[str]:
        """The player of each seat."""

    @property
    def session(self) -> Session:
        """Its session."""

    @property
    def recorder(self) -> Recorder | None:
        """Its transcript; None if none is written."""

    @property
    def undo_count(self) -> int:
        """The number of times that turns were undone."""

    @property
    def request(self) -> GameRequest | None:
        """The request that began it; None for a replay."""


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
    medal: str = field(default="", kw_only=True)  # the best one; '' if none was earned
    # why the last game does not count, such as "2 hints"; '' if it does
    aids: str = field(default="", kw_only=True)

    @property
    def key(self) -> str:
        """The text that identifies the problem, parameters, turn limit and seat."""
        return _make_record_key(self.problem, self.parameters, self.turns, self.seat)

    def merge_later(self, later: "ProblemRecord") -> "ProblemRecord":
        """Return the later record, with the better of both best results."""
        results = [result for result in (self.best, later.best) if result]
        best = max(results, key=lambda result: result.discounted_return, default=None)
        earned = [medal for medal in MEDALS if medal in (self.medal, later.medal)]
        return replace(later, best=best, medal=(earned or [""])[0])

    def to_json(self) -> dict[str, object]:
        """Return the record as a JSON object."""
        return vars(self) | {"last": self.last.to_json(), "best": self.best and self.best.to_json()}


def record_finished_game(recorder: Recorder, medal: str = "") -> None:
    """Save the record, and the medal, of a game that a person played to its natural end."""
    finished = recorder.session.end_reason in NATURAL_END_REASONS and not recorder.write_error
    if (
        not finished
        or None not in recorder.session.seated_policies
        or safe_files.is_output_device(recorder.path)
    ):
        return
    with contextlib.suppress(DmplayError, OSError), TemporaryDirectory() as folder:
        # The player may still undo turns of the game, so that its own file has no end.
        path = Path(folder, recorder.path.name)
        path.write_text(recorder.content_with_end, encoding="utf-8")
        record = _read_transcript_record(read_transcript(path), recorder.session.problem)
        if record and record.best and not (_is_new_best(record) and _is_verified(path, record)):
            record = replace(record, best=None)
        if record:
            save_record(replace(record, medal="" if record.aids else medal))


def load_records() -> list[ProblemRecord]:
    """Return all saved records, sorted by problem."""
    records = map(_parse_record, RECORDS_FILE.read().get(RECORDS, []))
    return sorted(records, key=lambda entry: entry.key)


def find_game_record(game: GameWithRecord) -> ProblemRecord | None:
    """Return the record for the problem, parameters, limit and seat of a game.

    Return None if there is none, or if the game cannot count.
    """
    seat = _find_person_seat(game.session.problem, game.player_names)
    if seat is None or game.request is None or problems.depends_on_location(game.problem_name):
        return None
    default_parameters = problems.parameter_values(problems.load_problem(game.problem_name))
    current_parameters = problems.parameter_values(game.session.problem)
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
    key = _make_record_key(problem, parameters, turns, seat)
    return next((record for record in records if record.key == key), None)


def _make_record_key(
    problem: str, parameters: Mapping[str, object], turns: int | None, seat: str
) -> str:
    """Return a JSON text that identifies a problem, parameters, turn limit and seat."""
    return json.dumps([problem, parameters, turns, seat], sort_keys=True, default=str)


def _find_person_seat(problem: Problem, seats: Sequence[str]) -> str | None:
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


def _read_transcript_record(transcript: Transcript, problem: Problem) -> ProblemRecord | None:
    """Return the record of one transcript, or None if no person reached the natural end.

    The result is also a candidate for the best game if nothing disqualifies it.
    """
    header = transcript.header
    seat = _find_person_seat(problem, [*header.seats.values()])
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
    aids = list_aids(transcript)
    return ProblemRecord(
        header.problem,
        header.parameters,
        header.turns,
        seat,
        result,
        best=None if aids else result,
        aids=" and ".join(aids),
    )


def list_aids(transcript: Transcript) -> tuple[str, ...]:
    """List the help that keeps a game from counting for records and medals, as texts."""
    header, kinds = transcript.header, Counter(block.kind for block in transcript.blocks)
    ghosts = any(note.startswith(GHOST_NOTE_PREFIX) for note in transcript.notes)
    repeats = any(note.startswith(REPEATED_UNIFORMS_PREFIX) for note in transcript.notes)
    texts = {
        format_count(kinds["help"], "hint"): kinds["help"],
        f"{format_count(kinds['undo'], 'undo')}": kinds["undo"],
        format_count(kinds["reroll"], "reroll"): kinds["reroll"],
        "shown hidden states": header.peeked or header.reveal,
        "a ghost": ghosts,
        "the same random numbers as an earlier game": (repeats and header.branched is None)
        or header.branched == 0,
        "a start in the middle of another game": bool(header.branched),
    }
    return tuple(text for text, applies in texts.items() if applies)


def can_earn_medal(game: GameWithRecord) -> bool:
    """Return whether a game can earn a medal unless the player uses help.

    A guided game cannot, because its notes advise help.
    """
    request = game.request
    if request is None or request.lesson_goal or request.is_guided:
        return False
    is_alone = [*game.player_names].count(HUMAN_PLAYER) == 1
    return is_alone and not (request.reveal or request.branched is not None)


def find_standing(game: GameWithRecord) -> Standing:
    """Return the help that a finished game had, and a sentence on the record of its player."""
    if [*game.player_names].count(HUMAN_PLAYER) != 1:
        return Standing()
    recorder, session = game.recorder, game.session
    counts = {
        "hint": sum(session.hint_counts.values()),
        "undo": game.undo_count,
        "reroll": len(session.reroll_counts),
    }
    aids = tuple(format_count(count, noun) for noun, count in counts.items() if count)
    is_saved = recorder and not recorder.write_error
    if recorder and is_saved and not safe_files.is_output_device(recorder.path):
        with contextlib.suppress(DmplayError, OSError):
            aids = list_aids(read_transcript(recorder.path))
    seat = _find_person_seat(session.problem, game.player_names)
    if aids or game.request is None:
        return Standing(aids, is_guided=game.request is not None and game.request.is_guided)
    reason = "" if is_saved else "this game is not saved"
    if problems.depends_on_location(game.problem_name):
        reason = "dmplay keeps records of built-in and installed problems"
    if seat is None:
        reason = "records are against the default players"
    if seat is None or reason:
        return Standing((), f"no record: {reason}")
    record = find_game_record(game)
    score = session.seat_return(session.problem.agents.index(seat))
    best = record.best.discounted_return if record and record.best else None
    if best is None or _is_higher(score, best):
        before = "your first" if best is None else f"{format_reward(best)} before"
        return Standing((), f"new record: {format_reward(score)}, {before}")
    return Standing((), f"your record: {format_reward(best)}")


def _is_new_best(record: ProblemRecord) -> bool:
    """Return whether the best result of a record is better than the saved one."""
    best = next((entry.best for entry in load_records() if entry.key == record.key), None)
    return best is None or (
        record.best is not None
        and _is_higher(record.best.discounted_return, best.discounted_return)
    )


def _is_higher(score: float, best: float) -> bool:
    """Return whether a score is higher than a saved one, which has ten digits."""
    return score > best and not math.isclose(score, best, rel_tol=1e-9)


def _is_verified(path: Path, record: ProblemRecord) -> bool:
    """Return whether `dmplay verify` accepts a transcript of a record.

    Only the code of the record's installed problem is imported, which ran during the game. The file
    may name another by now.
    """
    from dmplay.game.transcript_verification import (
        verify,  # imported here because it is needed only now
    )

    played_names = {record.problem: record.problem}
    return verify(path, trusted=True, assigned_names=played_names).is_ok


def save_record(record: ProblemRecord) -> None:
    """Merge a record into the file of records, under a lock; print a warning if that fails."""

    def change(content: dict[str, Any]) -> None:
        """Replace the record with the same key."""
        records = {entry.key: entry for entry in map(_parse_record, content.get(RECORDS, []))}
        earlier = records.get(record.key)
        records[record.key] = earlier.merge_later(record) if earlier else record
        content[RECORDS] = [entry.to_json() for entry in records.values()]

    RECORDS_FILE.update(change)


def _parse_record(data: Any) -> ProblemRecord:
    """Return the record of a JSON object; raise ValueError, TypeError or KeyError if invalid."""
    if not isinstance(data["parameters"], dict):
        raise TypeError(data)
    return ProblemRecord(
        require_line(data["problem"]),
        data["parameters"],
        None if data["turns"] is None else require_whole_number(data["turns"]),
        require_line(data["seat"]),
        _parse_result(data["last"]),
        best=data["best"] and _parse_result(data["best"]),
        medal=data["medal"] if data.get("medal") in MEDALS else "",
        aids=require_line(data.get("aids", "")),
    )


def _parse_result(data: Any) -> GameResult:
    """Return the result of a JSON object; raise ValueError, TypeError or KeyError if invalid."""
    total, turns, seed, day = (data[name] for name in RESULT_KEYS)
    if isinstance(total, bool) or not math.isfinite(total):
        raise ValueError(data)
    return GameResult(
        total, require_whole_number(turns), require_whole_number(seed), require_line(day)
    )


RECORDS_FILE = StateFile("records.json", "records", {RECORDS: (list, _parse_record)})
