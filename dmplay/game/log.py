"""What happened in a game, in lines; a log for each of several people who see different things."""

from collections import defaultdict
from collections.abc import Sequence

from dmplay.game.game import Game
from dmplay.session import Turn


class EventLog:
    """The logs of one game."""

    def __init__(self, game: Game) -> None:
        self.game = game
        self._rows_by_seat: defaultdict[int, list[str]] = defaultdict(list)
        self._logged_turn_key = self._last_turn_key
        if game.session.turns:  # gone on with
            self._append_change(0)

    @property
    def rows(self) -> list[str]:
        """What the one before the screen may know."""
        return self._rows_by_seat[self.game.viewing_seat if self.game.has_private_views else 0]

    @property
    def _last_turn_key(self) -> tuple[int, Turn | None]:
        """How many turns there are, and the last: another one where its dice were thrown anew."""
        turns = self.game.session.turns
        return len(turns), turns[-1] if turns else None

    def add_new_turns(self, turn_rows: Sequence[str]) -> bool:
        """Adds the last turn, or how far back the game is, as each who may know other things is
        told it; all turns that an answer told of where nobody may not know. Whether any is new.
        """
        game, (before, last), self._logged_turn_key = (
            self.game,
            self._logged_turn_key,
            self._last_turn_key,
        )
        turns, newest = self._logged_turn_key
        if turns == before and newest is last:
            return False
        if turn_rows and turns >= before and not game.has_private_views:
            self.rows.extend(turn_rows)
            return True
        self._append_change(before)
        return True

    def _append_change(self, previous_turn_count: int) -> None:
        """Adds the last turn, or how far back the game is, since there were so many turns."""
        game = self.game
        for seat in game.human_seats if game.has_private_views else [game.viewing_seat]:
            row = game.narrator.describe_change(game.snapshot(seat), previous_turn_count)
            self._rows_by_seat[seat if game.has_private_views else 0].append(row)
