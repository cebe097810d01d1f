"""The report of saved games: problem, players, end reason, peeks and hints."""

from pathlib import Path
from typing import NamedTuple

from dmplay.core.text import describe_end_reason, format_count, format_json_report
from dmplay.game.saves import iter_outlines, list_saves
from dmplay.registry.problem_name_kinds import CURRENT_FOLDER, rebase_name, transcript_folder
from dmplay.transcript.reader import TranscriptOutline
from dmplay.transcript.verification_report import describe_peeks_and_hints

MAX_LISTED_GAMES = 20  # unless all games are listed


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


def _summarize_game(outline: TranscriptOutline) -> SavedGame:
    """Return the summary of a saved game."""
    header, folder = outline.header, transcript_folder(Path(outline.path))
    problem = rebase_name(header.problem, folder, CURRENT_FOLDER)
    seats = {
        name: rebase_name(player, folder, CURRENT_FOLDER) for name, player in header.seats.items()
    }
    ending = outline.end_reason or "unfinished"
    return SavedGame(problem, seats, ending, header.peeked, dict(outline.hint_counts), outline.path)


def report_saved_games(*, all_games: bool, json: bool) -> str:
    """Return the games in the folder of saved games, newest first, as text or JSON.

    Without `all_games`, only the newest MAX_LISTED_GAMES files are read.
    """
    paths = list_saves()
    listed_paths = paths if all_games else paths[:MAX_LISTED_GAMES]
    games = [_summarize_game(outline) for outline in iter_outlines(listed_paths)]
    older_count = len(paths) - len(listed_paths)
    if json:
        return format_json_report(
            {"games": [game._asdict() for game in games], "older": older_count}
        )
    rows = [*map(str, games)] or ["no saved games"]
    if older_count:
        rows.append(f"{format_count(older_count, 'older game')}: dmplay list games --all")
    return "\n".join(rows)
