"""A recorded game, to look at turn by turn."""

from pathlib import Path

from dmplay.describe import counted
from dmplay.displayed import Displayed
from dmplay.errors import BadParameter
from dmplay.game.checking import altered, loaded
from dmplay.game.game import Game
from dmplay.game.request import set_to
from dmplay.game.saves import readable
from dmplay.game.seats import people
from dmplay.keys.keyboard import Keyboard
from dmplay.keys.keymap import AS_DRAWN
from dmplay.session import Session
from dmplay.transcript.feeding import Ahead
from dmplay.transcript.replay import start
from dmplay.transcript.seal import opened


class Playback(Displayed, Game):
    """A recorded game to step through; nothing in it is hidden any more."""

    watched = True  # who played is called by name; who plays on from there is "you"
    paid = True

    def __init__(self, path: Path, *, trusted: bool = False, peek: bool = False) -> None:
        transcript = readable(path)
        found = loaded(transcript, trusted=trusted)
        self.transcript = opened(transcript, found.problem, peek=peek)
        self._problem = found.problem
        opening, *blocks = self.transcript.blocks
        helped = [block for block in blocks if block.kind == "help"]
        played = [block for block in blocks if block.kind != "help"]
        self._blocks = [opening, *helped, *played]
        self._first = self._place = 1 + len(helped)
        seats = list(self.transcript.header.seats.values())
        keyboard = Keyboard(found.problem, [], AS_DRAWN)  # nobody plays
        super().__init__(found.name, self._session(self._first), seats, keyboard)
        self.warning = altered(transcript, found)

    def _session(self, place: int) -> Session:
        """The game before the block at this place."""
        session = start(self.transcript, self._problem, self.transcript.header.dice)
        self._ahead = Ahead(self.transcript, self._blocks, session)
        for before in range(1, place):
            self._ahead.feed(before)
        return session

    @property
    def settings(self) -> list[str]:
        """The parameters that differ from the default, as they are typed."""
        return set_to(self.transcript.header.parameters)

    def _sit(self, session: Session) -> None:
        super()._sit(session)
        self.account.dice = self.shows_seed

    def unattended(self) -> bool:
        """Shows the next turn or event; False at the end of the file."""
        if self.whole:
            self.session.end(self.transcript.chosen or "unfinished")
            return False
        self._feed()
        if self._blocks[self._place - 1].kind == "reroll" and not self.whole:
            self._feed()  # the turn that came of it
        return True

    def _feed(self) -> None:
        self._ahead.feed(self._place)
        self._place += 1

    @property
    def steps(self) -> int:
        """How many turns and events there are to be shown: a reroll and its turn are one."""
        return self._steps(len(self._blocks))

    def _steps(self, place: int) -> int:
        """How many there are before a place."""
        blocks = self._blocks[self._first : place]
        return len(blocks) - sum(block.kind == "reroll" for block in blocks[:-1])

    @property
    def whole(self) -> bool:
        """Whether all of it was shown."""
        return self._place >= len(self._blocks)

    @property
    def reveal(self) -> bool:
        """Nothing is hidden."""
        return True

    @property
    def shows_seed(self) -> bool:
        """Whether it is no secret: of a game that people still play it may be one."""
        known = self.transcript.end is not None or self.transcript.header.peeked
        return known or not people(self.seats)

    @property
    def source(self) -> Path | None:
        """The file that is looked at."""
        return Path(self.transcript.path)

    def redo(self) -> None:
        """A recording is only looked at."""
        raise BadParameter("a recording is only looked at; branch plays on")

    def reroll(self) -> None:
        """A recording is only looked at."""
        self.redo()

    def undo(self, turns: int = 1) -> None:
        """Shows the place so many turns or events back."""
        shown = self._steps(self._place)
        if shown < turns:
            told = f"undo {turns}: the beginning is {counted(shown, 'step')} back"
            raise BadParameter(told if shown else "this is the beginning")
        for _ in range(turns):
            self._place -= 1
            if self._blocks[self._place].kind == "turn":
                self.session.undo()
            if self._blocks[self._place - 1].kind == "reroll":
                self._place -= 1
            if self._blocks[self._place].kind != "turn":  # what it took back is played again
                self._sit(self._session(self._place))
