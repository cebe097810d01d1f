"""A language model plays by ids: what it may ask, what it is told, and what its record says."""

import re
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from dmplay.cli.errands import execute_result, interpret_command
from dmplay.errors import BadParameter, DmplayError
from dmplay.game import saves
from dmplay.game.checking import verify_file
from dmplay.game.errand import McpServerConfig
from dmplay.game.request import ResumeRequest
from dmplay.game.start import start_game
from dmplay.mcp.games import MAX_GAMES, ModelGames
from dmplay.transcript.reading import read_transcript
from dmplay.transcript.seal import disclose_transcript
from dmplay.words.completion import lists
from tests.privacy.pairs import LOOKED_AT, TURNS, Pair, Side, pair
from tests.support.games import values, verified

SEED = 5  # nothing can go down in its first board of 2048


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "games"


def hosted(folder: Path, *names: str, hints: bool = True, undo: bool = True) -> ModelGames:
    return ModelGames(McpServerConfig(names, hints, undo, seed=SEED, transcript_folder=folder))


def the_file(folder: Path) -> Path:
    (path,) = folder.glob("*.dmt")
    return path


def test_a_game_is_told_turn_by_turn_and_its_record_names_the_seat_mcp(folder: Path) -> None:
    games = hosted(folder)
    first = games.start_game("crying-baby")
    assert (first["game"], first["seat"], first["seen"]) == ("g1", "agent", None)
    assert first["legal"] == ["feed", "sing", "ignore"]
    assert first["turns"] == [{"turn": 0, "observation": None}]
    told = games.play_action("g1", "feed", turn=1)
    assert told["turns"] == [{"turn": 1, "action": "feed", "observation": "quiet"}]
    assert games.get_hint("g1")["action"] == "ignore"
    assert games.undo_turns("g1")["turn"] == 0
    assert games.play_action("g1", "feed")["turns"] == told["turns"]
    assert games.game_status("g1")["turns"] == []
    assert games.game_status("g1", history=True)["turns"] == [*first["turns"], *told["turns"]]
    end = games.end_game("g1")
    assert (end["reason"], end["turns"], end["help"]) == ("quit", 1, {"agent": 1})
    assert isinstance(end["debrief"], list)
    assert [row["state"] for row in end["debrief"]] == ["hungry", "sated"]
    assert games.game_status("g1")["ending"].startswith("quit after 1 turn. agent score")
    path = verified(the_file(folder))
    assert values(path, "seats") == ['{"agent": "mcp"}']
    assert verify_file(path).unchecked_players == ["mcp"]


def test_it_may_sit_in_any_seat_among_agents_that_dmplay_knows(folder: Path) -> None:
    games = hosted(folder)
    assert games.start_game("prisoners-dilemma", "agent2", "grim")["seat"] == "agent2"
    turn = games.play_action("g1", "defect")["turns"][0]
    assert turn["actions"] == {"agent1": "cooperate", "agent2": "defect"}
    for others in ("nobody", "human", "mcp", "script:feed", "bot:sh", "./evil.py:X"):
        with pytest.raises(DmplayError, match=r"^unknown agent"):
            games.start_game("prisoners-dilemma", others=others)
    with pytest.raises(DmplayError, match="expected none: there is one seat only"):
        games.start_game("catch", others="greedy")
    assert games.start_game("travelers-dilemma")["seat"] == "agent1"
    assert isinstance(games.play_action("g2", "50")["turns"][0]["reward"], float)
    assert games.start_game("simple-regulator")["legal"] == {"low": -10.0, "high": 10.0}
    assert games.play_action("g3", "0.25")["turns"][0]["action"] == 0.25


def test_what_it_cannot_do_is_told_in_a_line_and_changes_nothing(folder: Path) -> None:
    games = hosted(folder)
    stuck = games.start_game("2048")
    faults: dict[str, Callable[[], object]] = {
        "unknown game 'g2'; did you mean g1?": lambda: games.play_action("g2", "left"),
        "down is not legal now; expected one of": lambda: games.play_action("g1", "down"),
        "unknown action '1'": lambda: games.play_action("g1", "1"),
        "turn: got 2, expected 1": lambda: games.play_action("g1", "left", turn=2),
        "undo 1: 0 turns were played": lambda: games.undo_turns("g1"),
        "unknown problem '../2048'": lambda: games.start_game("../2048"),
        "unknown problem '2048; rm -r .'": lambda: games.start_game("2048; rm -r ."),
        "unknown problem './evil.py:X'": lambda: games.problem_info("./evil.py:X"),
        "unknown seat 'agent9'": lambda: games.start_game("catch", "agent9"),
    }
    for told, fault in faults.items():
        with pytest.raises(DmplayError, match=re.escape(told)) as raised:
            fault()
        assert "\n" not in str(raised.value)
    assert games.game_status("g1", history=True) == stuck
    games.end_game("g1")
    with pytest.raises(DmplayError, match=r"the game is over \(quit\)"):
        games.play_action("g1", "left")
    with pytest.raises(DmplayError, match="undo: the game is over"):
        games.undo_turns("g1")
    with pytest.raises(DmplayError, match="no hint: the game is over"):
        games.get_hint("g1")
    verified(the_file(folder))


def test_only_so_many_games_are_played_at_once_and_the_first_that_is_over_is_forgotten(
    folder: Path,
) -> None:
    games = hosted(folder)
    for _ in range(MAX_GAMES):
        games.start_game("hexworld")
    for _ in range(3):
        with pytest.raises(
            BadParameter, match=f"new: {MAX_GAMES} games are played; end one of them"
        ):
            games.start_game("hexworld")
    games.end_game("g3")
    assert games.start_game("hexworld")["game"] == f"g{MAX_GAMES + 1}"
    with pytest.raises(DmplayError, match="unknown game 'g3'"):
        games.game_status("g3")
    games.end_all_games()
    assert len([verified(path) for path in folder.glob("*.dmt")]) == MAX_GAMES + 1


def test_a_game_that_comes_to_its_end_is_ended_and_one_of_a_seed_is_an_episode(
    folder: Path,
) -> None:
    games = hosted(folder)
    for number in range(2):
        told = games.start_game("catch")
        while not told["ending"]:
            told = games.play_action(told["game"], "50")
        assert told["ending"].startswith("turn limit after 10 turns.")
        assert games.end_game(f"g{number + 1}")["reason"] == "horizon"
    paths = [*folder.glob("*.dmt")]
    assert {read_transcript(verified(path)).header.episode for path in paths} == {0, 1}
    assert told["words"] == ""  # which would tell the belief
    assert (
        "belief"
        in ModelGames(
            McpServerConfig(show_belief=True, seed=7, transcript_folder=folder)
        ).start_game("catch")["words"]
    )


def test_a_client_that_is_gone_leaves_a_game_that_is_whole_sealed_and_its_own(
    folder: Path,
) -> None:
    games = ModelGames(McpServerConfig(turn_limit=50))
    games.start_game("crying-baby")
    games.play_action("g1", "feed")
    (path,) = saves.saves_folder({"XDG_STATE_HOME": str(folder.parent / "state")}).glob("*.dmt")
    assert lists.list_saved_seeds() == []
    games.end_all_games()
    assert '"reason": "interrupted"' in values(verified(path), "end")[0]
    assert values(path, "strict") == ['"hints"']
    with pytest.raises(BadParameter, match="this game can still be played on"):
        disclose_transcript(read_transcript(path), pair("crying-baby", 0).problem, peek=False)
    with pytest.raises(BadParameter, match="a seat was played by a language model"):
        start_game(ResumeRequest(path))
    assert [*saves.iter_unfinished_saves()] == []


def test_only_what_is_named_can_be_played_and_a_file_by_its_name_alone(folder: Path) -> None:
    place = folder.parent / "deep"
    place.mkdir()
    (place / "coin.pomdp").write_text(
        "discount: 0.9\nvalues: reward\nstates: heads tails\nactions: left right\n"
        "observations: h t\nT: * uniform\nO: * uniform\nR: left : heads : * : * 1\n"
    )
    games = hosted(folder, "hexworld:straight-line", str(place / "coin.pomdp"))
    assert [one["problem"] for one in games.list_problems()] == ["hexworld:straight-line", "coin"]
    assert games.problem_info("coin")["agents"] == ["agent"]
    games.play_action(games.start_game("coin")["game"], "left")
    assert str(place) not in repr(
        [games.problem_info("coin"), games.game_status("g1", history=True)]
    )
    with pytest.raises(DmplayError, match="unknown problem 'hexworld'; did you mean"):
        games.start_game("hexworld")
    games.end_all_games()
    verified(the_file(folder))
    for names, told in {
        ("nothing",): "unknown problem 'nothing'",
        ("catch", "./catch.pomdp"): "No such file",
    }.items():
        with pytest.raises(DmplayError, match=told):
            hosted(folder, *names)
    (folder / "file").touch()
    with pytest.raises(BadParameter, match=r"--output: .*file: File exists"):
        hosted(folder / "file")


@pytest.mark.parametrize(
    "name", ["crying-baby", "machine-replacement", "catch", "rock-paper-scissors"]
)
def test_no_answer_tells_games_apart_before_the_end(name: str, folder: Path) -> None:
    twins = pair(name, 0)
    one, other = (_asked(twins, side, folder) for side in twins.sides)
    assert one == other


def _asked(twins: Pair, side: Side, folder: Path) -> list[object]:
    """What the seat of one of two games that look the same is told."""
    games = ModelGames(McpServerConfig((), True, True, True, side.seed, TURNS, folder))
    agents = twins.problem.agents
    told: list[object] = [
        games.start_game(twins.name, agents[0], "random" if len(agents) > 1 else "")
    ]
    for joint in side.actions[:LOOKED_AT]:
        told.append(games.play_action("g1", twins.problem.format_action(0, joint[0])))
    told += [
        games.game_status("g1", history=True),
        games.get_hint("g1"),
        games.problem_info(twins.name),
    ]
    told += [games.undo_turns("g1"), games.game_status("g1")]
    return told


def test_without_the_extra_its_name_is_told_in_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mcp.server.mcpserver", None)
    cure = "mcp: install the extra mcp: pip install 'dmplay[mcp]'"
    with pytest.raises(BadParameter, match=re.escape(cure)):
        execute_result(interpret_command(["mcp", "hexworld"]))
