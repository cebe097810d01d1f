"""Problems in files: found by name, told of in transcripts, and known again by their hash."""

import json
import sys
from pathlib import Path

import pytest

from dmplay.errors import BadParameter, BadTranscript
from dmplay.finding.problems import load_problem, requires_trust, resolve_problem
from dmplay.finding.ways import rebase_name
from dmplay.front import print_epilogue
from dmplay.game.checking import rewrite_file, verify_file
from dmplay.game.playback import Playback
from dmplay.game.request import BranchRequest, GameRequest, ResumeRequest
from dmplay.game.start import start_game, start_new_game
from dmplay.game.table import GameController
from dmplay.transcript.reading import read_transcript
from tests.files.sources import BALLET, TEAM, TIGER, kept


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with files of three formats, and one below it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    kept(tmp_path, "tiger.POMDP", TIGER)
    kept(tmp_path, "tigers.dpomdp", TEAM)
    kept(tmp_path, "ballet.nfg", BALLET)
    (tmp_path / "below").mkdir()
    return tmp_path


def recorded(place: str) -> Path:
    """The transcript of a short game of an agent."""
    path = Path(place)
    game = start_new_game(
        GameRequest("tiger.POMDP", agent="random", seed=3, turns=4, record_path=path)
    )
    while game.play_agent_turn():
        pass
    game.finish("quit")
    return path


def test_a_file_is_found_by_its_ending_whatever_its_case(here: Path) -> None:
    for name, kind in (
        ("tiger.POMDP", "POMDP"),
        ("./tigers.dpomdp", "Dec-POMDP"),
        (str(here / "ballet.nfg"), "simple game"),
    ):
        found = resolve_problem(name, {}, trusted=False)  # data needs no trust
        assert (found.name, found.problem.kind) == (name, kind)
        assert found.origin.startswith("sha256:")
        assert not requires_trust(found.name)
    assert load_problem("tiger.POMDP", discount=0.5).discount == 0.5


def test_code_of_others_is_brought_and_what_is_read_is_not() -> None:
    names = ("hexworld:straight-line", "poker.efg", "./grid.py:Grid", "openspiel:efg_game(a.efg)")
    assert [*map(requires_trust, names)] == [False, False, True, True]


def test_a_transcript_tells_the_file_beside_it_and_its_hash(here: Path) -> None:
    header = read_transcript(recorded("below/a.dmt")).header
    assert (header.problem, header.origin) == (
        "../tiger.POMDP", resolve_problem("tiger.POMDP", {}).origin
    )  # fmt: skip
    for folder in (here / "below", here, here.parent):
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(folder)
            assert verify_file(here / "below" / "a.dmt").is_ok
    (here / "below").rename(here / "moved")
    assert verify_file(here / "moved" / "a.dmt").is_ok
    assert rebase_name("hexworld:straight-line", here, here / "below") == "hexworld:straight-line"


def test_a_file_that_is_another_by_now_is_told_of(here: Path) -> None:
    path = recorded("a.dmt")
    before = resolve_problem("tiger.POMDP", {}).origin
    kept(here, "tiger.POMDP", TIGER + "# another\n")
    now = resolve_problem("tiger.POMDP", {}).origin
    told = f"tiger.POMDP is {now}, was {before}"
    report = verify_file(path)
    assert report.is_ok
    assert told in report.summary
    assert Playback(path).warning == told
    branch = BranchRequest(path, turn=2, record_path=Path("below/b.dmt"))
    game = start_game(branch)
    game.finish("quit")
    assert game.warning == told
    header = read_transcript("below/b.dmt").header
    assert (header.problem, header.origin) == ("../tiger.POMDP", now)
    assert rewrite_file(path)
    assert verify_file(path).problem_change == ""


def test_a_file_that_says_something_else_fails_and_is_told_of(here: Path) -> None:
    path = recorded("a.dmt")
    kept(here, "tiger.POMDP", TIGER.replace("* -1\n", "* -7\n").replace("0.85", "0.1 0.9 #"))
    report = verify_file(path)
    assert not report.is_ok
    kept(here, "tiger.POMDP", TIGER.replace("* -1\n", "* -7\n"))
    report = verify_file(path)
    assert not report.is_ok
    assert str(report).splitlines()[-1].startswith("a.dmt: tiger.POMDP is sha256:")
    Path("tiger.POMDP").unlink()
    with pytest.raises(BadTranscript, match=r"a\.dmt:2: tiger\.POMDP: No such file or directory$"):
        start_game(ResumeRequest(path))


def test_teams_play_verify_and_go_on(here: Path) -> None:
    path = Path("team.dmt")
    game = start_new_game(GameRequest("tigers.dpomdp", agent="random", other_agent="random", seed=1, turns=5,
                       record_path=path))  # fmt: skip
    while game.play_agent_turn():
        pass
    game.finish("quit")
    assert verify_file(path).is_ok
    turn = read_transcript(path).blocks[1]
    assert json.dumps(turn["observations"]).count("hear-") == 2


POKER = """EFG 2 R "Poker" { "Fred" "Alice" }
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


def test_an_extensive_game_is_played_and_names_the_extra_that_reads_it(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    kept(here, "poker.efg", POKER)
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
    assert abs(game.session.total_rewards()[0]) == 2.0  # who raises and is met wins or loses two
    table.end_game()
    assert verify_file(Path("game.dmt")).is_ok
    print_epilogue(table)
    assert "replay: dmplay replay game.dmt\n" in capsys.readouterr().err  # it needs no trust
    monkeypatch.setitem(sys.modules, "pyspiel", None)
    with pytest.raises(BadParameter, match=r"pip install 'dmplay\[openspiel\]'"):
        load_problem(kept(here / "below", "poker.efg", POKER))
