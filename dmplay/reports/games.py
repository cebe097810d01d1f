"""The games that are kept: what each is, how it stands, and who looked or was helped."""

from collections import Counter
from json import dumps
from pathlib import Path
from typing import NamedTuple

from dmplay.describe import ended
from dmplay.finding.ways import HERE, beside, moved
from dmplay.game.saves import kept
from dmplay.transcript.reading import Transcript
from dmplay.transcript.report import marks


class KeptGame(NamedTuple):
    """One game."""

    problem: str
    seats: dict[str, str]
    ending: str
    peeked: bool
    help: dict[str, int]
    path: str

    def __str__(self) -> str:
        """One line."""
        seats = ", ".join(f"{name} {who}" for name, who in self.seats.items())
        told = "; ".join([ended(self.ending), *marks(self.help, peeked=self.peeked)])
        return f"{self.path}: {self.problem}, {seats}; {told}"


def _told(transcript: Transcript) -> KeptGame:
    header, helped = transcript.header, Counter[str]()
    for block in transcript.blocks:
        if block.kind == "help" and isinstance(told := block["help"], dict):
            helped.update({name: many for name, many in told.items() if type(many) is int})
    ending, there = transcript.reason or "unfinished", beside(Path(transcript.path))
    problem = moved(header.problem, there, HERE)
    seats = {name: moved(who, there, HERE) for name, who in header.seats.items()}
    return KeptGame(problem, seats, ending, header.peeked, dict(helped), transcript.path)


def listing(*, json: bool) -> str:
    """The games of people that have no file of their own, the last first, as text or data."""
    found = [_told(transcript) for transcript in kept()]
    if json:
        return dumps([one._asdict() for one in found])
    return "\n".join(map(str, found)) or "no game is kept"
