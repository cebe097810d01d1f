"""What happened in a game, in lines; a log for each of several people who see different things."""

from collections import defaultdict
from collections.abc import Callable, Sequence

from dmplay.game.game import Game
from dmplay.session import Turn


class Log:
    """The logs of one game."""

    def __init__(self, game: Game) -> None:
        self.game = game
        self._rows: defaultdict[int, list[str]] = defaultdict(list)
        self._last = self._turn

    @property
    def rows(self) -> list[str]:
        """What the one before the screen may know."""
        return self._rows[self.game.watcher if self.game.private else 0]

    @property
    def _turn(self) -> Turn | None:
        return self.game.session.turns[-1] if self.game.session.turns else None

    @property
    def outdated(self) -> bool:
        """Whether the last turn is another than the one that was logged last."""
        return self._turn is not self._last

    def tell(self, words: Callable[[int], str]) -> None:
        """Adds what each who may know other things is told, else what the watcher is."""
        self._last = self._turn
        if self.game.private:
            for seat in self.game.people:
                self._rows[seat].append(words(seat))
        else:
            self.rows.append(words(self.game.watcher))

    def turns(self, told: Sequence[str]) -> None:
        """Adds the last turn, or all of those that an answer told of where nobody may not know."""
        if told and not self.game.private:
            self._last = self._turn
            self.rows.extend(told)
        else:
            self.tell(lambda seat: self.game.account.said(self.game.view(seat)))
