"""Cases of kills: an act on a game, killed at a moment, and the result."""

import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random

from tests.crash_tests import kill_moments
from tests.crash_tests.actions import ACTS, find_temporary_files, join_lines
from tests.crash_tests.games import GAMES, Game
from tests.crash_tests.kill_moments import Fuse, Moment, Scale
from tests.support.fork_server import ProgramProcess, ProgramWrapper, wait_for_exit
from tests.support.programs import start_dmplay

KILLED_CODE = -9
KILLS_PER_ROW = 3  # consecutive kills of one game and act


@dataclass(frozen=True)
class Case:
    """A game, an act and the moment of its kill; its name is enough to repeat it."""

    game: Game
    act: str
    moment: Moment

    def __str__(self) -> str:
        return f"{self.game.problem}/{self.game.by}/{self.act}/{self.moment}"


@dataclass(frozen=True)
class Result:
    """The result of a case."""

    case: Case
    killed: bool  # False if the program had ended before
    left: str  # how much of the file exists
    faults: Sequence[str]


def parse_case(name: str) -> Case:
    """Parse the name of a case."""
    problem, by, act, moment = name.split("/")
    return Case(Game(problem, by), act, kill_moments.parse_moment(moment))


def sample_case(seed: int, number: int) -> Case:
    """Return the n-th case of a seed: shuffled pairs of game and act, with some moments of each."""
    pairs = [(g, act) for act, operation in ACTS.items() for g in GAMES if operation.fits(g)]
    Random(seed).shuffle(pairs)
    game, act = pairs[number // KILLS_PER_ROW % len(pairs)]
    return Case(
        game, act, kill_moments.sample_moment(Random(f"{seed} {number}"), measure_run(game, act))
    )


@cache
def measure_run(game: Game, name: str) -> Scale:
    """Measure an act that is not killed, and check that it has no faults."""
    act = ACTS[name]
    with tempfile.TemporaryDirectory() as folder_name, tempfile.TemporaryDirectory() as streams:
        folder, tally = Path(folder_name), Path(streams, "calls")
        act.prepare(game, folder)
        start_time = time.perf_counter()
        code = wait_for_exit(_start_act(name, game, folder, Path(streams), Fuse(tally=tally)))
        assert code == 0, (game, name, Path(streams, "stderr").read_text())
        seconds = time.perf_counter() - start_time
        output = Path(streams, "stdout").read_text()
        faults = [*act.faults(game, folder, output)]
        assert not faults, (game, name, faults)
        size = act.file(folder).stat().st_size if act.grows else 0
        return Scale(int(tally.read_text()), seconds, size)


def run_case(case: Case) -> Result:
    """Run a case, kill its program, and examine its files."""
    act, game = ACTS[case.act], case.game
    with tempfile.TemporaryDirectory() as folder_name, tempfile.TemporaryDirectory() as streams:
        folder = Path(folder_name)
        act.prepare(game, folder)
        program = _start_act(case.act, game, folder, Path(streams), case.moment.fuse)
        case.moment.wait(program, lambda: act.file(folder), measure_run(game, case.act))
        program.kill()
        code = wait_for_exit(program)
        output_path = Path(streams, "stdout")
        remains = act.left(game, folder)
        faults = [
            *act.faults(game, folder, output_path.read_text() if output_path.exists() else "")
        ]
        faults += [f"left over: {name}" for name in find_temporary_files(folder)]
        return Result(case, code == KILLED_CODE, remains, faults)


def _start_act(
    name: str, game: Game, folder: Path, streams: Path, around: ProgramWrapper
) -> ProgramProcess:
    """Start the act."""
    act = ACTS[name]
    files = [streams / stream for stream in ("stdin", "stdout", "stderr")]
    files[0].write_text(join_lines(act.typed(game, folder)))
    return start_dmplay(folder, *act.words(game), streams=files, around=around)
