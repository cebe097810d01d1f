"""The report of saved games: problem, players, end reason, peeks and hints."""

from collections import Counter
from pathlib import Path
from typing import NamedTuple

from dmplay.formatting import describe_end_reason, format_json_report
from dmplay.game.saves import iter_saves
from dmplay.registry.problem_sources import CURRENT_FOLDER, rebase_name, transcript_folder
from dmplay.transcript.reader import Transcript
from dmplay.transcript.verification_report import describe_peeks_and_hints


class SavedGame(NamedTuple):
    """A saved game."""

    problem: str
    seats: dict[str, str]
    ending: str
    peeked: bool
    help: dict[str, int]
    path: str

    def __str__(self) -> str:
        """Return the game as one line."""
        seats = ", ".join(f"{name} {player}" for name, player in self.seats.items())
        status = "; ".join(
            [
                describe_end_reason(self.ending),
                *describe_peeks_and_hints(self.help, peeked=self.peeked),
            ]
        )
        return f"{self.path}: {self.problem}, {seats}; {status}"


def _summarize_game(transcript: Transcript) -> SavedGame:
    """Return the summary of the saved game in a transcript."""
    header, hint_counts = transcript.header, Counter[str]()
    for block in transcript.blocks:
        if block.kind == "help" and isinstance(counts := block["help"], dict):
            hint_counts.update(
                {name: count for name, count in counts.items() if type(count) is int}
            )
    ending, folder = transcript.end_reason or "unfinished", transcript_folder(Path(transcript.path))
    problem = rebase_name(header.problem, folder, CURRENT_FOLDER)
    seats = {
        name: rebase_name(player, folder, CURRENT_FOLDER) for name, player in header.seats.items()
    }
    return SavedGame(problem, seats, ending, header.peeked, dict(hint_counts), transcript.path)


def report_saved_games(*, json: bool) -> str:
    """Return the games in the folder of saved games, the last first, as text or JSON."""
    games = [_summarize_game(transcript) for transcript in iter_saves()]
    if json:
        return format_json_report({"games": [game._asdict() for game in games]})
    return "\n".join(map(str, games)) or "no game is kept"
