"""Tests of games with a program in a seat: recording, verification, resumption and trust."""

import json
import shlex
import sys
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from tests.support.document_examples import NOISY_PROBLEM
from tests.support.games import assert_verified
from tests.support.programs import run_dmplay

pytestmark = pytest.mark.slow
RANDOM_BOT_SOURCE = """
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
BOT_AGENT = f"bot:{shlex.quote(sys.executable)} -S -E anything.py"
GAME_ARGUMENTS = ("hexworld", "--seed", "7", "--turns", "9")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "anything.py").write_text(RANDOM_BOT_SOURCE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def read_lines_without_seats(path: Path) -> list[str]:
    lines = path.read_text().splitlines()
    return [line for line in lines if not line.startswith(("seats: ", "end: "))]


def test_a_program_plays_the_same_game_as_an_equivalent_agent(folder: Path) -> None:
    result = run_dmplay(folder, *GAME_ARGUMENTS, "--agent", BOT_AGENT, "-o", "its.dmt")
    run_dmplay(folder, *GAME_ARGUMENTS, "--agent", "random", "-o", "ours.dmt")
    assert read_lines_without_seats(folder / "its.dmt") == read_lines_without_seats(
        folder / "ours.dmt"
    )
    assert f"not recomputed: {BOT_AGENT}" in run_dmplay(folder, "verify", "its.dmt").stdout
    (log,) = [Path(row[5:]) for row in result.stderr.splitlines() if row.startswith("log: ")]
    messages = [json.loads(row) for row in log.read_text().splitlines()]
    assert [message["type"] for message in messages] == [*["turn"] * 10, "over", "quit"]
    assert messages[-2]["reason"] == "turn limit"


def test_transcripts_and_project_settings_start_no_program_without_trust(folder: Path) -> None:
    run_dmplay(folder, *GAME_ARGUMENTS, "--agent", BOT_AGENT, "-o", "game.dmt")
    full_text = (folder / "game.dmt").read_text()
    first_half = full_text[: full_text.index("turn: 5\n")]
    (folder / "half.dmt").write_text(first_half)
    (folder / "begun").unlink()
    for line in ("verify game.dmt", "verify game.dmt --trust", "replay game.dmt",
                 "export game.dmt --csv"):  # fmt: skip
        assert run_dmplay(folder, *line.split()).returncode == 0
    error_output = run_dmplay(folder, "resume", "half.dmt").stderr
    assert "is not built in; if you trust its code, add --trust" in error_output
    (folder / "dmplay.toml").write_text(f"[play]\nagent = {json.dumps(BOT_AGENT)}\n")
    assert "play.agent: a settings file applies" in run_dmplay(folder, "hexworld").stderr
    (folder / "dmplay.toml").unlink()
    assert not (folder / "begun").exists()
    assert run_dmplay(folder, "resume", "half.dmt", "--trust").returncode == 0
    assert (folder / "half.dmt").read_text() == full_text


def test_every_output_format_reports_a_forfeit(folder: Path) -> None:
    arguments = ("hexworld", "--seed", "7", "--agent", "bot:sh -c 'exit 3'")
    reason = "agent forfeits, dead: the bot ended with exit code 3"

    def run_with_options(*options: str) -> CompletedProcess[str]:
        result = run_dmplay(folder, *arguments, *options)
        assert result.returncode == 0
        return result

    assert f"over: forfeit after 0 turns. {reason}. agent score" in run_with_options().stdout
    quiet = run_with_options("--quiet", "-o", "game.dmt")
    assert (quiet.stdout, quiet.stderr) == ("", f"{reason}\n")
    end = json.loads(run_with_options("--json").stdout.splitlines()[-1])
    assert (end["reason"], end["why"]) == ("forfeit", reason)
    assert_verified(folder / "game.dmt")


def test_a_batch_with_a_program_is_the_same_with_one_worker_and_with_two(folder: Path) -> None:
    arguments = (
        "run",
        "hexworld",
        "--agent",
        BOT_AGENT,
        "--episodes",
        "40",
        "--turns",
        "5",
        "--csv",
    )
    one_worker, two_workers = (
        run_dmplay(folder, *arguments, "--workers", worker_count) for worker_count in ("1", "2")
    )
    assert one_worker.stdout.count("\n") > 1
    assert one_worker.stdout == two_workers.stdout
    failing_options = ("--agent", "bot:sh -c 'exit 3'", "--workers", "2", "--episodes", "40")
    error_output = run_dmplay(folder, "run", "hexworld", *failing_options).stderr
    assert error_output == "error: agent forfeits, dead: the bot ended with exit code 3\n"


def test_a_problem_that_uses_the_standard_streams_does_not_disturb_its_bot(folder: Path) -> None:
    (folder / "noisy.py").write_text(NOISY_PROBLEM)
    bot = f"bot:{shlex.quote(sys.executable)} -m dmplay bot random --problem ./noisy.py:Noisy"
    result = run_dmplay(folder, "./noisy.py:Noisy", "--agent", bot, "--turns", "3", "-o", "its.dmt")
    assert result.returncode == 0
    assert "turn: 3" in (folder / "its.dmt").read_text()
