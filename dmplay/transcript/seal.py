"""What is hidden in a game stays so while it can be played on; going on after a look is marked."""

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

from dmplay import disk
from dmplay.core import Problem
from dmplay.errors import BadParameter, DmplayError
from dmplay.transcript.format import PLAYERS, checksum, lines
from dmplay.transcript.header import Header
from dmplay.transcript.reading import Transcript, parse
from dmplay.transcript.replay import replay

Luck = tuple[str, object]  # a problem and its dice: who saw all of such a game knows the next
LEFT = ("", "interrupted")  # reasons of an end after which nothing was shown
FINISH, PEEK = "this game can still be played on: finish it", ", or say --peek, which marks it"


def luck(name: str, dice: object) -> Luck:
    """The luck of a game of a problem, whatever its variant."""
    return name.partition(":")[0], dice


def secret(problem: Problem, seats: Collection[str], *, reveal: bool) -> bool:
    """Whether people or models play who may not know all."""
    return problem.hidden and not {*PLAYERS}.isdisjoint(seats) and not reveal


def sealed(transcript: Transcript, problem: Problem) -> bool:
    """Whether a game has secrets, can be played on, and nobody looked into it yet."""
    header = transcript.header
    if header.peeked or transcript.reason not in LEFT:
        return False
    if not secret(problem, header.seats.values(), reveal=header.reveal):
        return False
    try:  # one that came to its end may lack the line that says so
        return not replay(transcript, problem).over
    except DmplayError:
        return True


def opened(transcript: Transcript, problem: Problem, *, peek: bool | None = None) -> Transcript:
    """A transcript that may be looked at; where its game can be played on, as one marked so.

    Raises BadParameter unless `peek` says to look; None stands for who cannot say so.
    """
    if not sealed(transcript, problem):
        return transcript
    if not peek:
        cure = "" if peek is None else PEEK
        raise BadParameter(f"{transcript.path}: {FINISH}{cure}")
    return marked(transcript)


def marked(transcript: Transcript) -> Transcript:
    """The transcript with the mark that what is hidden was shown, in its file too."""
    path = transcript.path
    if transcript.header.peeked:
        return transcript
    if path in disk.READ:
        raise BadParameter("--peek: name the file, so that it can be marked")
    rows = transcript.content.split("\n")
    rows.insert(max(one.line for one in transcript.header_block.entries.values()), "peeked: true")
    content, end = "\n".join(rows), transcript.last
    told = transcript.end["end"] if transcript.end else None
    if transcript.end and isinstance(told, dict):
        summed = lines({"end": told | {"sha256": checksum(content)}})
        end = "\n".join([*transcript.end.noted(summed), ""])
    whole = content + end + transcript.torn
    disk.write(Path(path).resolve(), [whole], force=True)
    return parse(whole.encode(), path)


def going_on(header: Header, problem: Problem, where: str = "") -> Header:
    """The header of a game that is gone on with though what was hidden was shown."""
    if not secret(problem, header.seats.values(), reveal=header.reveal):
        return header
    if header.strict:
        why = "this game is strict: once what is hidden is shown, nobody plays on"
        raise BadParameter(f"{where}: {why}" if where else why)
    return replace(header, peeked=True)
