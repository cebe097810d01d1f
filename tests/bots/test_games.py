"""A game with a program in it: told, recorded, verified, gone on with, and never run unasked."""

import json
import shlex
import sys
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from tests.support.games import verified
from tests.support.programs import run

pytestmark = pytest.mark.slow
RANDOM = """
import json, pathlib, sys
pathlib.Path("begun").touch()
for line in sys.stdin:
    said = json.loads(line)
    if said["type"] == "hello":
        print('{"type": "hello", "protocol": 1, "draws": 1}', flush=True)
    elif said["type"] == "act":
        chosen = said["legal"][int(said["luck"][0] * len(said["legal"]))]
        print(json.dumps({"type": "act", "id": said["id"], "action": chosen}), flush=True)
    else:
        print(line, file=sys.stderr, end="")
"""
BOT = f"bot:{shlex.quote(sys.executable)} -S -E anything.py"
GAME = ("hexworld", "--seed", "7", "--turns", "9")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "anything.py").write_text(RANDOM)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def without_seats(path: Path) -> list[str]:
    rows = path.read_text().splitlines()
    return [row for row in rows if not row.startswith(("seats: ", "end: "))]


def test_its_game_is_that_of_the_agent_that_does_the_same(folder: Path) -> None:
    done = run(folder, *GAME, "--agent", BOT, "-o", "its.dmt")
    run(folder, *GAME, "--agent", "random", "-o", "ours.dmt")
    assert without_seats(folder / "its.dmt") == without_seats(folder / "ours.dmt")
    assert f"not re-asked: {BOT}" in run(folder, "verify", "its.dmt").stdout
    (log,) = [Path(row[5:]) for row in done.stderr.splitlines() if row.startswith("log: ")]
    told = [json.loads(row) for row in log.read_text().splitlines()]
    assert [said["type"] for said in told] == [*["turn"] * 10, "over", "quit"]
    assert told[-2]["reason"] == "turn limit"


def test_a_transcript_and_a_folder_run_no_program_unasked(folder: Path) -> None:
    run(folder, *GAME, "--agent", BOT, "-o", "game.dmt")
    whole = (folder / "game.dmt").read_text()
    half = whole[: whole.index("turn: 5\n")]
    (folder / "half.dmt").write_text(half)
    (folder / "begun").unlink()
    for line in ("verify game.dmt", "verify game.dmt --trust", "replay game.dmt",
                 "export game.dmt --csv"):  # fmt: skip
        assert run(folder, *line.split()).returncode == 0
    refused = run(folder, "resume", "half.dmt").stderr
    assert "is not built in; if it is yours, add --trust" in refused
    (folder / "dmplay.toml").write_text(f"[play]\nagent = {json.dumps(BOT)}\n")
    assert "play.agent: a folder's file sets looks" in run(folder, "hexworld").stderr
    (folder / "dmplay.toml").unlink()
    assert not (folder / "begun").exists()
    assert run(folder, "resume", "half.dmt", "--trust").returncode == 0
    assert (folder / "half.dmt").read_text() == whole


def test_a_forfeit_is_told_wherever_a_game_is(folder: Path) -> None:
    words = ("hexworld", "--seed", "7", "--agent", "bot:sh -c 'exit 3'")
    why = "agent forfeits, dead: ended with exit code 3"

    def told(*more: str) -> CompletedProcess[str]:
        done = run(folder, *words, *more)
        assert done.returncode == 0
        return done

    assert f"over: forfeit after 0 turns. {why}. agent score" in told().stdout
    quiet = told("--quiet", "-o", "game.dmt")
    assert (quiet.stdout, quiet.stderr) == ("", f"{why}\n")
    end = json.loads(told("--json").stdout.splitlines()[-1])
    assert (end["reason"], end["why"]) == ("forfeit", why)
    verified(folder / "game.dmt")


def test_its_many_games_are_the_same_in_one_process_and_in_two(folder: Path) -> None:
    words = ("run", "hexworld", "--agent", BOT, "--episodes", "40", "--turns", "5", "--csv")
    one, two = (run(folder, *words, "--workers", workers) for workers in ("1", "2"))
    assert one.stdout.count("\n") > 1
    assert one.stdout == two.stdout
    fault = ("--agent", "bot:sh -c 'exit 3'", "--workers", "2", "--episodes", "40")
    told = run(folder, "run", "hexworld", *fault).stderr
    assert told == "error: agent forfeits, dead: ended with exit code 3\n"
