"""Tests of full disks and read-only folders: one error line, and files stay whole."""

import os
import re
import stat
from pathlib import Path

import pytest

from dmplay.game.transcript_verification import verify
from tests.support.games import assert_verified, record_game, replace_in_file
from tests.support.programs import (
    SmallDisk,
    run_dmplay,
    run_fresh_interpreter,
    run_unprivileged,
    run_wrapped,
)
from tests.support.terminals import DMPLAY_COMMAND, Terminal
from tests.support.user_problems import BROKEN_AGENT_SOURCE

pytestmark = pytest.mark.slow  # starts the program many times

GAME_ARGS = ("hexworld", "--seed", "7")
TYPED_INPUT = "e\nw\n" * 4
LIMITED_COMMAND = (
    "bash",
    "-c",
    'ulimit -f 1; PYTHONDONTWRITEBYTECODE=1 exec "$@"',
    "-",
    *DMPLAY_COMMAND,
)
PERMISSION_ERROR_PATTERN = r"(error|not rewritten): cannot write \S+: Permission denied\n"
# so long that no file of a game fits in it
MAX_FOLDER_CHARS = 4096 - len("/dmplay/games/000001-hexworld")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a finished game of 30 turns, written with an extra space."""
    record_game(tmp_path / "g.dmt", "hexworld", "random", turns=30)
    replace_in_file(tmp_path / "g.dmt", '"total": ', '"total":  ')
    return tmp_path


@pytest.mark.parametrize(
    ("size", "output_option"),
    [(0, "--plain"), (60, "--json"), (400, "--plain"), (400, "--json"), (850, "--quiet")],
)
def test_a_full_disk_is_reported_once_and_the_game_can_be_resumed(
    size: int, output_option: str, tmp_path: Path
) -> None:
    words, small = (*GAME_ARGS, output_option, "-o"), tmp_path / "small.dmt"
    result = run_fresh_interpreter(
        *words, small.name, typed=TYPED_INPUT, folder=tmp_path, disk=size
    )
    assert result.returncode == 1
    assert re.fullmatch(r"error: cannot write small\.dmt: [\w ]+\n", result.stderr)
    assert output_option == "--quiet" or "quit" in result.stdout.splitlines()[-1]  # the game ended
    # on a smaller disk, not even the header fits
    report = verify(small) if size > 100 else None
    assert small.stat().st_size if report else not small.stat().st_size
    assert report is None or report.is_unfinished
    turns = report.turns if report else 0
    retry_command = ("resume", small.name) if report else (*words, small.name)
    assert (
        run_dmplay(
            tmp_path, *retry_command, stdin="".join(TYPED_INPUT.splitlines(True)[turns:])
        ).returncode
        == 0
    )
    run_dmplay(tmp_path, *words, "whole.dmt", stdin=TYPED_INPUT)
    assert small.read_bytes() == (tmp_path / "whole.dmt").read_bytes()


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("export g.dmt --cast -o new", 1), ("convert hexworld -o new.mdp", 1),
        ("verify g.dmt --update", 3), ("branch g.dmt --at 9 -q -o new", 1),
        ("resume g.dmt", 2),
    ],
)  # fmt: skip
def test_a_full_disk_prints_one_error_line_and_leaves_existing_files(
    line: str, code: int, folder: Path
) -> None:
    words = line.split()
    before = (folder / "g.dmt").read_bytes()
    result = run_fresh_interpreter(*words, folder=folder, disk=300)
    assert result.returncode == code
    assert re.fullmatch(r"(error|not rewritten): [^\n]+\n", result.stderr)
    assert (folder / "g.dmt").read_bytes() == before
    assert not [*folder.rglob("*.tmp")]
    assert {path.name for path in folder.iterdir()} <= {"g.dmt", "new", "new.mdp", ".cache"}
    if words[0] == "branch":
        assert verify(folder / "new").is_unfinished
    else:
        assert not (folder / "new").exists()


def test_the_screen_reports_a_full_disk_and_plays_on(tmp_path: Path) -> None:
    with Terminal(*GAME_ARGS, "-o", "g.dmt", folder=tmp_path, command=LIMITED_COMMAND) as terminal:
        terminal.ready()
        turns_with_notice = []
        for turn in range(1, 20):
            terminal.press("hl"[turn % 2], f"turn {turn} ")
            if "cannot write g.dmt" in terminal.text:
                turns_with_notice.append(turn)
        assert turns_with_notice  # until later lines of the log replace it
        assert terminal.press("q").ended() == 1
        assert "error: cannot write g.dmt: No space left on device" in terminal.text
        assert terminal.left_clean()
    assert verify(tmp_path / "g.dmt").is_unfinished


def test_a_saved_game_that_does_not_fit_is_reported(tmp_path: Path) -> None:
    result = run_fresh_interpreter(*GAME_ARGS, typed="e\nw\nquit\n", folder=tmp_path, disk=0)
    assert result.returncode == 1
    assert re.fullmatch(r"error: cannot write \S+-hexworld\.dmt: File too large\n", result.stderr)
    assert "over: quit after 2 turns" in result.stdout


def test_a_line_runs_even_if_the_shell_history_cannot_be_written(tmp_path: Path) -> None:
    history = tmp_path / "state" / "dmplay" / "history"
    history.parent.mkdir(parents=True)
    history.write_text("# a line\n+list\n" * 200)
    before = history.read_bytes()
    with Terminal("shell", folder=tmp_path, command=LIMITED_COMMAND) as terminal:
        terminal.ready().press("play hexworld --seed 7\r", "t0]>").press("e\r", "t1]>")
        assert terminal.press("\x04").ended() == 0
    assert history.read_bytes() == before


@pytest.mark.parametrize("record", ["/dev/null", "small.dmt"])
def test_a_game_that_could_not_be_recorded_is_saved_elsewhere(record: str, tmp_path: Path) -> None:
    if record == os.devnull:
        run_dmplay(tmp_path, *GAME_ARGS, "--frames", "-o", record, stdin="e\nw\nsave s.dmt\nquit\n")
    else:
        disk_limit = SmallDisk(400)
        result = run_wrapped(
            disk_limit, tmp_path, *GAME_ARGS, "-q", "-o", record, stdin=f"{TYPED_INPUT}save s.dmt\n"
        )
        assert "error: " in result.stderr
        assert not (tmp_path / "s.dmt").exists()  # it does not fit there either
        return
    report = verify(tmp_path / "s.dmt")
    assert (report.is_unfinished, report.turns) == (True, 2)
    assert run_dmplay(tmp_path, "resume", "s.dmt", stdin="e\n").returncode == 0
    assert assert_verified(tmp_path / "s.dmt").read_text().count("\n| ") > 2


def test_a_game_recorded_to_standard_output_can_be_saved(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, *GAME_ARGS, "-q", "-o", "-", stdin="e\nsave s.dmt\nquit\n")
    assert result.returncode == 0
    assert verify(tmp_path / "s.dmt").turns == 1


def test_an_unexpected_error_whose_log_does_not_fit_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "broken.py").write_text(BROKEN_AGENT_SOURCE)
    words = ("hexworld", "--agent", "./broken.py:Agent", "--seed", "1", "-o", os.devnull)
    result = run_fresh_interpreter(*words, folder=tmp_path, disk=0)
    message = "error: unexpected TypeError; the traceback could not be saved; --debug prints it\n"
    assert (result.returncode, result.stderr) == (1, message)


# Folders that cannot be written, or read


@pytest.mark.parametrize(
    "words",
    [
        (*GAME_ARGS, "--agent", "random", "-o", "new"), ("export", "g.dmt", "--csv", "-o", "new"),
        ("verify", "g.dmt", "--update"), ("branch", "g.dmt", "--at", "9", "-o", "new"),
    ],
    ids=" ".join,
)  # fmt: skip
def test_a_read_only_folder_is_one_error_line(words: tuple[str, ...], folder: Path) -> None:
    before = (folder / "g.dmt").read_bytes()
    folder.chmod(0o555)
    result = run_wrapped(run_unprivileged, folder, *words)
    folder.chmod(0o755)
    assert result.returncode in (2, 3)
    assert re.fullmatch(
        r"(error|not rewritten): cannot write \S+: Permission denied\n", result.stderr
    )
    assert [path.name for path in folder.iterdir()] == ["g.dmt"]
    assert (folder / "g.dmt").read_bytes() == before


def test_a_read_only_transcript_is_not_resumed(tmp_path: Path) -> None:
    run_dmplay(tmp_path, *GAME_ARGS, "-o", "g.dmt", stdin="e\n")
    (tmp_path / "g.dmt").chmod(0o444)
    result = run_wrapped(run_unprivileged, tmp_path, "resume", "g.dmt", stdin="w\n")
    assert (result.returncode, result.stderr) == (
        2,
        "error: cannot write g.dmt: Permission denied\n",
    )
    assert assert_verified(tmp_path / "g.dmt")


@pytest.mark.parametrize("game", [GAME_ARGS, ("shell",)])
def test_a_read_only_state_folder_is_one_warning(game: tuple[str, ...], tmp_path: Path) -> None:
    saves_folder = tmp_path / "state" / "dmplay" / "games"
    saves_folder.mkdir(parents=True)
    saves_folder.chmod(0o555)
    typed = "play hexworld --seed 7\ne\n" if game == ("shell",) else "e\n"
    result = run_wrapped(run_unprivileged, tmp_path, *game, stdin=typed)
    assert result.returncode == 0
    assert "turn 1." in result.stdout
    assert result.stderr.count("\n") == 1 + result.stderr.count("again: ")
    assert result.stderr.startswith(
        f"warning: this game is not saved: {saves_folder}: Permission denied\n"
    )


def test_a_state_folder_with_an_overlong_path_is_one_warning(tmp_path: Path) -> None:
    deep = tmp_path / "state"
    while len(str(deep)) < MAX_FOLDER_CHARS:
        deep /= "x" * min(200, MAX_FOLDER_CHARS - len(str(deep)))
    result = run_dmplay(tmp_path, *GAME_ARGS, stdin="e\n", XDG_STATE_HOME=str(deep))
    assert result.returncode == 0
    assert "turn 1." in result.stdout
    assert re.match(r"warning: this game is not saved: .*: File name too long\n", result.stderr)


def test_verify_reports_a_folder_that_it_cannot_search(folder: Path) -> None:
    (folder / "shut").mkdir()
    (folder / "g.dmt").rename(folder / "shut" / "hidden.dmt")
    record_game(folder / "z.dmt", "hexworld", "random", turns=3)
    (folder / "shut").chmod(0)
    result = run_wrapped(run_unprivileged, folder, "verify", ".")
    (folder / "shut").chmod(stat.S_IRWXU)
    assert result.returncode == 3
    assert result.stdout.splitlines() == [
        "shut:1: cannot be read: Permission denied", "ok z.dmt (3 turns)", "1 verified, 1 failed",
    ]  # fmt: skip
