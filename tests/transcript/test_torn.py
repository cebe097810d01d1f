"""A torn transcript: cut by resume; before its first turn, said to be so and begun anew."""

from pathlib import Path

import pytest

from dmplay.errors import BadTranscript
from dmplay.game.request import ResumeRequest
from dmplay.game.start import resume_game
from dmplay.transcript.reading import read_transcript
from tests.support.games import recorded
from tests.support.programs import run

TORN = "torn before its first turn; dmplay resume begins it"


@pytest.fixture
def whole(tmp_path: Path) -> str:
    """An unbroken game of hexworld, of which each test finds a torn file."""
    path = tmp_path / "whole.dmt"
    recorded(path, "hexworld", "random", turns=3)
    text = path.read_text()
    path.unlink()
    header, opening = text.split("\n\n")[:2]
    (tmp_path / "h.dmt").write_text(f"{header}\n\n{opening[:9]}")
    return text


def go_on(path: Path) -> None:
    """Resumes a game without people, and plays it to its end."""
    game = resume_game(ResumeRequest(path))
    list(game.iter_agent_turns())
    game.finish()


@pytest.mark.parametrize(
    "words",
    [
        ("verify",), ("replay",), ("review",), ("export", "--csv"),
        ("branch", "--at", "0", "-o", "b.dmt"), ("verify", "--update"),
    ],
    ids=" ".join,
)  # fmt: skip
def test_it_is_said_to_be_so_in_one_line(
    words: tuple[str, ...], whole: str, tmp_path: Path
) -> None:
    done = run(tmp_path, *words, "h.dmt")
    assert done.returncode in (2, 3)
    first = (done.stderr + done.stdout).splitlines()[0]
    assert first.removeprefix("error: ").removeprefix("not rewritten: ").startswith("h.dmt:7:")
    assert TORN in first


def test_the_reader_refuses_it_with_its_line(whole: str, tmp_path: Path) -> None:
    with pytest.raises(BadTranscript, match=f":7: {TORN}"):
        read_transcript(tmp_path / "h.dmt")
    (tmp_path / "h.dmt").write_text(whole)
    assert len(read_transcript(tmp_path / "h.dmt").blocks) == 4


@pytest.mark.parametrize("tail", ["", "turn: 0\ndraws: [0."])
def test_resume_begins_the_game_it_names(tail: str, whole: str, tmp_path: Path) -> None:
    path = tmp_path / "h.dmt"
    header = whole.partition("\n\n")[0]
    path.write_text(f"{header}\n\n{tail}")
    go_on(path)
    assert path.read_text() == whole


@pytest.mark.parametrize("cut", [1, 17, 64, 65, 66, 90, 200])
def test_a_torn_tail_is_cut_and_the_turn_played_again(cut: int, whole: str, tmp_path: Path) -> None:
    path = tmp_path / "h.dmt"
    path.write_text(whole[:-cut])
    go_on(path)
    assert path.read_text() == whole


def test_it_silences_no_other_file(whole: str, tmp_path: Path) -> None:
    (tmp_path / "z.dmt").write_text(whole)
    done = run(tmp_path, "verify", ".")
    assert done.returncode == 3
    assert TORN in done.stdout
    assert done.stdout.endswith("ok z.dmt (3 turns)\n1 verified, 1 failed\n")


def test_it_is_not_what_resume_goes_on_with(whole: str, tmp_path: Path) -> None:
    run(tmp_path, "hexworld", "--seed", "7", stdin="e\nquit\n")
    kept = tmp_path / "state" / "dmplay" / "games"
    (tmp_path / "h.dmt").rename(kept / "torn.dmt")
    done = run(tmp_path, "resume", stdin="quit\n")
    assert done.returncode == 0, done.stderr
    assert "-hexworld.dmt" in done.stderr
