"""The log of a game, in lines; one log per person if people see different things."""

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence

from dmplay.core.session import Turn
from dmplay.game.game import Game

# the beginning of a row about a turn, or about the turn that a player went back to
TURN_ROW = re.compile(r"(?P<undone>undone\. )?turn (\d+)(?:, rerolled)?\.")


def mark_turn_row(row: str, mark: str) -> str:
    """Return a row about a turn with a mark after the number of the turn; '' for no mark."""
    match = TURN_ROW.match(row) if mark else None
    return f"{row[: match.end()]} {mark}{row[match.end() :]}" if match else row


class EventLog:
    """The logs of one game, one row per turn or change."""

    def __init__(self, game: Game) -> None:
        self.game = game
        self._rows_by_seat: defaultdict[int, list[str]] = defaultdict(list)
        self._logged_turn_key = self._last_turn_key
        if game.session.turns:  # a resumed game
            self._append_change(0)

    @property
    def rows(self) -> list[str]:
        """The log rows that the viewing seat may read."""
        return self._rows_by_seat[self.game.viewing_seat if self.game.has_private_views else 0]

    @property
    def _last_turn_key(self) -> tuple[int, Turn | None]:
        """The turn count and the last turn, a new object after a reroll; None at the start."""
        turns = self.game.session.turns
        return len(turns), turns[-1] if turns else None

    def mark_rows(self, marks: Mapping[int, str]) -> list[str]:
        """Return the rows, those of the turns that were not undone with these marks."""
        unmarked, rows = dict(marks), list[str]()
        for row in reversed(self.rows):
            match = TURN_ROW.match(row)
            if match and match["undone"]:
                unmarked = {turn: mark for turn, mark in unmarked.items() if turn <= int(match[2])}
            mark = unmarked.pop(int(match[2]), "") if match and not match["undone"] else ""
            rows.append(mark_turn_row(row, mark))
        return rows[::-1]

    def add_new_turns(self, turn_rows: Sequence[str]) -> bool:
        """Add the changes since the last call; return whether there are any.

        The given rows are added if they report new turns and all people see the same. Otherwise one
        row per log describes the last turn, or how far the game was undone.
        """
        game = self.game
        previous_count, previous_turn = self._logged_turn_key
        self._logged_turn_key = self._last_turn_key
        turn_count, newest_turn = self._logged_turn_key
        if turn_count == previous_count and newest_turn is previous_turn:
            return False
        if turn_rows and turn_count >= previous_count and not game.has_private_views:
            self.rows.extend(turn_rows)
            return True
        self._append_change(previous_count)
        return True

    def add_notice(self, row: str) -> None:
        """Add one row to each log."""
        for seat in self.game.human_seats if self.game.has_private_views else [0]:
            self._rows_by_seat[seat].append(row)

    def _append_change(self, previous_turn_count: int) -> None:
        """Add a row to each log: the last turn, or the number of turns undone since that count."""
        game = self.game
        for seat in game.human_seats if game.has_private_views else [game.viewing_seat]:
            row = game.narrator.describe_change(game.snapshot(seat), previous_turn_count)
            self._rows_by_seat[seat if game.has_private_views else 0].append(row)
