"""A case: an act upon a game, killed at a moment, and what came of it."""

import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random

from tests.kills import moments
from tests.kills.acts import ACTS, drafts, lines
from tests.kills.games import GAMES, Game
from tests.kills.moments import Fuse, Moment, Scale
from tests.support.programs import Around, Program, ended, started

KILLED = -9
ROW = 3  # kills of one game and act, after another


@dataclass(frozen=True)
class Case:
    """What is killed, and when; its name is enough to do it again."""

    game: Game
    act: str
    moment: Moment

    def __str__(self) -> str:
        return f"{self.game.problem}/{self.game.by}/{self.act}/{self.moment}"


@dataclass(frozen=True)
class Result:
    """What came of a case."""

    case: Case
    killed: bool  # else it had ended before
    left: str  # of its file
    faults: Sequence[str]


def named(name: str) -> Case:
    """The case of a name."""
    problem, by, act, moment = name.split("/")
    return Case(Game(problem, by), act, moments.read(moment))


def drawn(seed: int, number: int) -> Case:
    """The n-th case of a seed: games and acts in an order by lot, some moments of each."""
    pairs = [(g, act) for act, one in ACTS.items() for g in GAMES if one.fits(g)]
    Random(seed).shuffle(pairs)
    game, act = pairs[number // ROW % len(pairs)]
    return Case(game, act, moments.drawn(Random(f"{seed} {number}"), scale(game, act)))


@cache
def scale(game: Game, name: str) -> Scale:
    """How long the act takes where nobody kills it, and that it then comes out right."""
    act = ACTS[name]
    with tempfile.TemporaryDirectory() as place, tempfile.TemporaryDirectory() as streams:
        folder, tally = Path(place), Path(streams, "calls")
        act.prepare(game, folder)
        begin = time.perf_counter()
        code = ended(_begun(name, game, folder, Path(streams), Fuse(tally=tally)))
        assert code == 0, (game, name, Path(streams, "stderr").read_text())
        seconds = time.perf_counter() - begin
        told = Path(streams, "stdout").read_text()
        faults = [*act.faults(game, folder, told)]
        assert not faults, (game, name, faults)
        size = act.file(folder).stat().st_size if act.grows else 0
        return Scale(int(tally.read_text()), seconds, size)


def tried(case: Case) -> Result:
    """Does it, kills it, and looks at what is left."""
    act, game = ACTS[case.act], case.game
    with tempfile.TemporaryDirectory() as place, tempfile.TemporaryDirectory() as streams:
        folder = Path(place)
        act.prepare(game, folder)
        program = _begun(case.act, game, folder, Path(streams), case.moment.fuse)
        case.moment.wait(program, lambda: act.file(folder), scale(game, case.act))
        program.kill()
        code = ended(program)
        told = Path(streams, "stdout")
        left = act.left(game, folder)
        faults = [*act.faults(game, folder, told.read_text() if told.exists() else "")]
        faults += [f"left over: {name}" for name in drafts(folder)]
        return Result(case, code == KILLED, left, faults)


def _begun(name: str, game: Game, folder: Path, streams: Path, around: Around) -> Program:
    """The act under way."""
    act = ACTS[name]
    files = [streams / stream for stream in ("stdin", "stdout", "stderr")]
    files[0].write_text(lines(act.typed(game, folder)))
    return started(folder, *act.words(game), streams=files, around=around)
