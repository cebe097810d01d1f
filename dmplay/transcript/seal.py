"""What is hidden in a game stays so while it can be played on; going on after a look is marked."""

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

from dmplay import disk
from dmplay.core import Problem
from dmplay.errors import BadParameter, DmplayError
from dmplay.transcript.format import EXTERNAL_PLAYERS, compute_checksum, format_lines
from dmplay.transcript.header import Header
from dmplay.transcript.reading import Transcript, parse_transcript
from dmplay.transcript.replay import replay

GameKey = tuple[str, object]  # a problem and its dice: who saw all of such a game knows the next
RESUMABLE_END_REASONS = ("", "interrupted")  # reasons of an end after which nothing was shown
FINISH_MESSAGE, PEEK_ADVICE = (
    "this game can still be played on: finish it",
    ", or say --peek, which marks it",
)


def make_game_key(name: str, uniform_source: object) -> GameKey:
    """The luck of a game of a problem, whatever its variant."""
    return name.partition(":")[0], uniform_source


def has_hidden_information(problem: Problem, seats: Collection[str], *, reveal: bool) -> bool:
    """Whether people or models play who may not know all."""
    return problem.partially_observable and not {*EXTERNAL_PLAYERS}.isdisjoint(seats) and not reveal


def is_concealed(transcript: Transcript, problem: Problem) -> bool:
    """Whether a game has secrets, can be played on, and nobody looked into it yet."""
    header = transcript.header
    if header.peeked or transcript.end_reason not in RESUMABLE_END_REASONS:
        return False
    if not has_hidden_information(problem, header.seats.values(), reveal=header.reveal):
        return False
    try:  # one that came to its end may lack the line that says so
        return not replay(transcript, problem).over
    except DmplayError:
        return True


def disclose_transcript(
    transcript: Transcript, problem: Problem, *, peek: bool | None = None
) -> Transcript:
    """A transcript that may be looked at; where its game can be played on, as one marked so.

    Raises BadParameter unless `peek` says to look; None stands for who cannot say so.
    """
    if not is_concealed(transcript, problem):
        return transcript
    if not peek:
        cure = "" if peek is None else PEEK_ADVICE
        raise BadParameter(f"{transcript.path}: {FINISH_MESSAGE}{cure}")
    return mark_peeked(transcript)


def mark_peeked(transcript: Transcript) -> Transcript:
    """The transcript with the mark that what is hidden was shown, in its file too."""
    path = transcript.path
    if transcript.header.peeked:
        return transcript
    if path in disk.INPUT_DEVICES:
        raise BadParameter("--peek: name the file, so that it can be marked")
    rows = transcript.content.split("\n")
    rows.insert(max(one.line for one in transcript.header_block.entries.values()), "peeked: true")
    content, end = "\n".join(rows), transcript.end_text
    told = transcript.end_block["end"] if transcript.end_block else None
    if transcript.end_block and isinstance(told, dict):
        summed = format_lines({"end": told | {"sha256": compute_checksum(content)}})
        end = "\n".join([*transcript.end_block.insert_notes(summed), ""])
    whole = content + end + transcript.torn_tail
    disk.write_file(Path(path).resolve(), [whole], force=True)
    return parse_transcript(whole.encode(), path)


def mark_header_peeked(header: Header, problem: Problem, error_prefix: str = "") -> Header:
    """The header of a game that is gone on with though what was hidden was shown."""
    if not has_hidden_information(problem, header.seats.values(), reveal=header.reveal):
        return header
    if header.strict:
        why = "this game is strict: once what is hidden is shown, nobody plays on"
        raise BadParameter(f"{error_prefix}: {why}" if error_prefix else why)
    return replace(header, peeked=True)
