"""A game that is killed at any moment loses no finished turn, and its bytes depend on nothing else.

The game is long and plays itself: 2048 in a corner, some hundred turns.
"""

import os
import random
import signal
import subprocess
import time
from pathlib import Path

import pytest

from dmplay.game.checking import check
from tests.support.programs import ended, run, started
from tests.support.terminals import DMPLAY, clean_environment

pytestmark = pytest.mark.slow

GAME = ("2048", "--agent", "corner", "--seed", "8", "--quiet", "-o")
DICE = random.Random(2048)
MOMENTS = [DICE.random() for _ in range(50)]  # when to kill, as shares of the whole file


def played(*words: str, folder: Path) -> None:
    """Runs to the end, and well."""
    done = run(folder, *words)
    assert done.returncode == 0, done.stderr


def killed(*words: str, size: float, folder: Path) -> bytes:
    """Runs until the transcript has this size, and kills: what is then left of it."""
    path = folder / "game.dmt"
    program = started(folder, *words)
    while program.is_alive() and not (path.exists() and path.stat().st_size >= size):
        time.sleep(0.0001)
    program.kill()
    ended(program)
    return path.read_bytes()


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The unbroken game."""
    folder = tmp_path_factory.mktemp("whole")
    played(*GAME, "game.dmt", folder=folder)
    report = check(folder / "game.dmt")
    assert report.ok, str(report)
    assert report.turns > 100
    return (folder / "game.dmt").read_bytes()


@pytest.mark.parametrize("share", MOMENTS)
def test_a_killed_game_loses_no_finished_turn_and_ends_as_if_unbroken(
    share: float, whole: bytes, tmp_path: Path
) -> None:
    path = tmp_path / "game.dmt"
    left = killed(*GAME, "game.dmt", size=share * len(whole), folder=tmp_path)
    assert len(left) >= share * len(whole)
    assert whole.startswith(left)  # nothing is wrong or out of order
    report = check(path)
    assert report.ok or report.unfinished, str(report)
    assert report.turns == left.count(b"\n\n") - 2  # the header and the opening are blocks too
    if not report.ok:
        played("resume", "game.dmt", "--quiet", folder=tmp_path)
    assert path.read_bytes() == whole


def test_a_game_killed_twice_ends_as_if_unbroken(whole: bytes, tmp_path: Path) -> None:
    third = len(whole) / 3
    first = killed(*GAME, "game.dmt", size=third, folder=tmp_path)
    second = killed("resume", "game.dmt", "--quiet", size=2 * third, folder=tmp_path)
    assert third <= len(first) < len(second) < len(whole)
    played("resume", "game.dmt", "--quiet", folder=tmp_path)
    assert (tmp_path / "game.dmt").read_bytes() == whole


@pytest.mark.parametrize("cut", [1, 17, 64, 65, 66, 90, 200])
def test_a_torn_tail_is_cut_and_the_turn_played_again(
    cut: int, whole: bytes, tmp_path: Path
) -> None:
    (tmp_path / "game.dmt").write_bytes(whole[:-cut])
    played("resume", "game.dmt", "--quiet", folder=tmp_path)
    assert (tmp_path / "game.dmt").read_bytes() == whole


@pytest.mark.parametrize(
    "words",
    [
        ("2048", "--agent", "corner"),
        ("hexworld", "--agent", "optimal"),
        ("hexworld", "--agent", "random", "--set", "rewards=[]", "--turns", "50"),
        ("crying-baby", "--agent", "feed-when-crying", "--turns", "50"),
        ("prisoners-dilemma", "--agent", "random", "--vs", "grim", "--turns", "50"),
    ],
    ids=" ".join,
)
def test_the_same_seed_gives_the_same_bytes_in_every_process(
    words: tuple[str, ...], tmp_path: Path
) -> None:
    worlds = (
        {"PYTHONHASHSEED": "1", "LC_ALL": "C", "LANG": "C", "OPENBLAS_NUM_THREADS": "1"},
        {"PYTHONHASHSEED": "2", "LC_ALL": "C.UTF-8", "OPENBLAS_NUM_THREADS": "2"},
        {"PYTHONHASHSEED": "3", "LANG": "de_DE.UTF-8", "TZ": "Asia/Tokyo", "COLUMNS": "40"},
    )
    files = []
    for number, world in enumerate(worlds):
        subprocess.run(
            [*DMPLAY, *words, "--seed", "7", "--frames", "--quiet", "-o", f"{number}.dmt"],
            env=clean_environment(tmp_path, **world), cwd=tmp_path, check=True,
        )  # fmt: skip
        files.append((tmp_path / f"{number}.dmt").read_bytes())
    assert files[0] == files[1] == files[2]
    report = check(tmp_path / "0.dmt")
    assert report.ok, str(report)


@pytest.mark.parametrize("moment", range(9))
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_game_that_a_signal_ends_is_whole_and_verifies(
    number: int, moment: int, tmp_path: Path
) -> None:
    words = ("cart-pole", "--agent", "balance", "--turns", "9000", "--quiet", "-o", "game.dmt")
    file = tmp_path / "game.dmt"
    game = started(tmp_path, *words)
    while not (file.exists() and file.stat().st_size > 2000):
        time.sleep(0.002)
    time.sleep(0.03 * moment)
    assert game.pid
    os.kill(game.pid, number)
    assert ended(game) in (128 + number, 0)
    assert check(file).ok


@pytest.mark.parametrize("moment", range(8))
@pytest.mark.parametrize("old", ["mine", None])
def test_what_is_written_of_a_game_is_whole_or_not_there_after_a_kill(
    moment: int, old: str | None, tmp_path: Path
) -> None:
    played("hexworld", "--agent", "random", "--quiet", "-o", "g.dmt", folder=tmp_path)
    export = ("export", "g.dmt", "--film", "--force", "-o")
    played(*export, "whole", folder=tmp_path)
    out = tmp_path / "out"
    if old:
        out.write_text(old)
    before = {*tmp_path.iterdir()}
    program = started(tmp_path, *export, "out")
    program.join(0.03 * moment)
    program.kill()
    ended(program)
    whole = (tmp_path / "whole").read_text()
    assert (out.read_text() if out.exists() else None) in (old, whole)
    assert {*tmp_path.iterdir()} - before <= {out}
