"""The table: the game that is played now, and how the next one begins."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path

from dmplay.describe import counted
from dmplay.errors import BadParameter
from dmplay.game import saves
from dmplay.game.answer import Page
from dmplay.game.errand import Program
from dmplay.game.game import Game
from dmplay.game.request import Request
from dmplay.game.start import begin, new
from dmplay.thought import About, think
from dmplay.transcript.recorder import Recorder
from dmplay.transcript.seal import Luck, luck

NOTHING: Mapping[str, str] = {}
NUMBERED = re.compile(r"(.*)-(\d+)")


class Table:
    """Holds one game at a time; each is ended, and its transcript with it, before the next."""

    def __init__(
        self,
        game: Game | None = None,
        program: Program | None = None,
        aliases: Mapping[str, str] = NOTHING,
        ends: Callable[[Recorder], object] | None = None,
    ) -> None:
        self.typed = False  # whether people type here; else a script is done
        self.ended: dict[Recorder, str] = {}  # of the games so far, and what was played
        self._kept_before: list[Recorder] = []  # of the game before this one, if it is kept
        self.removed = 0  # older games that had to make room for them
        self.open_screen: Callable[[], str] | None = None  # where there is one to open
        self.aliases = aliases
        self.tells: Callable[[], object] = lambda: None  # a turn that another follows
        self._program, self._ends = program, ends  # does what words say; hears of each end
        self._game: Game | None = None
        self._shown: set[Luck] = set()  # of games whose secrets are told once they are left
        self._played: dict[Luck, Path | None] = {}  # of all games, with the file of the last
        self._asked_for = ("", 0)  # the line that would end a game, and after how many turns
        self._before = 0  # the seat of who sits at the terminal
        if game:
            self.put(game)

    @property
    def game(self) -> Game:
        """The game that is played now; raises BadParameter where none is."""
        if self._game is None:
            raise BadParameter("no game is played; play PROBLEM begins one, list names them")
        return self._game

    @property
    def playing(self) -> bool:
        """Whether there is a game."""
        return self._game is not None

    @property
    def secret(self) -> bool:
        """Whether what is typed is not for all eyes: several people choose."""
        return self.typed and self.playing and len(self.game.people) > 1

    def put(self, game: Game) -> None:
        """Plays this game from now on."""
        many = len(self.ended)
        self.end()
        self._kept_before = [*self.ended][many:]
        self._game = game
        self.removed += game.removed
        dice = luck(game.name, game.session.source)
        if self._repeats(game, dice):
            game.repeat()
        self._played[dice] = game.source
        game.catch_up()
        game.between = lambda: self.tells()  # noqa: PLW0108 - whoever is told then
        if game.problem.hidden:
            self._shown.add(dice)
        self.change_places()

    def _repeats(self, game: Game, dice: Luck) -> bool:
        """Whether these dice were played in another game; a branch tells of that by itself."""
        if not game.session.turns:
            return dice in self._played
        branch = game.request is not None and game.request.branched is not None
        return not branch and self._played.get(dice, game.source) != game.source

    @property
    def curtained(self) -> bool:
        """Whether another than who sits here is to choose, who alone may see what comes."""
        game = self._game
        private = game is not None and game.private and game.waiting is not None
        return private and self.game.watcher != self._before

    def change_places(self) -> None:
        """Who is to choose next sits at the terminal."""
        self._before = self.game.watcher

    def end(self, reason: str = "quit") -> None:
        """Ends the game, if there is one, and its transcript."""
        if self._game is None:
            return
        self._game.finish(reason)
        recorder = self._game.recorder
        if recorder and recorder not in self.ended and not saves.dropped(recorder):
            self.ended[recorder] = self._game.name
            if self._ends:
                self._ends(recorder)

    def asks(self, line: str) -> str:
        """What is asked before a typed line ends a game that goes on; '' the second time."""
        turns = len(self.game.session.turns)
        asked, self._asked_for = self._asked_for, (line, turns)
        if self.typed and turns and not self.game.session.over and asked != (line, turns):
            name = line.partition(" ")[0]
            played = counted(turns, "turn")
            return f"{name}: that ends this game of {played}; once more does it"
        return ""

    def begin(self, **changes: object) -> str:
        """Begins the same game anew but for these changes, with fresh dice if none are given."""
        return self.restart(**{"seed": None, "seed_known": True, "fresh": False, **changes})

    def restart(self, **changes: object) -> str:
        """Begins the same game again but for these changes under the same dice, known or not as
        before.
        """
        asked = self._request()
        record = asked.record and following(asked.record)
        keep = asked.keep or self.game.recorder is not None
        wanted = replace(asked, record=record, force=False, keep=keep, timed=False)
        wanted = replace(wanted, **changes)  # type: ignore[arg-type] # fields of a request
        self.put(new(wanted, self._shown))
        return self.began()

    def _request(self) -> Request:
        if self.game.request is None:
            raise BadParameter("a recording is only looked at; branch plays on")
        return self.game.request

    def began(self) -> str:
        """What game began, and where the one before it is."""
        seed = f", seed {self.game.seed}" if self.game.shows_seed else ""
        kept = "".join(f" kept: {one.path}" for one in self._kept_before)
        return f"new game of {self.game.name}{seed}.{kept}"

    def free(self, path: Path) -> Path:
        """A name for a game that goes on from this file: beside it, or where games are kept."""
        if self.game.recorder:
            return following(path)
        self.removed += saves.cleared()
        return saves.new(self.game.name) or following(path)

    def ask(self, words: Sequence[str]) -> str:
        """Does what the command line would do with these words: a game is played here, a report
        is told.
        """
        if self._program is None:
            raise BadParameter(f"{words[0]}: only the command line knows it")
        program = self._program
        errand = think(About(f"working on {words[0]}"), lambda: program(words))
        if isinstance(errand, str):
            return Page(errand)
        self.put(begin(errand.at_a_table, self._shown))
        return ""


def following(path: Path) -> Path:
    """A free name for the next game's file: `game.dmt`, `game-2.dmt`, `game-3.dmt`; a device's own.

    The number goes on from the one that the name ends with.
    """
    if path.exists() and not path.is_file():
        return path
    found = NUMBERED.fullmatch(path.stem)
    stem, number = (found[1], int(found[2])) if found else (path.stem, 1)
    names = (path.with_stem(f"{stem}-{n}") for n in count(number + 1))
    return next(name for name in names if not name.exists())
