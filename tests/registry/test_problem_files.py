"""Tests of problems in files: found by name, named in transcripts and identified by their hash."""

import json
import sys
from pathlib import Path

import pytest

from dmplay.errors import BadParameter, BadTranscript
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_game, start_new_game
from dmplay.game.launch_requests import BranchRequest, GameRequest, ResumeRequest
from dmplay.game.playback import Playback
from dmplay.game.transcript_verification import rewrite_file, verify
from dmplay.registry.problem_name_kinds import rebase_name
from dmplay.registry.problems import load_problem, requires_trust, resolve_problem
from dmplay.transcript.reader import read_transcript
from dmplay.ui.game_launcher import print_epilogue
from tests.formats.sources import BALLET_TEXT, TEAM_TEXT, TIGER_TEXT, write_text_file


@pytest.fixture
def problem_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with files of three formats and a subfolder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    write_text_file(tmp_path, "tiger.POMDP", TIGER_TEXT)
    write_text_file(tmp_path, "tigers.dpomdp", TEAM_TEXT)
    write_text_file(tmp_path, "ballet.nfg", BALLET_TEXT)
    (tmp_path / "below").mkdir()
    return tmp_path


def record_game(filename: str) -> Path:
    """Record a short game of an agent and return its transcript."""
    path = Path(filename)
    game = start_new_game(
        GameRequest("tiger.POMDP", agent="random", seed=3, turns=4, record_path=path)
    )
    while game.play_agent_turn():
        pass
    game.finish("quit")
    return path


def test_a_file_is_found_by_its_suffix_in_upper_or_lower_case(problem_folder: Path) -> None:
    for name, kind in (
        ("tiger.POMDP", "POMDP"),
        ("./tigers.dpomdp", "Dec-POMDP"),
        (str(problem_folder / "ballet.nfg"), "simple game"),
    ):
        resolved = resolve_problem(name, {}, trusted=False)  # data needs no trust
        assert (resolved.name, resolved.problem.kind) == (name, kind)
        assert resolved.origin.startswith("sha256:")
        assert not requires_trust(resolved.name)
    assert load_problem("tiger.POMDP", discount=0.5).discount == 0.5


def test_problems_in_code_require_trust_and_data_files_do_not() -> None:
    names = ("hexworld:straight-line", "poker.efg", "./grid.py:Grid", "openspiel:efg_game(a.efg)")
    assert [*map(requires_trust, names)] == [False, False, True, True]


def test_a_transcript_names_the_relative_problem_file_and_its_hash(problem_folder: Path) -> None:
    header = read_transcript(record_game("below/a.dmt")).header
    assert (header.problem, header.origin) == (
        "../tiger.POMDP", resolve_problem("tiger.POMDP", {}).origin
    )  # fmt: skip
    for folder in (problem_folder / "below", problem_folder, problem_folder.parent):
        with pytest.MonkeyPatch.context() as context:
            context.chdir(folder)
            assert verify(problem_folder / "below" / "a.dmt").is_ok
    (problem_folder / "below").rename(problem_folder / "moved")
    assert verify(problem_folder / "moved" / "a.dmt").is_ok
    assert (
        rebase_name("hexworld:straight-line", problem_folder, problem_folder / "below")
        == "hexworld:straight-line"
    )


def test_a_changed_problem_file_is_reported(problem_folder: Path) -> None:
    path = record_game("a.dmt")
    before = resolve_problem("tiger.POMDP", {}).origin
    write_text_file(problem_folder, "tiger.POMDP", TIGER_TEXT + "# another\n")
    current_origin = resolve_problem("tiger.POMDP", {}).origin
    message = f"tiger.POMDP has changed: now {current_origin}, recorded {before}"
    report = verify(path)
    assert report.is_ok
    assert message in report.summary
    assert Playback(path).warning == message
    branch = BranchRequest(path, turn=2, record_path=Path("below/b.dmt"))
    game = start_game(branch)
    game.finish("quit")
    assert game.warning == message
    header = read_transcript("below/b.dmt").header
    assert (header.problem, header.origin) == ("../tiger.POMDP", current_origin)
    assert rewrite_file(path)
    assert verify(path).problem_change == ""


def test_a_problem_file_with_other_rules_fails_verification_and_is_reported(
    problem_folder: Path,
) -> None:
    path = record_game("a.dmt")
    write_text_file(
        problem_folder,
        "tiger.POMDP",
        TIGER_TEXT.replace("* -1\n", "* -7\n").replace("0.85", "0.1 0.9 #"),
    )
    report = verify(path)
    assert not report.is_ok
    write_text_file(problem_folder, "tiger.POMDP", TIGER_TEXT.replace("* -1\n", "* -7\n"))
    report = verify(path)
    assert not report.is_ok
    assert str(report).splitlines()[-1].startswith("a.dmt: tiger.POMDP has changed: now sha256:")
    Path("tiger.POMDP").unlink()
    with pytest.raises(BadTranscript, match=r"a\.dmt:2: tiger\.POMDP: No such file or directory$"):
        start_game(ResumeRequest(path))


def test_a_game_of_a_team_is_played_and_verified(problem_folder: Path) -> None:
    path = Path("team.dmt")
    game = start_new_game(
        GameRequest(
            "tigers.dpomdp", agent="random", other_agent="random", seed=1, turns=5, record_path=path
        )
    )
    while game.play_agent_turn():
        pass
    game.finish("quit")
    assert verify(path).is_ok
    turn = read_transcript(path).blocks[1]
    assert json.dumps(turn["observations"]).count("hear-") == 2


POKER_SOURCE = """EFG 2 R "Poker" { "Fred" "Alice" }
c "" 1 "" { "A" 1/2 "K" 1/2 } 0
p "" 1 1 "" { "R" "F" } 0
p "" 2 1 "" { "M" "P" } 0
t "" 1 "" { 2, -2 }
t "" 2 "" { 1, -1 }
t "" 3 "" { -1, 1 }
p "" 1 3 "" { "R" "F" } 0
p "" 2 1 0
t "" 4 "" { -2, 2 }
t "" 2
t "" 3
"""


@pytest.mark.extra("openspiel")
def test_an_extensive_game_is_played_and_its_missing_extra_is_named(
    problem_folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write_text_file(problem_folder, "poker.efg", POKER_SOURCE)
    table = GameController(
        start_new_game(
            GameRequest("poker.efg", other_agent="script:m", seed=1, record_path=Path("game.dmt"))
        )
    )
    game = table.game
    game.choose(game.session.action_labels(0).index("r"))
    while game.play_agent_turn():
        pass
    assert game.session.over
    assert abs(game.session.total_rewards()[0]) == 2.0  # a raise that is called wins or loses two
    table.end_game()
    assert verify(Path("game.dmt")).is_ok
    print_epilogue(table)
    assert "replay: dmplay replay game.dmt\n" in capsys.readouterr().err  # it needs no trust
    monkeypatch.setitem(sys.modules, "pyspiel", None)
    with pytest.raises(BadParameter, match=r"pip install 'dmplay\[openspiel\]'"):
        load_problem(write_text_file(problem_folder / "below", "poker.efg", POKER_SOURCE))


OLD_POKER_GAME = """dmplay: 1
problem: "poker.efg"
origin: "sha256:8375b4334fdb1572, open-spiel 2.0.2"
seats: {"player-0": "random", "player-1": "random"}
seed: 1

turn: 0
draws: [0.378651869]
state: "2: Player:  1 2  R F"
observations: {"player-0": "0-0-2-", "player-1": "0-1-2-"}

turn: 1
actions: {"player-0": "f", "player-1": "wait"}
draws: [0.212787692]
state: "8: Terminal:   -1 1"
observations: {"player-0": "-1-0-0-", "player-1": "-1-1-0-"}
rewards: {"player-0": -1, "player-1": 1}

end: {"reason": "terminal", "turns": 1, "return": {"player-0": -1, "player-1": 1}, "total": {"player-0": -1, "player-1": 1}, "sha256": "7ca34fcf725cea4a"}
"""  # noqa: E501 - as dmplay wrote it


@pytest.mark.extra("openspiel")
def test_what_waiting_players_once_observed_is_one_finding_that_an_update_repairs(
    problem_folder: Path,
) -> None:
    write_text_file(problem_folder, "poker.efg", POKER_SOURCE)
    path = Path("old.dmt")
    path.write_text(OLD_POKER_GAME)
    assert str(verify(path)) == (
        "old.dmt:10: turn 0, player-1: observations: an older dmplay recorded the acting player's "
        "information set here, but a waiting player observes nothing; --update rewrites the file"
    )
    assert '"player-1": "nothing"' in rewrite_file(path)
    assert verify(path).is_ok
