"""What happened in a game, in lines; a log for each of several people who see different things."""

from collections import defaultdict
from collections.abc import Callable, Sequence

from dmplay.shell.game import Game


class Log:
    """The logs of one game."""

    def __init__(self, game: Game) -> None:
        self.game = game
        self._rows: defaultdict[int, list[str]] = defaultdict(list)

    @property
    def rows(self) -> list[str]:
        """What the one before the screen may know."""
        return self._rows[self.game.watcher if self.game.private else 0]

    def tell(self, words: Callable[[int], str]) -> None:
        """Adds what each who may know other things is told, else what the watcher is."""
        if self.game.private:
            for seat in self.game.people:
                self._rows[seat].append(words(seat))
        else:
            self.rows.append(words(self.game.watcher))

    def turns(self, told: Sequence[str]) -> None:
        """Adds the last turn, or all of those that an answer told of where nobody may not know."""
        if told and not self.game.private:
            self.rows.extend(told)
        else:
            self.tell(self.game.said)
