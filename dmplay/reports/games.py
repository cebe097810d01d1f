"""The games that are kept: what each is, how it stands, and who looked or was helped."""

from collections import Counter
from json import dumps
from pathlib import Path
from typing import NamedTuple

from dmplay.describe import describe_end_reason
from dmplay.finding.ways import CURRENT_FOLDER, rebase_name, transcript_folder
from dmplay.game.saves import iter_saves
from dmplay.transcript.reading import Transcript
from dmplay.transcript.report import describe_peeks_and_hints


class SavedGame(NamedTuple):
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
        told = "; ".join(
            [
                describe_end_reason(self.ending),
                *describe_peeks_and_hints(self.help, peeked=self.peeked),
            ]
        )
        return f"{self.path}: {self.problem}, {seats}; {told}"


def _summarize_game(transcript: Transcript) -> SavedGame:
    header, helped = transcript.header, Counter[str]()
    for block in transcript.blocks:
        if block.kind == "help" and isinstance(told := block["help"], dict):
            helped.update({name: many for name, many in told.items() if type(many) is int})
    ending, there = transcript.end_reason or "unfinished", transcript_folder(Path(transcript.path))
    problem = rebase_name(header.problem, there, CURRENT_FOLDER)
    seats = {name: rebase_name(who, there, CURRENT_FOLDER) for name, who in header.seats.items()}
    return SavedGame(problem, seats, ending, header.peeked, dict(helped), transcript.path)


def report_saved_games(*, json: bool) -> str:
    """The games of people that have no file of their own, the last first, as text or data."""
    found = [_summarize_game(transcript) for transcript in iter_saves()]
    if json:
        return dumps([one._asdict() for one in found])
    return "\n".join(map(str, found)) or "no game is kept"
