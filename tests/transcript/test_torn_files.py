"""Tests of torn transcripts: resume cuts the torn tail, or restarts a game torn before turn 1."""

from pathlib import Path

import pytest

from dmplay.errors import BadTranscript
from dmplay.game.game_setup import resume_game
from dmplay.game.launch_requests import ResumeRequest
from dmplay.transcript.reader import read_transcript
from tests.support.games import record_game
from tests.support.programs import run_dmplay

TORN_MESSAGE = "cut off before its first turn; dmplay resume starts the game"


@pytest.fixture
def complete_text(tmp_path: Path) -> str:
    """The text of a complete game of hexworld; the folder contains the torn file h.dmt."""
    path = tmp_path / "whole.dmt"
    record_game(path, "hexworld", "random", turns=3)
    text = path.read_text()
    path.unlink()
    header, first_block = text.split("\n\n")[:2]
    (tmp_path / "h.dmt").write_text(f"{header}\n\n{first_block[:9]}")
    return text


def resume_to_end(path: Path) -> None:
    """Resume a game without people and play it to its end."""
    game = resume_game(ResumeRequest(path))
    list(game.iter_agent_turns())
    game.finish()


@pytest.mark.parametrize(
    "arguments",
    [
        ("verify",), ("replay",), ("review",), ("export", "--csv"),
        ("branch", "--at", "0", "-o", "b.dmt"), ("verify", "--update"),
    ],
    ids=" ".join,
)  # fmt: skip
def test_a_torn_file_is_reported_in_one_line(
    arguments: tuple[str, ...], complete_text: str, tmp_path: Path
) -> None:
    process = run_dmplay(tmp_path, *arguments, "h.dmt")
    assert process.returncode in (2, 3)
    first_line = (process.stderr + process.stdout).splitlines()[0]
    assert first_line.removeprefix("error: ").removeprefix("not rewritten: ").startswith("h.dmt:7:")
    assert TORN_MESSAGE in first_line


def test_the_reader_rejects_a_torn_file_with_its_line(complete_text: str, tmp_path: Path) -> None:
    with pytest.raises(BadTranscript, match=f":7: {TORN_MESSAGE}"):
        read_transcript(tmp_path / "h.dmt")
    (tmp_path / "h.dmt").write_text(complete_text)
    assert len(read_transcript(tmp_path / "h.dmt").blocks) == 4


@pytest.mark.parametrize("tail", ["", "turn: 0\ndraws: [0."])
def test_resume_restarts_the_game_that_the_header_names(
    tail: str, complete_text: str, tmp_path: Path
) -> None:
    path = tmp_path / "h.dmt"
    header = complete_text.partition("\n\n")[0]
    path.write_text(f"{header}\n\n{tail}")
    resume_to_end(path)
    assert path.read_text() == complete_text


@pytest.mark.parametrize("cut", [2, 17, 64, 65, 66, 90, 200])
def test_a_torn_tail_is_cut_and_its_turn_replayed(
    cut: int, complete_text: str, tmp_path: Path
) -> None:
    path = tmp_path / "h.dmt"
    path.write_text(complete_text[:-cut])
    resume_to_end(path)
    assert path.read_text() == complete_text


def test_a_torn_file_does_not_hide_reports_of_other_files(
    complete_text: str, tmp_path: Path
) -> None:
    (tmp_path / "z.dmt").write_text(complete_text)
    process = run_dmplay(tmp_path, "verify", ".")
    assert process.returncode == 3
    assert TORN_MESSAGE in process.stdout
    assert process.stdout.endswith("ok z.dmt (3 turns)\n1 verified, 1 failed\n")


def test_resume_without_a_name_skips_a_torn_file(complete_text: str, tmp_path: Path) -> None:
    run_dmplay(tmp_path, "hexworld", "--seed", "7", stdin="e\nquit\n")
    games_folder = tmp_path / "state" / "dmplay" / "games"
    (tmp_path / "h.dmt").rename(games_folder / "torn.dmt")
    process = run_dmplay(tmp_path, "resume", stdin="quit\n")
    assert process.returncode == 0, process.stderr
    assert "-hexworld.dmt" in process.stderr
