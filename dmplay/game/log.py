"""What happened in a game, in lines; a log for each of several people who see different things."""

from collections import defaultdict
from collections.abc import Sequence

from dmplay.game.game import Game
from dmplay.session import Turn


class Log:
    """The logs of one game."""

    def __init__(self, game: Game) -> None:
        self.game = game
        self._rows: defaultdict[int, list[str]] = defaultdict(list)
        self._logged = self._now
        if game.session.turns:  # gone on with
            self._tell(0)

    @property
    def rows(self) -> list[str]:
        """What the one before the screen may know."""
        return self._rows[self.game.watcher if self.game.private else 0]

    @property
    def _now(self) -> tuple[int, Turn | None]:
        """How many turns there are, and the last: another one where its dice were thrown anew."""
        turns = self.game.session.turns
        return len(turns), turns[-1] if turns else None

    def catch_up(self, told: Sequence[str]) -> bool:
        """Adds the last turn, or how far back the game is, as each who may know other things is
        told it; all turns that an answer told of where nobody may not know. Whether any is new.
        """
        game, (before, last), self._logged = self.game, self._logged, self._now
        turns, newest = self._logged
        if turns == before and newest is last:
            return False
        if told and turns >= before and not game.private:
            self.rows.extend(told)
            return True
        self._tell(before)
        return True

    def _tell(self, before: int) -> None:
        """Adds the last turn, or how far back the game is, since there were so many turns."""
        game = self.game
        for seat in game.people if game.private else [game.watcher]:
            row = game.account.change(game.moment(seat), before)
            self._rows[seat if game.private else 0].append(row)
