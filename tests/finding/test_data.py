"""Problems in files: found by name, told of in transcripts, and known again by their hash."""

import json
import sys
from pathlib import Path

import pytest

from dmplay.errors import BadParameter, BadTranscript
from dmplay.finding.problems import brought, load, resolve
from dmplay.finding.ways import moved
from dmplay.front import epilogue
from dmplay.game.checking import check, update
from dmplay.game.playback import Playback
from dmplay.game.request import Branching, Request, Resumption
from dmplay.game.start import begin, new
from dmplay.game.table import Table
from dmplay.transcript.reading import read
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
    game = new(Request("tiger.POMDP", agent="random", seed=3, turns=4, record=path))
    while game.unattended():
        pass
    game.finish("quit")
    return path


def test_a_file_is_found_by_its_ending_whatever_its_case(here: Path) -> None:
    for name, kind in (
        ("tiger.POMDP", "POMDP"),
        ("./tigers.dpomdp", "Dec-POMDP"),
        (str(here / "ballet.nfg"), "simple game"),
    ):
        found = resolve(name, {}, trusted=False)  # data needs no trust
        assert (found.name, found.problem.kind) == (name, kind)
        assert found.origin.startswith("sha256:")
        assert not brought(found.name)
    assert load("tiger.POMDP", discount=0.5).discount == 0.5


def test_code_of_others_is_brought_and_what_is_read_is_not() -> None:
    names = ("hexworld:straight-line", "poker.efg", "./grid.py:Grid", "openspiel:efg_game(a.efg)")
    assert [*map(brought, names)] == [False, False, True, True]


def test_a_transcript_tells_the_file_beside_it_and_its_hash(here: Path) -> None:
    header = read(recorded("below/a.dmt")).header
    assert (header.problem, header.origin) == (
        "../tiger.POMDP", resolve("tiger.POMDP", {}).origin
    )  # fmt: skip
    for folder in (here / "below", here, here.parent):
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(folder)
            assert check(here / "below" / "a.dmt").ok
    (here / "below").rename(here / "moved")
    assert check(here / "moved" / "a.dmt").ok
    assert moved("hexworld:straight-line", here, here / "below") == "hexworld:straight-line"


def test_a_file_that_is_another_by_now_is_told_of(here: Path) -> None:
    path = recorded("a.dmt")
    before = resolve("tiger.POMDP", {}).origin
    kept(here, "tiger.POMDP", TIGER + "# another\n")
    now = resolve("tiger.POMDP", {}).origin
    told = f"tiger.POMDP is {now}, was {before}"
    report = check(path)
    assert report.ok
    assert told in report.told
    assert Playback(path).warning == told
    branch = Branching(path, turn=2, record=Path("below/b.dmt"))
    game = begin(branch)
    game.finish("quit")
    assert game.warning == told
    header = read("below/b.dmt").header
    assert (header.problem, header.origin) == ("../tiger.POMDP", now)
    assert update(path)
    assert check(path).altered == ""


def test_a_file_that_says_something_else_fails_and_is_told_of(here: Path) -> None:
    path = recorded("a.dmt")
    kept(here, "tiger.POMDP", TIGER.replace("* -1\n", "* -7\n").replace("0.85", "0.1 0.9 #"))
    report = check(path)
    assert not report.ok
    kept(here, "tiger.POMDP", TIGER.replace("* -1\n", "* -7\n"))
    report = check(path)
    assert not report.ok
    assert str(report).splitlines()[-1].startswith("a.dmt: tiger.POMDP is sha256:")
    Path("tiger.POMDP").unlink()
    with pytest.raises(BadTranscript, match=r"a\.dmt:2: tiger\.POMDP: No such file or directory$"):
        begin(Resumption(path))


def test_teams_play_verify_and_go_on(here: Path) -> None:
    path = Path("team.dmt")
    game = new(Request("tigers.dpomdp", agent="random", others="random", seed=1, turns=5,
                       record=path))  # fmt: skip
    while game.unattended():
        pass
    game.finish("quit")
    assert check(path).ok
    turn = read(path).blocks[1]
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
    table = Table(new(Request("poker.efg", others="script:m", seed=1, record=Path("game.dmt"))))
    game = table.game
    game.choose(game.session.labels(0).index("r"))
    while game.unattended():
        pass
    assert game.session.over
    assert abs(game.session.totals()[0]) == 2.0  # who raises and is met wins or loses two
    table.end()
    assert check(Path("game.dmt")).ok
    epilogue(table)
    assert "replay: dmplay replay game.dmt\n" in capsys.readouterr().err  # it needs no trust
    monkeypatch.setitem(sys.modules, "pyspiel", None)
    with pytest.raises(BadParameter, match=r"pip install 'dmplay\[openspiel\]'"):
        load(kept(here / "below", "poker.efg", POKER))
