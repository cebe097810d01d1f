"""Tests of games played over MCP: permitted calls, answers and transcripts."""

import re
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from dmplay.cli.parsed_command_runner import execute_result, interpret_command
from dmplay.errors import BadParameter, DmplayError
from dmplay.game import saves
from dmplay.game.command_line_results import McpServerConfig
from dmplay.game.completion import name_lists
from dmplay.game.game import Game
from dmplay.game.game_setup import start_game
from dmplay.game.launch_requests import ResumeRequest
from dmplay.game.transcript_verification import verify
from dmplay.servers.mcp.language_model_games import MAX_GAMES, ModelGames
from dmplay.transcript.concealment import mark_peeked_if_concealed
from dmplay.transcript.reader import read_transcript
from tests.privacy.indistinguishable_pairs import SHARED_TURNS, TURN_COUNT, Pair, Side, find_pair
from tests.support.games import assert_verified, read_values

SEED = 5  # with this seed, down is illegal in the first board of 2048


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "games"


def make_games(folder: Path, *names: str, hints: bool = True, undo: bool = True) -> ModelGames:
    return ModelGames(McpServerConfig(names, hints, undo, seed=SEED, transcript_folder=folder))


def find_transcript(folder: Path) -> Path:
    (path,) = folder.glob("*.dmt")
    return path


def test_each_turn_is_reported_and_the_transcript_names_the_seat_mcp(folder: Path) -> None:
    games = make_games(folder)
    first = games.start_game("crying-baby")
    assert (first["game"], first["seat"], first["observation"]) == ("g1", "agent", None)
    assert first["legal"] == ["feed", "sing", "ignore"]
    assert first["turns"] == [{"turn": 0, "observation": None}]
    answer = games.play_action("g1", "feed", turn=1)
    assert answer["turns"] == [{"turn": 1, "action": "feed", "observation": "quiet"}]
    assert games.get_hint("g1")["action"] == "ignore"
    assert games.undo_turns("g1")["turn"] == 0
    assert games.play_action("g1", "feed")["turns"] == answer["turns"]
    assert games.game_status("g1")["turns"] == []
    assert games.game_status("g1", history=True)["turns"] == [*first["turns"], *answer["turns"]]
    end = games.end_game("g1")
    assert (end["reason"], end["turns"], end["help"]) == ("quit", 1, {"agent": 1})
    assert isinstance(end["debrief"], list)
    assert [row["state"] for row in end["debrief"]] == ["hungry", "sated"]
    assert games.game_status("g1")["ending"].startswith("quit after 1 turn. agent score")
    path = assert_verified(find_transcript(folder))
    assert read_values(path, "seats") == ['{"agent": "mcp"}']
    assert verify(path).unchecked_players == ["mcp"]


def test_a_client_may_take_any_seat_against_built_in_agents(folder: Path) -> None:
    games = make_games(folder)
    assert games.start_game("prisoners-dilemma", "agent2", "grim")["seat"] == "agent2"
    turn = games.play_action("g1", "defect")["turns"][0]
    assert turn["actions"] == {"agent1": "cooperate", "agent2": "defect"}
    for others in ("nobody", "human", "mcp", "script:feed", "bot:sh", "./evil.py:X"):
        with pytest.raises(DmplayError, match=r"^unknown agent"):
            games.start_game("prisoners-dilemma", others=others)
    with pytest.raises(DmplayError, match="expected none: there is only one seat"):
        games.start_game("catch", others="greedy")
    assert games.start_game("travelers-dilemma")["seat"] == "agent1"
    assert isinstance(games.play_action("g2", "50")["turns"][0]["reward"], float)
    assert games.start_game("simple-regulator")["legal"] == {"low": -10.0, "high": 10.0}
    assert games.play_action("g3", "0.25")["turns"][0]["action"] == 0.25


def test_invalid_calls_raise_one_line_errors_and_change_nothing(folder: Path) -> None:
    games = make_games(folder)
    start = games.start_game("2048")
    invalid_calls: dict[str, Callable[[], object]] = {
        "unknown game 'g2'; did you mean g1?": lambda: games.play_action("g2", "left"),
        "down moves no tile; expected one of": lambda: games.play_action("g1", "down"),
        "unknown action '1'": lambda: games.play_action("g1", "1"),
        "turn: got 2, expected 1": lambda: games.play_action("g1", "left", turn=2),
        "undo: no turn was played": lambda: games.undo_turns("g1"),
        "unknown problem '../2048'": lambda: games.start_game("../2048"),
        "unknown problem '2048; rm -r .'": lambda: games.start_game("2048; rm -r ."),
        "unknown problem './evil.py:X'": lambda: games.problem_info("./evil.py:X"),
        "unknown seat 'agent9'": lambda: games.start_game("catch", "agent9"),
    }
    for message, call in invalid_calls.items():
        with pytest.raises(DmplayError, match=re.escape(message)) as error:
            call()
        assert "\n" not in str(error.value)
    assert games.game_status("g1", history=True) == start
    games.end_game("g1")
    with pytest.raises(DmplayError, match=r"the game is over \(quit\)"):
        games.play_action("g1", "left")
    with pytest.raises(DmplayError, match="dmplay_undo: the game is over"):
        games.undo_turns("g1")
    with pytest.raises(DmplayError, match="no hint: the game is over"):
        games.get_hint("g1")
    assert_verified(find_transcript(folder))


@pytest.mark.parametrize("is_saved", [False, True])
def test_a_refused_game_changes_no_file_and_no_later_game(
    folder: Path, is_saved: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    saves_folder = saves.saves_folder({"XDG_STATE_HOME": str(folder.parent / "state")})
    transcripts = saves_folder if is_saved else folder
    games = ModelGames(McpServerConfig(seed=SEED, transcript_folder=None if is_saved else folder))
    for _ in range(MAX_GAMES):
        games.start_game("hexworld")
    games.end_game("g1")
    files = {path.name: path.read_bytes() for path in transcripts.glob("*")}
    for others in (
        "nobody", "human", "search:depth=100000000", "search:depth=0", "search:depth=x",
        "search:no=1", "level-k:level=-1", "random:1", "grim:2", "axelrod:Nobody",
        "search:simulations=0", ":", "bot:sh", "script:", "optimal:=",
    ):  # fmt: skip
        for seat in ("", "agent2"):
            with pytest.raises(DmplayError):
                games.start_game("prisoners-dilemma", seat, others)
    for arguments in (("nothing",), ("catch", "agent9"), ("catch", "", "random")):
        with pytest.raises(DmplayError):
            games.start_game(*arguments)
    with monkeypatch.context() as patched:
        patched.setattr(Game, "play_until_choice", lambda game: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            games.start_game("catch")
    assert {path.name: path.read_bytes() for path in transcripts.glob("*")} == files
    assert games.game_status("g1")["ending"]  # still there, until a game takes its place
    assert games.start_game("catch")["game"] == f"g{MAX_GAMES + 1}"
    newest = max(transcripts.glob("*catch.dmt"))
    assert read_transcript(newest).header.episode == MAX_GAMES


def test_the_number_of_games_is_limited_and_the_first_finished_game_is_removed(
    folder: Path,
) -> None:
    games = make_games(folder)
    for _ in range(MAX_GAMES):
        games.start_game("hexworld")
    for _ in range(3):
        with pytest.raises(BadParameter, match=f"^{MAX_GAMES} games are running; end one of them"):
            games.start_game("hexworld")
    games.end_game("g3")
    assert games.start_game("hexworld")["game"] == f"g{MAX_GAMES + 1}"
    with pytest.raises(DmplayError, match="unknown game 'g3'"):
        games.game_status("g3")
    games.end_all_games()
    assert len([assert_verified(path) for path in folder.glob("*.dmt")]) == MAX_GAMES + 1


def test_finished_games_are_closed_and_games_of_one_seed_are_episodes(folder: Path) -> None:
    games = make_games(folder)
    for number in range(2):
        answer = games.start_game("catch")
        while not answer["ending"]:
            answer = games.play_action(answer["game"], "50")
        assert answer["ending"].startswith("agent threw 10 balls; ")
        assert games.end_game(f"g{number + 1}")["reason"] == "horizon"
    paths = [*folder.glob("*.dmt")]
    assert {read_transcript(assert_verified(path)).header.episode for path in paths} == {0, 1}
    assert answer["words"] == ""  # the text would reveal the belief
    assert (
        "belief"
        in ModelGames(
            McpServerConfig(show_belief=True, seed=7, transcript_folder=folder)
        ).start_game("catch")["words"]
    )


def test_a_disconnected_client_leaves_a_complete_and_sealed_transcript(folder: Path) -> None:
    games = ModelGames(McpServerConfig(turn_limit=50))
    games.start_game("crying-baby")
    games.play_action("g1", "feed")
    (path,) = saves.saves_folder({"XDG_STATE_HOME": str(folder.parent / "state")}).glob("*.dmt")
    assert name_lists.list_saved_seeds() == []
    games.end_all_games()
    assert '"reason": "interrupted"' in read_values(assert_verified(path), "end")[0]
    assert read_values(path, "strict") == ['"hints"']
    with pytest.raises(BadParameter, match="this game can still be continued"):
        mark_peeked_if_concealed(
            read_transcript(path), find_pair("crying-baby", 0).problem, peek=False
        )
    with pytest.raises(BadParameter, match="a seat was played by a language model"):
        start_game(ResumeRequest(path))
    assert [*saves.iter_unfinished_saves()] == []


def test_only_listed_problems_can_be_played_and_files_only_by_their_stem(folder: Path) -> None:
    subfolder = folder.parent / "deep"
    subfolder.mkdir()
    (subfolder / "coin.pomdp").write_text(
        "discount: 0.9\nvalues: reward\nstates: heads tails\nactions: left right\n"
        "observations: h t\nT: * uniform\nO: * uniform\nR: left : heads : * : * 1\n"
    )
    games = make_games(folder, "hexworld:straight-line", str(subfolder / "coin.pomdp"))
    assert [row["problem"] for row in games.list_problems()] == ["hexworld:straight-line", "coin"]
    assert games.problem_info("coin")["agents"] == ["agent"]
    games.play_action(games.start_game("coin")["game"], "left")
    assert str(subfolder) not in repr(
        [games.problem_info("coin"), games.game_status("g1", history=True)]
    )
    with pytest.raises(DmplayError, match="unknown problem 'hexworld'; did you mean"):
        games.start_game("hexworld")
    games.end_all_games()
    assert_verified(find_transcript(folder))
    for names, message in {
        ("nothing",): "unknown problem 'nothing'",
        ("catch", "./catch.pomdp"): "No such file",
    }.items():
        with pytest.raises(DmplayError, match=message):
            make_games(folder, *names)
    (folder / "file").touch()
    with pytest.raises(BadParameter, match=r"--output: .*file: File exists"):
        make_games(folder / "file")


@pytest.mark.parametrize(
    "name", ["crying-baby", "machine-replacement", "catch", "rock-paper-scissors"]
)
def test_answers_do_not_reveal_hidden_information_before_the_end(name: str, folder: Path) -> None:
    game_pair = find_pair(name, 0)
    first_answers, second_answers = (
        _collect_answers(game_pair, side, folder) for side in game_pair.sides
    )
    assert first_answers == second_answers


def _collect_answers(game_pair: Pair, side: Side, folder: Path) -> list[object]:
    """Return all answers to the seat in one of two games that look the same to it."""
    games = ModelGames(McpServerConfig((), True, True, True, side.seed, TURN_COUNT, folder))
    agents = game_pair.problem.agents
    answers: list[object] = [
        games.start_game(game_pair.name, agents[0], "random" if len(agents) > 1 else "")
    ]
    for joint in side.actions[:SHARED_TURNS]:
        answers.append(games.play_action("g1", game_pair.problem.format_action(0, joint[0])))
    answers += [
        games.game_status("g1", history=True),
        games.get_hint("g1"),
        games.problem_info(game_pair.name),
    ]
    answers += [games.undo_turns("g1"), games.game_status("g1")]
    return answers


def test_a_missing_extra_is_named_in_a_one_line_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mcp.server.mcpserver", None)
    message = "mcp: install the extra mcp: pip install 'dmplay[mcp]'"
    with pytest.raises(BadParameter, match=re.escape(message)):
        execute_result(interpret_command(["mcp", "hexworld"]))
