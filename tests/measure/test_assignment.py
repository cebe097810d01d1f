"""Assignments: what all are to play is one file, and each of them plays it, and no other."""

from pathlib import Path

import pytest

from dmplay.cli.errands import interpret_command
from dmplay.errors import BadFile, BadParameter, UnknownName
from dmplay.game.checking import verify_file
from dmplay.game.errand import PlayCommand
from dmplay.game.request import GameRequest
from dmplay.game.start import start_new_game
from dmplay.measure.assignment import read_assignment
from dmplay.transcript.reading import read_transcript as transcript

WALKS = """dmplay: 1
problem: "hexworld"
set: {"slip": 0.2}
seats: {"agent": "human"}
seeds: [8, 7]
turns: 3
strict: "hints"
"""


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("walks").write_text(WALKS)


def request(*words: str) -> GameRequest:
    """The game that these words ask for."""
    sitting = interpret_command(["play", *words])
    assert isinstance(sitting, PlayCommand)
    assert isinstance(sitting.request, GameRequest)
    return sitting.request


def played(*words: str) -> Path:
    """The file of the game that these words ask for, left at once."""
    game = start_new_game(request(*words))
    game.finish()
    assert game.recorder
    return game.recorder.path


ADA = ("--assignment", "walks", "--player", "Ada Lovelace")


def test_an_assignment_is_the_header_of_its_games_with_all_seeds() -> None:
    words = "hexworld --set slip=0.2 --seeds 8,7 --turns 3 --strict=hints -o again"
    assert interpret_command(["assign", *words.replace("=hints", "-hints").split()]) == (
        "wrote again; dmplay play --assignment again --player NAME"
    )
    assert Path("again").read_text() == WALKS
    assert interpret_command(["assign", "catch", "-o", "a ball"]) == (
        "wrote a ball; dmplay play --assignment 'a ball' --player NAME"
    )


def test_dice_that_are_not_said_are_new_ones() -> None:
    interpret_command(["assign", "hexworld", "--games", "3", "-o", "new"])
    assert len({*read_assignment(Path("new")).seeds}) == 3


def test_the_games_of_an_assignment_are_played_one_after_another() -> None:
    first, second = played(*ADA), played(*ADA)
    assert [str(first), str(second)] == ["ada-lovelace-8.dmt", "ada-lovelace-7.dmt"]
    assert verify_file(first).is_ok
    assert verify_file(second).is_ok
    header = transcript(second).header
    assert (header.player, header.seed, header.turns) == ("Ada Lovelace", 7, 3)
    assert (header.strict, header.parameters) == ("hints", {"slip": 0.2})
    told = "walks: you played it all; hand in ada-lovelace-8.dmt, ada-lovelace-7.dmt"
    with pytest.raises(BadParameter, match=told):
        request(*ADA)
    assert request(*ADA, "--seed", "7", "-o", "more.dmt").record_path == Path("more.dmt")


def test_a_game_that_was_interrupted_is_to_be_gone_on_with() -> None:
    start_new_game(request(*ADA)).finish("interrupted")
    with pytest.raises(BadParameter, match=r"ada-lovelace-8.dmt is unfinished; dmplay resume ada"):
        request(*ADA)


def test_a_player_is_named_in_the_header_and_old_files_have_no_such_line() -> None:
    path = played("hexworld", "--seed", "7", "--player", 'A\n"b"', "-o", "g.dmt")
    assert 'player: "A\\n\\"b\\""' in path.read_text()
    assert transcript(path).header.player == 'A\n"b"'
    assert "player" not in played("hexworld", "--seed", "7", "-o", "h.dmt").read_text()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("play --assignment walks", "--assignment: expected --player NAME too"),
        ("play --assignment none --player A", "none: No such file or directory"),
        ("play", "missing argument 'PROBLEM'; see dmplay play --help"),
        ("play 2048 --assignment walks --player A", "leave out PROBLEM"),
        ("play --assignment walks --player A --set slip=0", "leave out --set"),
        ("play --assignment walks --player A --ghost optimal", "leave out --ghost"),
        ("play --assignment walks --player A --seed 1", "--seed: got 1, walks has 8, 7"),
        ("assign hexworld --seeds 7,x -o a", "--seeds: got '7,x', expected whole numbers"),
        ("assign hexworld --seeds 7,7 -o a", "--seeds: got 7, 7, expected whole numbers, each"),
        (f"assign hexworld --seeds {2**63} -o a", f"each another, at most {2**63 - 1}, such as"),
        ("assign hexworld --seeds 7,8 --games 3 -o a", "--games: got 3, but --seeds says how many"),
        ("assign hexworld --agent optimal -o a", "no person plays; leave a seat to one"),
        ("assign hexworld -o walks", "walks exists; give another name, or --force"),
        ("assign hexworld --vs grim -o a", "--vs: hexworld has one seat only"),
    ],
)
def test_what_cannot_be_assigned_or_played_so_is_one_line(words: str, told: str) -> None:
    with pytest.raises(BadParameter, match=told):
        interpret_command(words.split())


def test_what_is_for_people_or_a_transcript_is_refused_where_agents_play_alone() -> None:
    for words, told in (
        (("--player", "Ada"), "--player: no person plays this game"),
        (("--rate", "5"), "--rate: real time is for people; agents alone play at --speed"),
        (("--frames",), "--frames: no transcript is written; add -o FILE"),
    ):
        with pytest.raises(BadParameter, match=told):
            start_new_game(request("hexworld", "--agent", "optimal", *words))


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (
            WALKS.replace("seeds: [8, 7]", "seed: 8"),
            "walks:5:1: unknown key 'seed'; did you mean seeds",
        ),
        (WALKS.replace("8, 7", '"8"'), "walks:1: seeds: expected whole numbers"),
        (WALKS.replace("8, 7", f"{2**63}"), "walks:1: seeds: expected whole numbers"),
        (WALKS.replace("turns: 3", "turn: 3"), "walks:6:1: unknown key 'turn'; did you mean turns"),
        (WALKS.replace("turns: 3", "turns: x"), "walks:6:8: expecting value"),
        (WALKS.replace("turns: 3", "turns: -3"), "walks:6: turns: expected a whole number"),
        (WALKS.replace('seats: {"agent": "human"}\n', ""), "the header has no seats"),
    ],
)
def test_a_fault_of_an_assignment_is_told_with_its_line(content: str, told: str) -> None:
    Path("walks").write_text(content)
    with pytest.raises(BadFile, match=told):
        read_assignment(Path("walks"))


def test_what_is_no_text_is_no_assignment() -> None:
    Path("walks").write_bytes(b"\xff")
    with pytest.raises(BadFile, match="not UTF-8"):
        read_assignment(Path("walks"))


@pytest.mark.parametrize(
    ("before", "after"),
    [('"hexworld"', '"./evil.py:Walk"'), ('"human"', '"./evil.py:Agent"')],
)
def test_an_assignment_from_elsewhere_runs_no_code(before: str, after: str) -> None:
    Path("evil.py").write_text("raise SystemExit('it ran')")
    Path("walks").write_text(WALKS.replace(before, after))
    with pytest.raises((BadParameter, UnknownName)):
        request(*ADA)
