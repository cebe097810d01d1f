"""What is being done when a kill comes, and what must hold of the files after it."""

import re
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from subprocess import CompletedProcess

from tests.kills.games import Game, begun, events, unbroken
from tests.support.programs import run

FILE, COPY = "g.dmt", "s.dmt"
TOLD = re.compile(r"^(turn \d+\.|undone)", re.MULTILINE)
HALF, EARLY = 17, 9  # turns and events that a game goes on from
NONE, EMPTY, PART, WHOLE = "no file", "empty", "part", "whole"


class Act(ABC):
    """Something done with a game in a folder of its own; `problems` says what a kill broke."""

    by: Sequence[str] = ("agent", "person")
    grows = True  # whether its file grows turn by turn; else it is there at once

    def fits(self, game: Game) -> bool:
        """Whether it can be done with a game."""
        return game.by in self.by

    @abstractmethod
    def words(self, game: Game) -> Sequence[str]:
        """What is done."""

    def typed(self, game: Game, folder: Path) -> Sequence[str]:
        """What is piped in."""
        return ()

    def before(self, game: Game) -> Mapping[str, bytes]:
        """The files that are there before."""
        return {}

    def prepare(self, game: Game, folder: Path) -> None:
        """Puts them in place."""
        for name, content in self.before(game).items():
            (folder / name).write_bytes(content)

    def file(self, folder: Path) -> Path:
        """The file that is written."""
        return folder / FILE

    @abstractmethod
    def faults(self, game: Game, folder: Path, told: str) -> Iterator[str]:
        """What is wrong after a kill, at which this had been printed, and after the next try."""

    @abstractmethod
    def left(self, game: Game, folder: Path) -> str:
        """How much of the file is there."""

    def again(self, game: Game, folder: Path) -> CompletedProcess[str]:
        """Does it once more."""
        return run(folder, *self.words(game), stdin=lines(self.typed(game, folder)))


class Play(Act):
    """A new game with a file of its own."""

    given = 0  # turns and events before the first that is played

    def words(self, game: Game) -> Sequence[str]:
        return (*game.words, "-o", FILE)

    def script(self, game: Game) -> Sequence[str]:
        """A line for each turn and event of the whole file."""
        return game.script

    def whole(self, game: Game) -> bytes:
        """The file of the act that nobody kills."""
        return unbroken(game)

    def typed(self, game: Game, folder: Path) -> Sequence[str]:
        return self.script(game)[max(events(_content(self.file(folder))), self.given) :]

    def left(self, game: Game, folder: Path) -> str:
        found = _content(self.file(folder))
        if not found:
            return EMPTY if self.file(folder).exists() else NONE
        return WHOLE if found == self.whole(game) else PART

    def faults(self, game: Game, folder: Path, told: str) -> Iterator[str]:
        found, whole = _content(self.file(folder)), self.whole(game)
        if not whole.startswith(found):
            yield "unequal: what is left is not how the game began"
        finished = len(TOLD.findall(told.partition("\nover")[0]))  # after it all is told again
        if finished and events(found) < self.given + finished:
            yield f"lost: {self.given + finished} turns were told, {events(found)} are kept"
        done = self.resumed(game, folder) if found != whole else None
        if done and done.returncode:
            yield f"lost: not resumed: {done.stderr.strip()}"
        if _content(self.file(folder)) != whole:
            yield "unequal: the game that was gone on with"

    def resumed(self, game: Game, folder: Path) -> CompletedProcess[str]:
        """Goes on, or begins again where nothing was left."""
        if not _content(self.file(folder)):
            return self.again(game, folder)
        typed = self.script(game)[events(_content(self.file(folder))) :]
        return run(folder, "resume", self.file(folder).name, stdin=lines(typed))


class Keep(Play):
    """A new game that is kept in the state folder."""

    by = ("person",)

    def words(self, game: Game) -> Sequence[str]:
        return game.words

    def file(self, folder: Path) -> Path:
        kept = sorted((folder / "state/dmplay/games").glob("*.dmt"), key=lambda each: each.name)
        return next((path for path in kept if path.stat().st_size), folder / "none")

    def resumed(self, game: Game, folder: Path) -> CompletedProcess[str]:
        typed = self.script(game)[events(_content(self.file(folder))) :]
        done = run(folder, "resume", stdin=lines(typed))
        if done.returncode == 2 and not events(_content(self.file(folder))):
            return run(folder, *game.words, stdin=lines(self.script(game)))
        return done


class Resume(Play):
    """A game gone on with."""

    given = HALF

    def words(self, game: Game) -> Sequence[str]:
        return ("resume", FILE)

    def before(self, game: Game) -> Mapping[str, bytes]:
        return {FILE: begun(unbroken(game), HALF)}


class Branch(Play):
    """A new game that begins as another did."""

    given = EARLY

    def words(self, game: Game) -> Sequence[str]:
        return ("branch", "other.dmt", "--at", str(EARLY), "-o", FILE)

    def before(self, game: Game) -> Mapping[str, bytes]:
        return {"other.dmt": unbroken(game)}

    def script(self, game: Game) -> Sequence[str]:
        return game.actions

    def whole(self, game: Game) -> bytes:
        return result(self, game)


class Save(Play):
    """A game of which a copy is saved on the way."""

    by = ("person",)

    def typed(self, game: Game, folder: Path) -> Sequence[str]:
        done = events(_content(folder / FILE))
        script = [*game.script[done:]]
        if done <= HALF and not (folder / COPY).exists():
            script.insert(HALF - done, f"save {COPY}")
        return script

    def faults(self, game: Game, folder: Path, told: str) -> Iterator[str]:
        owed = f"saved {COPY}" in told
        copy, whole = folder / COPY, begun(self.whole(game), HALF)
        if copy.exists() and copy.read_bytes() != whole:
            yield "unequal: the copy is not whole"
        if owed and not copy.exists():
            yield "lost: the copy that was told of"
        yield from super().faults(game, folder, told)

    def resumed(self, game: Game, folder: Path) -> CompletedProcess[str]:
        words = ("resume", FILE) if _content(folder / FILE) else self.words(game)
        return run(folder, *words, stdin=lines(self.typed(game, folder)))


class Replace(Act):
    """A file put in the place of an old one."""

    grows = False

    def old(self, game: Game) -> bytes:
        """What stood there before."""
        return b"mine"

    def left(self, game: Game, folder: Path) -> str:
        return WHOLE if self.file(folder).read_bytes() == result(self, game) else "old"

    def faults(self, game: Game, folder: Path, told: str) -> Iterator[str]:
        path, whole = self.file(folder), result(self, game)
        if _content(path) not in (self.old(game), whole):
            yield "unequal: neither the old file nor the new one"
        done = self.again(game, folder)
        if done.returncode:
            yield f"lost: cannot be done again, {done.returncode}: {done.stderr.strip()}"
        if _content(path) != whole:
            yield "unequal: what was done again"


class Update(Replace):
    """A transcript written as it would be today."""

    def words(self, game: Game) -> Sequence[str]:
        return ("verify", FILE, "--update")

    def old(self, game: Game) -> bytes:
        return unbroken(game).replace(b'"total": ', b'"total":  ')

    def before(self, game: Game) -> Mapping[str, bytes]:
        return {FILE: self.old(game)}


class Export(Replace):
    """A game as a screen recording."""

    def words(self, game: Game) -> Sequence[str]:
        return ("export", FILE, "--cast", "--force", "-o", "out")

    def before(self, game: Game) -> Mapping[str, bytes]:
        return {FILE: unbroken(game), "out": self.old(game)}

    def file(self, folder: Path) -> Path:
        return folder / "out"


ACTS: dict[str, Act] = {
    "play": Play(), "keep": Keep(), "resume": Resume(), "branch": Branch(), "save": Save(),
    "update": Update(), "export": Export(),
}  # fmt: skip


@cache
def result(act: Act, game: Game) -> bytes:
    """The file of an act that nobody kills."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        act.prepare(game, folder)
        done = act.again(game, folder)
        assert done.returncode == 0, done.stderr
        return act.file(folder).read_bytes()


def drafts(folder: Path) -> list[str]:
    """The files of writes that were not finished."""
    return [path.name for path in folder.rglob("*.tmp")]


def lines(typed: Sequence[str]) -> str:
    """What is piped in, as text."""
    return "".join(f"{line}\n" for line in typed)


def _content(path: Path) -> bytes:
    return path.read_bytes() if path.exists() else b""
