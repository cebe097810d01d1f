"""Writing as the game goes: a block a turn, whole or not at all, by one program at a time."""

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

import dmplay
from dmplay.disk import is_locked_elsewhere
from dmplay.errors import BadParameter
from dmplay.game.checking import verify_file
from dmplay.transcript.header import Header
from dmplay.transcript.reading import read_transcript
from dmplay.transcript.recorder import Recorder
from tests.support.terminals import DMPLAY, clean_environment

HEADER = Header(problem="crying-baby", seats={"agent": "human"}, seed=7)
FEED, SING = 0, 1


def recorder(path: Path) -> Recorder:
    game = dmplay.Session(dmplay.load_problem("crying-baby"), HEADER.uniform_source)
    return Recorder.create(path, HEADER, game)


def turn(recorder: Recorder, action: int) -> None:
    recorder.session.advance([action])
    recorder.write_turn()


def test_a_turn_that_the_disk_cuts_is_written_whole_with_the_next(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    writing = recorder(path)
    before = path.read_bytes()
    least, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) + 9, most))
    try:
        turn(writing, FEED)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (least, most))
    assert os.strerror(28) in str(writing.write_error)
    assert path.read_bytes() == before
    turn(writing, SING)
    assert writing.write_error is None
    writing.write_end()
    assert [block["turn"] for block in read_transcript(path).blocks] == [0, 1, 2]


def test_after_the_end_nothing_more_is_written(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    writing = recorder(path)
    writing.session.end("quit")
    writing.write_end()
    whole = path.read_bytes()
    writing.write_end("# once more\n")
    writing.close()
    assert not writing.is_open
    assert path.read_bytes() == whole


def test_what_is_no_file_is_not_gone_on_with(tmp_path: Path) -> None:
    game = dmplay.Session(dmplay.load_problem("crying-baby"), HEADER.uniform_source)
    with pytest.raises(BadParameter, match=r"cannot write .*Is a directory"):
        Recorder.resume(tmp_path, "", game)


def test_where_files_cannot_be_locked_nobody_is_said_to_play(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "game.dmt"
    writing = recorder(path)
    with path.open("rb") as other:
        assert is_locked_elsewhere(other.fileno())
        monkeypatch.setitem(sys.modules, "fcntl", None)  # as on Windows
        assert not is_locked_elsewhere(other.fileno())
    monkeypatch.undo()
    writing.close()
    unlockable = os.open(path, os.O_PATH)
    assert not is_locked_elsewhere(unlockable)
    os.close(unlockable)


def test_header_and_opening_are_one_write(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    least, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (130, most))  # the header alone would fit
    try:
        writing = recorder(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (least, most))
    assert path.read_bytes() == b""
    turn(writing, FEED)
    writing.write_end()
    assert [block["turn"] for block in read_transcript(path).blocks] == [0, 1]


@pytest.mark.slow
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
    report = verify_file(tmp_path / "0.dmt")
    assert report.is_ok, str(report)
