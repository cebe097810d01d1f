"""What words of the command line come to: a game to be played, or a report to be printed."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from rich.text import Text

from dmplay.errors import BadParameter
from dmplay.game.request import Recording, Request, Wanted
from dmplay.terminal import Wishes

HERE = Wishes()


class Sitting(NamedTuple):
    """A game that is wanted, and how it is to be played."""

    wanted: Wanted
    wishes: Wishes
    quiet: bool = False
    speed: float = 2.0  # turns a second when agents play
    rate: float | None = None  # turns a second in real time

    @property
    def timed(self) -> bool:
        """Whether real time was asked for, and not only by a file of settings."""
        return isinstance(self.wanted, Request) and self.wanted.timed

    @property
    def at_a_table(self) -> Wanted:
        """The game as one that people play after another: they may be asked, and it is kept."""
        match self.wanted:
            case Request(timed=True):
                raise BadParameter("--rate: real time is for the screen that dmplay play opens")
            case Request():
                return replace(self.wanted, keep=True, asks=True)
            case Recording():
                return self.wanted
        return replace(self.wanted, asks=True)


class Printout(NamedTuple):
    """A report of which there is more to say than its text."""

    text: Text | str
    wishes: Wishes = HERE
    errors: str = ""  # for the channel of errors
    code: int = 0  # of the process
    paged: bool = False  # whether it is read a screenful at a time
    parts: Iterable[str] = ()  # more text, told as it is made


class Conversation(NamedTuple):
    """Games that are wanted one after another, in words."""

    commands: Sequence[str]  # done in place of what is typed
    wishes: Wishes
    speed: float
    gallery: bool = False  # whether it begins with the list of problems, where that can be drawn


class Service(NamedTuple):
    """An agent that is to play a game which another program keeps, at the other end of a pipe."""

    agent: str
    problem: str


class Hosting(NamedTuple):
    """What a language model at the other end of a pipe may play, and what it may ask for."""

    problems: Sequence[str] = ()  # all that are built in if none is named
    hints: bool = False
    undo: bool = False
    belief: bool = False  # whether it is told what its seat is to believe
    seed: int | None = None  # of all games, which are its episodes; fresh dice if there is none
    turns: int | None = None  # after which a game ends
    folder: Path | None = None  # for transcripts; that of games that are kept if there is none

    @property
    def strict(self) -> bool | str:
        """How strict its games are, as their transcripts say."""
        return not self.undo and (self.hints or "hints")


Errand = Sitting | Conversation | Service | Hosting | Printout | str
Program = Callable[[Sequence[str]], Sitting | str]  # what the command line makes of words
