"""Tests of assignments: files that fix the game and the seeds that all players play."""

from pathlib import Path

import pytest

from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.errors import BadFile, BadParameter, UnknownName
from dmplay.evaluation.assignment import read_assignment
from dmplay.game.command_line_results import PlayCommand
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest, ResumeRequest
from dmplay.game.transcript_verification import verify
from dmplay.transcript.reader import read_transcript as transcript

ASSIGNMENT_TEXT = """dmplay: 1
problem: "hexworld"
set: {"slip": 0.2}
seats: {"agent": "human"}
seeds: [8, 7]
turns: 3
strict: "hints"
"""


BLANK_NAMES = ("", " ", "   ", "\u2800", "\u3164 \u115f")


@pytest.fixture(autouse=True)
def _working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("walks").write_text(ASSIGNMENT_TEXT)


def parse_request(*arguments: str) -> GameRequest:
    """Parse the arguments of `dmplay play` into a game request."""
    command = interpret_command(["play", *arguments])
    assert isinstance(command, PlayCommand)
    assert isinstance(command.request, GameRequest)
    return command.request


def record_empty_game(*arguments: str) -> Path:
    """Start a game with these arguments, quit it at once and return its transcript file."""
    game = start_new_game(parse_request(*arguments))
    game.finish()
    assert game.recorder
    return game.recorder.path


ADA_ARGUMENTS = ("--assignment", "walks", "--player", "Ada Lovelace")


def test_an_assignment_is_the_header_of_its_games_with_all_seeds() -> None:
    arguments = "hexworld --set slip=0.2 --seeds 8,7 --turns 3 --strict=hints -o again"
    assert interpret_command(["assign", *arguments.replace("=hints", "-hints").split()]) == (
        "wrote again; to play: dmplay play --assignment again --player NAME"
    )
    assert Path("again").read_text() == ASSIGNMENT_TEXT
    assert interpret_command(["assign", "catch", "-o", "a ball"]) == (
        "wrote a ball; to play: dmplay play --assignment 'a ball' --player NAME"
    )


def test_an_assignment_without_seeds_uses_new_ones() -> None:
    interpret_command(["assign", "hexworld", "--games", "3", "-o", "new"])
    assert len({*read_assignment(Path("new")).seeds}) == 3


def test_the_games_of_an_assignment_are_played_one_after_another() -> None:
    first, second = record_empty_game(*ADA_ARGUMENTS), record_empty_game(*ADA_ARGUMENTS)
    assert [str(first), str(second)] == ["ada-lovelace-8.dmt", "ada-lovelace-7.dmt"]
    assert verify(first).is_ok
    assert verify(second).is_ok
    header = transcript(second).header
    assert (header.player, header.seed, header.turns) == ("Ada Lovelace", 7, 3)
    assert (header.strict, header.parameters) == ("hints", {"slip": 0.2})
    message = "walks: you have played all games; hand in ada-lovelace-8.dmt, ada-lovelace-7.dmt"
    with pytest.raises(BadParameter, match=message):
        parse_request(*ADA_ARGUMENTS)
    assert parse_request(*ADA_ARGUMENTS, "--seed", "7", "-o", "more.dmt").record_path == Path(
        "more.dmt"
    )


def parse_resumed_path(*arguments: str) -> Path:
    """Parse the arguments of `dmplay play` that resume a game; return its file."""
    command = interpret_command(["play", *arguments])
    assert isinstance(command, PlayCommand)
    assert isinstance(command.request, ResumeRequest)
    return command.request.path


def test_an_interrupted_game_is_resumed_first() -> None:
    start_new_game(parse_request(*ADA_ARGUMENTS)).finish("interrupted")
    assert parse_resumed_path(*ADA_ARGUMENTS) == Path("ada-lovelace-8.dmt")
    assert parse_resumed_path(*ADA_ARGUMENTS, "--seed", "8") == Path("ada-lovelace-8.dmt")
    assert parse_request(*ADA_ARGUMENTS, "--seed", "7").seed == 7
    assert parse_request(*ADA_ARGUMENTS, "--seed", "8", "--force").force


def test_an_interrupted_game_in_a_named_file_is_resumed() -> None:
    arguments = (*ADA_ARGUMENTS, "-o", "mine.dmt")
    start_new_game(parse_request(*arguments)).finish("interrupted")
    assert parse_resumed_path(*arguments) == Path("mine.dmt")


def test_the_game_of_another_assignment_is_not_resumed() -> None:
    start_new_game(parse_request(*ADA_ARGUMENTS)).finish("interrupted")
    Path("walks").write_text(ASSIGNMENT_TEXT.replace("turns: 3", "turns: 4"))
    message = r"ada-lovelace-8.dmt: not a game of walks \(different turns\); play in another folder"
    with pytest.raises(BadParameter, match=message):
        parse_request(*ADA_ARGUMENTS)


def test_the_header_has_a_player_line_only_if_the_player_is_named() -> None:
    path = record_empty_game("hexworld", "--seed", "7", "--player", 'A\n"b"', "-o", "g.dmt")
    assert 'player: "A\\n\\"b\\""' in path.read_text()
    assert transcript(path).header.player == 'A\n"b"'
    assert "player" not in record_empty_game("hexworld", "--seed", "7", "-o", "h.dmt").read_text()


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("play --assignment walks", "--assignment: got no player name; add --player NAME"),
        ("play --assignment none --player A", "none: No such file or directory"),
        ("play", "missing argument 'PROBLEM'; see dmplay play --help"),
        ("play 2048 --assignment walks --player A", "omit PROBLEM"),
        ("play --assignment walks --player A --set slip=0", "omit --set"),
        ("play --assignment walks --player A --ghost optimal", "omit --ghost"),
        ("play --assignment walks --player A --seed 1",
         "--seed: got 1, expected a seed of walks: 8, 7"),
        ("assign hexworld --seeds 7,x -o a", "--seeds: got '7,x', expected whole numbers"),
        ("assign hexworld --seeds 7,7 -o a", "--seeds: got 7, 7, expected distinct whole numbers"),
        (f"assign hexworld --seeds {2**63} -o a", f"numbers from 0 to {2**63 - 1}, such as"),
        ("assign hexworld --seeds 7,8 --games 3 -o a", "--games: got 3, but --seeds has 2"),
        ("assign hexworld --agent optimal -o a",
         "agents play all seats; leave a seat to a human player"),
        ("assign hexworld -o walks", "walks exists; give another name or use --force"),
        ("assign hexworld --vs grim -o a", "--vs: hexworld has only one seat"),
    ],
)  # fmt: skip
def test_assignment_commands_that_cannot_work_are_refused(command: str, message: str) -> None:
    with pytest.raises(BadParameter, match=message):
        interpret_command(command.split())


def test_options_for_people_or_transcripts_are_refused_in_games_of_agents() -> None:
    for arguments, message in (
        (("--player", "Ada"), "--player: no person plays this game"),
        (("--rate", "5"), "--rate: real time needs a human player; if only agents play, use"),
        (("--frames",), "--frames: no transcript is written; add -o FILE"),
    ):
        with pytest.raises(BadParameter, match=message):
            start_new_game(parse_request("hexworld", "--agent", "optimal", *arguments))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (ASSIGNMENT_TEXT.replace("seeds: [8, 7]", "seed: 8"),
         "walks:5:1: unknown key 'seed'; did you mean seeds"),
        (ASSIGNMENT_TEXT.replace("8, 7", '"8"'), "walks:1: seeds: expected distinct whole numbers"),
        (ASSIGNMENT_TEXT.replace("8, 7", f"{2**63}"),
         "walks:1: seeds: expected distinct whole numbers"),
        (ASSIGNMENT_TEXT.replace("turns: 3", "turn: 3"),
         "walks:6:1: unknown key 'turn'; did you mean turns"),
        (ASSIGNMENT_TEXT.replace("turns: 3", "turns: x"), "walks:6:8: expecting value"),
        (ASSIGNMENT_TEXT.replace("turns: 3", "turns: -3"),
         "walks:6: turns: expected a whole number"),
        (ASSIGNMENT_TEXT.replace('seats: {"agent": "human"}\n', ""), "the header has no seats"),
    ],
)  # fmt: skip
def test_an_error_in_an_assignment_names_the_line(content: str, message: str) -> None:
    Path("walks").write_text(content)
    with pytest.raises(BadFile, match=message):
        read_assignment(Path("walks"))


def test_a_binary_file_is_not_an_assignment() -> None:
    Path("walks").write_bytes(b"\xff")
    with pytest.raises(BadFile, match="not UTF-8"):
        read_assignment(Path("walks"))


@pytest.mark.parametrize(
    ("before", "after"), [('"hexworld"', '"./evil.py:Walk"'), ('"human"', '"./evil.py:Agent"')]
)
def test_an_assignment_never_runs_code_that_it_names(before: str, after: str) -> None:
    Path("evil.py").write_text("raise SystemExit('it ran')")
    Path("walks").write_text(ASSIGNMENT_TEXT.replace(before, after))
    with pytest.raises((BadParameter, UnknownName)):
        parse_request(*ADA_ARGUMENTS)


@pytest.mark.parametrize("name", BLANK_NAMES)
@pytest.mark.parametrize("game", [("--assignment", "walks"), ("hexworld",)])
def test_a_player_needs_a_visible_name(name: str, game: tuple[str, ...]) -> None:
    with pytest.raises(BadParameter, match=r"--player: got .*, expected a name with a visible"):
        interpret_command(["play", *game, "--player", name])
