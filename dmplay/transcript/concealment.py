"""Protection of hidden information while a game can be continued, and the mark of a peek."""

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

from dmplay.core import safe_files
from dmplay.core.problem import Problem
from dmplay.errors import BadParameter, DmplayError
from dmplay.transcript.external_players import EXTERNAL_PLAYERS
from dmplay.transcript.format import compute_checksum, format_lines
from dmplay.transcript.header import Header
from dmplay.transcript.reader import HEADER_KEYS, Transcript, parse_transcript
from dmplay.transcript.replay import replay

# a problem and its uniforms; seeing all of such a game reveals the next one
GameKey = tuple[str, object]
RESUMABLE_END_REASONS = ("", "interrupted")  # end reasons after which nothing hidden was shown
FINISH_MESSAGE = "this game can still be continued: finish it first"
PEEK_ADVICE = ", or add --peek (peek=True), which marks it as peeked"


def make_game_key(name: str, uniform_source: object) -> GameKey:
    """Return the key of all games of a problem, in any variant, with the same uniforms."""
    return name.partition(":")[0], uniform_source


def has_hidden_information(problem: Problem, seats: Collection[str], *, reveal: bool) -> bool:
    """Return whether people or models play without seeing all hidden states."""
    return problem.partially_observable and not {*EXTERNAL_PLAYERS}.isdisjoint(seats) and not reveal


def is_concealed(transcript: Transcript, problem: Problem) -> bool:
    """Return whether a game has hidden information, can be continued, and was not peeked at."""
    header = transcript.header
    if header.peeked or transcript.end_reason not in RESUMABLE_END_REASONS:
        return False
    if not has_hidden_information(problem, header.seats.values(), reveal=header.reveal):
        return False
    try:  # The file of a finished game may lack the end line.
        return not replay(transcript, problem).over
    except DmplayError:
        return True


def mark_peeked_if_concealed(
    transcript: Transcript, problem: Problem, *, peek: bool | None = None
) -> Transcript:
    """Return a transcript that may be shown, marked as peeked if its game can be continued.

    Raises BadParameter unless `peek` is True; it is None if the caller has no such option.
    """
    if not is_concealed(transcript, problem):
        return transcript
    if not peek:
        remedy = "" if peek is None else PEEK_ADVICE
        raise BadParameter(f"{transcript.path}: {FINISH_MESSAGE}{remedy}")
    return mark_peeked(transcript)


def mark_peeked(transcript: Transcript) -> Transcript:
    """Return the transcript marked as peeked, and mark its file too.

    Raises BadParameter if the transcript was not read from a file.
    """
    path = transcript.path
    if transcript.header.peeked:
        return transcript
    if path in safe_files.INPUT_DEVICES:
        raise BadParameter(
            "--peek: got standard input, expected a file that can be marked as peeked"
        )
    rows = transcript.content.split("\n")
    earlier_keys = HEADER_KEYS[: HEADER_KEYS.index("peeked")]  # The order of keys is fixed.
    entries = transcript.header_block.entries
    rows.insert(max(entries[key].line for key in entries if key in earlier_keys), "peeked: true")
    content, end = "\n".join(rows), transcript.end_text
    end_facts = transcript.end_block["end"] if transcript.end_block else None
    if transcript.end_block and isinstance(end_facts, dict):
        end_lines = format_lines({"end": end_facts | {"sha256": compute_checksum(content)}})
        end = "\n".join([*transcript.end_block.insert_notes(end_lines), ""])
    text = content + end + transcript.torn_tail
    safe_files.write_file(Path(path).resolve(), [text], continues=True)
    return parse_transcript(text.encode(), path)


def mark_header_peeked(header: Header, problem: Problem, error_prefix: str = "") -> Header:
    """Return the header of a game that continues after hidden information was shown.

    Raises BadParameter if the game is strict.
    """
    if not has_hidden_information(problem, header.seats.values(), reveal=header.reveal):
        return header
    if header.strict:
        reason = "this game is strict: it cannot continue after hidden information was shown"
        raise BadParameter(f"{error_prefix}: {reason}" if error_prefix else reason)
    return replace(header, peeked=True)
