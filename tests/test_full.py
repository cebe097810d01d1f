"""Disks that are full and folders that are read-only: one line, the game goes on, files whole."""

import os
import re
import stat
from pathlib import Path

import pytest

from dmplay.game.checking import verify_file
from tests.support.brought import NO_AGENT
from tests.support.games import altered, recorded, verified
from tests.support.programs import Small, fresh, run, unprivileged, within
from tests.support.terminals import DMPLAY, Terminal

pytestmark = pytest.mark.slow  # starts the program again and again

GAME = ("hexworld", "--seed", "7")
TYPED = "e\nw\n" * 4
SMALL = (
    "bash",
    "-c",
    'ulimit -f 1; PYTHONDONTWRITEBYTECODE=1 exec "$@"',
    "-",
    *DMPLAY,
)
TOLD = r"(error|not rewritten): cannot write \S+: Permission denied\n"
LONGEST = 4096 - len("/dmplay/games/20000101-000000-hexworld")  # leaves no room for a game


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A folder with a finished game of some length, written with a blank too many."""
    recorded(tmp_path / "g.dmt", "hexworld", "random", turns=30)
    altered(tmp_path / "g.dmt", '"total": ', '"total":  ')
    return tmp_path


@pytest.mark.parametrize(
    ("size", "way"),
    [(0, "--plain"), (60, "--json"), (400, "--plain"), (400, "--json"), (850, "--quiet")],
)
def test_a_full_disk_is_told_once_and_what_it_holds_goes_on(
    size: int, way: str, tmp_path: Path
) -> None:
    words, small = (*GAME, way, "-o"), tmp_path / "small.dmt"
    done = fresh(*words, small.name, typed=TYPED, folder=tmp_path, disk=size)
    assert done.returncode == 1
    assert re.fullmatch(r"error: cannot write small\.dmt: [\w ]+\n", done.stderr)
    assert way == "--quiet" or "quit" in done.stdout.splitlines()[-1]  # it was played to its end
    report = verify_file(small) if size > 100 else None  # before, not even the opening fits
    assert small.stat().st_size if report else not small.stat().st_size
    assert report is None or report.is_unfinished
    turns = report.turns if report else 0
    again = ("resume", small.name) if report else (*words, small.name)
    assert run(tmp_path, *again, stdin="".join(TYPED.splitlines(True)[turns:])).returncode == 0
    run(tmp_path, *words, "whole.dmt", stdin=TYPED)
    assert small.read_bytes() == (tmp_path / "whole.dmt").read_bytes()


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("export g.dmt --cast -o new", 1), ("figure F.2 -o new", 1), ("verify g.dmt --update", 3),
        ("branch g.dmt --at 9 -q -o new", 1), ("resume g.dmt", 2),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_one_line_and_leaves_what_was_there(
    line: str, code: int, place: Path
) -> None:
    words = line.split()
    before = (place / "g.dmt").read_bytes()
    done = fresh(*words, folder=place, disk=300)
    assert done.returncode == code
    assert re.fullmatch(r"(error|not rewritten): [^\n]+\n", done.stderr)
    assert (place / "g.dmt").read_bytes() == before
    assert not [*place.rglob("*.tmp")]
    assert {path.name for path in place.iterdir()} <= {"g.dmt", "new", ".cache"}
    if words[0] == "branch":
        assert verify_file(place / "new").is_unfinished
    else:
        assert not (place / "new").exists()


def test_the_screen_tells_of_a_full_disk_and_plays_on(tmp_path: Path) -> None:
    with Terminal(*GAME, "-o", "g.dmt", folder=tmp_path, command=SMALL) as terminal:
        terminal.ready()
        for turn in range(1, 20):
            terminal.press("hl"[turn % 2], f"turn {turn} ")
        assert "cannot write g.dmt" in terminal.text
        assert terminal.press("q").ended() == 1
        assert "error: cannot write g.dmt: No space left on device" in terminal.text
        assert terminal.left_clean()
    assert verify_file(tmp_path / "g.dmt").is_unfinished


def test_a_kept_game_that_does_not_fit_is_told_of(tmp_path: Path) -> None:
    done = fresh(*GAME, typed="e\nw\nquit\n", folder=tmp_path, disk=0)
    assert done.returncode == 1
    assert re.fullmatch(r"error: cannot write \S+-hexworld\.dmt: File too large\n", done.stderr)
    assert "over: quit after 2 turns" in done.stdout


def test_a_line_that_the_history_cannot_hold_is_typed_all_the_same(tmp_path: Path) -> None:
    history = tmp_path / "state" / "dmplay" / "history"
    history.parent.mkdir(parents=True)
    history.write_text("# a line\n+list\n" * 200)
    before = history.read_bytes()
    with Terminal("shell", folder=tmp_path, command=SMALL) as terminal:
        terminal.ready().press("play hexworld --seed 7\r", "t0]>").press("e\r", "t1]>")
        assert terminal.press("\x04").ended() == 0
    assert history.read_bytes() == before


@pytest.mark.parametrize("record", ["/dev/null", "small.dmt"])
def test_what_a_disk_could_not_hold_is_saved_elsewhere(record: str, tmp_path: Path) -> None:
    if record == os.devnull:
        run(tmp_path, *GAME, "--frames", "-o", record, stdin="e\nw\nsave s.dmt\nquit\n")
    else:
        around = Small(400)
        done = within(around, tmp_path, *GAME, "-q", "-o", record, stdin=f"{TYPED}save s.dmt\n")
        assert "error: " in done.stderr
        assert not (tmp_path / "s.dmt").exists()  # nor does it fit there
        return
    report = verify_file(tmp_path / "s.dmt")
    assert (report.is_unfinished, report.turns) == (True, 2)
    assert run(tmp_path, "resume", "s.dmt", stdin="e\n").returncode == 0
    assert verified(tmp_path / "s.dmt").read_text().count("\n| ") > 2


def test_a_game_whose_output_is_its_file_is_saved_too(tmp_path: Path) -> None:
    done = run(tmp_path, *GAME, "-q", "-o", "-", stdin="e\nsave s.dmt\nquit\n")
    assert done.returncode == 0
    assert verify_file(tmp_path / "s.dmt").turns == 1


def test_a_fault_whose_log_does_not_fit_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "broken.py").write_text(NO_AGENT)
    words = ("hexworld", "--agent", "./broken.py:Agent", "--seed", "1", "-o", os.devnull)
    done = fresh(*words, folder=tmp_path, disk=0)
    told = "error: unexpected TypeError; no log can be written, --debug shows it\n"
    assert (done.returncode, done.stderr) == (1, told)


# Folders that cannot be written, or read


@pytest.mark.parametrize(
    "words",
    [
        (*GAME, "--agent", "random", "-o", "new"), ("export", "g.dmt", "--csv", "-o", "new"),
        ("verify", "g.dmt", "--update"), ("branch", "g.dmt", "--at", "9", "-o", "new"),
    ],
    ids=" ".join,
)  # fmt: skip
def test_a_folder_that_is_read_only_is_one_line(words: tuple[str, ...], place: Path) -> None:
    before = (place / "g.dmt").read_bytes()
    place.chmod(0o555)
    done = within(unprivileged, place, *words)
    place.chmod(0o755)
    assert done.returncode in (2, 3)
    assert re.fullmatch(
        r"(error|not rewritten): cannot write \S+: Permission denied\n", done.stderr
    )
    assert [path.name for path in place.iterdir()] == ["g.dmt"]
    assert (place / "g.dmt").read_bytes() == before


def test_a_file_that_is_read_only_is_not_gone_on_with(tmp_path: Path) -> None:
    run(tmp_path, *GAME, "-o", "g.dmt", stdin="e\n")
    (tmp_path / "g.dmt").chmod(0o444)
    done = within(unprivileged, tmp_path, "resume", "g.dmt", stdin="w\n")
    assert (done.returncode, done.stderr) == (2, "error: cannot write g.dmt: Permission denied\n")
    assert verified(tmp_path / "g.dmt")


@pytest.mark.parametrize("game", [GAME, ("shell",)])
def test_a_state_folder_that_is_read_only_is_one_warning(
    game: tuple[str, ...], tmp_path: Path
) -> None:
    kept = tmp_path / "state" / "dmplay" / "games"
    kept.mkdir(parents=True)
    kept.chmod(0o555)
    typed = "play hexworld --seed 7\ne\n" if game == ("shell",) else "e\n"
    done = within(unprivileged, tmp_path, *game, stdin=typed)
    assert done.returncode == 0
    assert "turn 1." in done.stdout
    assert done.stderr.count("\n") == 1 + done.stderr.count("again: ")
    assert done.stderr.startswith(f"warning: this game is not kept: {kept}: Permission denied\n")


def test_a_state_folder_in_which_nothing_can_be_made_is_one_warning(tmp_path: Path) -> None:
    deep = tmp_path / "state"
    while len(str(deep)) < LONGEST:
        deep /= "x" * min(200, LONGEST - len(str(deep)))
    done = run(tmp_path, *GAME, stdin="e\n", XDG_STATE_HOME=str(deep))
    assert done.returncode == 0
    assert "turn 1." in done.stdout
    assert re.match(r"warning: this game is not kept: .*: File name too long\n", done.stderr)


def test_verify_tells_of_a_folder_that_it_cannot_search(place: Path) -> None:
    (place / "shut").mkdir()
    (place / "g.dmt").rename(place / "shut" / "hidden.dmt")
    recorded(place / "z.dmt", "hexworld", "random", turns=3)
    (place / "shut").chmod(0)
    done = within(unprivileged, place, "verify", ".")
    (place / "shut").chmod(stat.S_IRWXU)
    assert done.returncode == 3
    assert done.stdout.splitlines() == [
        "shut:1: cannot be read: Permission denied", "ok z.dmt (3 turns)", "1 verified, 1 failed",
    ]  # fmt: skip
