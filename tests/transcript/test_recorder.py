"""Tests of writing transcripts: whole blocks, one per turn, by one process at a time."""

import os
import resource
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import dmplay
from dmplay.core import safe_files
from dmplay.core.safe_files import is_locked_elsewhere
from dmplay.errors import BadParameter
from dmplay.game.game import Game
from dmplay.game.game_setup import format_resume_command, start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.game.seats import HUMAN
from dmplay.game.transcript_verification import verify
from dmplay.transcript.header import Header
from dmplay.transcript.reader import read_transcript
from dmplay.transcript.recorder import Recorder
from tests.support.terminals import DMPLAY_COMMAND, clean_environment

HEADER = Header(problem="crying-baby", seats={"agent": "human"}, seed=7)
FEED, SING = 0, 1
EAST, WEST = 0, 3


def make_recorder(path: Path) -> Recorder:
    game = dmplay.Session(dmplay.load_problem("crying-baby"), HEADER.uniform_source)
    return Recorder.create(path, HEADER, game)


def play_turn(recorder: Recorder, action: int) -> None:
    recorder.session.advance([action])
    recorder.write_turn()


def test_a_turn_cut_by_a_full_disk_is_written_with_the_next_turn(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    writer = make_recorder(path)
    before = path.read_bytes()
    soft_limit, hard_limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) + 9, hard_limit))
    try:
        play_turn(writer, FEED)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft_limit, hard_limit))
    assert os.strerror(28) in str(writer.write_error)
    assert path.read_bytes() == before
    play_turn(writer, SING)
    assert writer.write_error is None
    writer.write_end()
    assert [block["turn"] for block in read_transcript(path).blocks] == [0, 1, 2]


def test_nothing_is_written_after_the_end(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    writer = make_recorder(path)
    writer.session.end("quit")
    writer.write_end()
    content = path.read_bytes()
    writer.write_end("# once more\n")
    writer.close()
    assert not writer.is_open
    assert path.read_bytes() == content


def test_the_content_of_a_game_with_its_end_is_that_of_its_closed_file(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    writer = make_recorder(path)
    play_turn(writer, FEED)
    writer.session.end("quit")
    content = writer.content_with_end
    assert content != path.read_text()
    writer.write_end()
    assert content == path.read_text() == writer.content_with_end


def test_a_folder_cannot_be_resumed(tmp_path: Path) -> None:
    game = dmplay.Session(dmplay.load_problem("crying-baby"), HEADER.uniform_source)
    with pytest.raises(BadParameter, match=r"cannot write .*Is a directory"):
        Recorder.resume(tmp_path, "", game)


def test_a_game_that_is_being_recorded_cannot_be_resumed(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    game = start_new_game(GameRequest("hexworld", seed=7, record_path=path))
    with pytest.raises(
        BadParameter, match=r"game\.dmt: this game is running, here or in another dmplay process"
    ):
        Recorder.resume(path, "", game.session)
    assert path.read_text().startswith("dmplay: 1\n")


def test_a_file_that_cannot_be_locked_counts_as_not_in_use(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "game.dmt"
    writer = make_recorder(path)
    with path.open("rb") as file:
        assert is_locked_elsewhere(file.fileno())
        monkeypatch.setitem(sys.modules, "fcntl", None)  # as on Windows
        assert not is_locked_elsewhere(file.fileno())
    monkeypatch.undo()
    writer.close()
    unlockable = os.open(path, os.O_PATH)
    assert not is_locked_elsewhere(unlockable)
    os.close(unlockable)


def test_the_header_and_first_block_are_one_write(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    soft_limit, hard_limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (130, hard_limit))  # the header alone would fit
    try:
        writer = make_recorder(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft_limit, hard_limit))
    assert path.read_bytes() == b""
    play_turn(writer, FEED)
    writer.write_end()
    assert [block["turn"] for block in read_transcript(path).blocks] == [0, 1]


FULL_LINE = (
    "over: interrupted after {} turns. "
    "the transcript is full, because dmplay reads at most 64 MB. agent score"
)


def make_long_game(path: Path, **settings: Any) -> Game:
    request = GameRequest(
        "crying-baby", agent="feed-when-crying", turns=1000, seed=7, record_path=path
    )
    return start_new_game(replace(request, **settings))


@pytest.mark.parametrize("settings", [{}, {"record_frames": True}, {"agent": "random"}])
def test_a_game_ends_when_its_transcript_is_as_large_as_can_be_verified(
    settings: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(safe_files, "MAX_FILE_BYTES", 64_000)
    path = tmp_path / "long.dmt"
    game = make_long_game(path, **settings)
    for _ in game.iter_agent_turns():
        pass
    game.finish()
    turn_count = len(game.session.turns)
    assert 10 < turn_count < 1000
    lines = game.narrator.closing_lines()
    assert any(line.startswith(FULL_LINE.format(turn_count)) for line in lines)
    assert format_resume_command(game) == ""
    assert path.read_text().endswith(
        "\n# the transcript is full, because dmplay reads at most 64 MB\n"
    )
    report = verify(path)
    assert report.is_ok, str(report)
    assert report.turns == turn_count


def test_a_person_can_take_back_the_turn_that_filled_a_transcript(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(safe_files, "MAX_FILE_BYTES", 64_000)
    path = tmp_path / "long.dmt"
    game = make_long_game(path, problem="hexworld", settings=["rewards=[]"], agent=HUMAN)
    while not game.session.over:
        game.choose(EAST)
    turn_count = len(game.session.turns)
    game.undo()
    game.choose(WEST)
    game.finish()
    assert len(game.session.turns) == turn_count
    assert game.narrator.closing_lines()[0].startswith(
        f"over: interrupted after {turn_count} turns. the transcript is full"
    )
    report = verify(path)
    assert report.is_ok, str(report)


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
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
    arguments: tuple[str, ...], tmp_path: Path
) -> None:
    environments = (
        {"PYTHONHASHSEED": "1", "LC_ALL": "C", "LANG": "C", "OPENBLAS_NUM_THREADS": "1"},
        {"PYTHONHASHSEED": "2", "LC_ALL": "C.UTF-8", "OPENBLAS_NUM_THREADS": "2"},
        {"PYTHONHASHSEED": "3", "LANG": "de_DE.UTF-8", "TZ": "Asia/Tokyo", "COLUMNS": "40"},
    )
    files = []
    for number, environment in enumerate(environments):
        subprocess.run(
            [
                *DMPLAY_COMMAND,
                *arguments,
                "--seed",
                "7",
                "--frames",
                "--quiet",
                "-o",
                f"{number}.dmt",
            ],
            env=clean_environment(tmp_path, **environment),
            cwd=tmp_path,
            check=True,
        )
        files.append((tmp_path / f"{number}.dmt").read_bytes())
    assert files[0] == files[1] == files[2]
    report = verify(tmp_path / "0.dmt")
    assert report.is_ok, str(report)
