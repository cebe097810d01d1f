"""The README does what it says: its sessions, its example of a problem, its one frame."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from dmplay.game.playback import Playback
from dmplay.game.request import Request
from dmplay.game.start import new
from dmplay.game.table import Table
from dmplay.reports.export import ROOM, film
from dmplay.screen import frame
from dmplay.screen.screen import Screen
from dmplay.terminal import Terminal
from tests.support.programs import run
from tests.support.readme import README, ROOT, TIGER, blocks


def test_the_problem_of_the_readme_is_no_longer_than_fifteen_lines() -> None:
    assert len([line for line in TIGER.splitlines() if line.strip()]) <= 15


@pytest.mark.parametrize("block", blocks("console"))
def test_a_session_of_the_readme_prints_what_it_shows(tmp_path: Path, block: str) -> None:
    (tmp_path / "tiger.py").write_text(TIGER)
    commands = tmp_path / "bin"
    commands.mkdir()
    (commands / "dmplay").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m dmplay "$@"\n')
    (commands / "dmplay").chmod(0o755)
    env = os.environ | {
        "PATH": f"{commands}:{os.environ['PATH']}",
        "XDG_STATE_HOME": str(tmp_path / "state"),
    }
    for step in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
        command, _, shown = step.partition("\n")
        done = subprocess.run(
            command, shell=True, cwd=tmp_path, env=env, capture_output=True, text=True, check=True
        )
        assert done.stdout == shown


@pytest.mark.parametrize("picture", re.findall(r"\((transcripts/\S+\.svg)\)", README))
def test_a_film_of_the_readme_is_that_of_the_transcript_beside_it(picture: str) -> None:
    kept = ROOT / picture
    game = Playback(kept.with_suffix(".dmt"))
    assert kept.read_text(encoding="utf-8") == film(game, None, ROOM)


def test_the_readme_shows_a_map_a_board_and_a_belief_in_play() -> None:
    shown = set(re.findall(r"transcripts/(\w+)/\w+\.svg", README))
    assert shown == {"hexworld", "game_2048", "crying_baby"}


def test_the_settings_of_the_readme_are_in_force(tmp_path: Path) -> None:
    (settings,) = blocks("toml")
    (tmp_path / "dmplay.toml").write_text(settings)
    shown = run(tmp_path, "config", "show").stdout
    for name in ("play.turns", "play.set", "keys.hex.k", "aliases.hw"):
        assert re.search(rf"^{re.escape(name)} .* dmplay\.toml$", shown, re.MULTILINE)
    assert "hexworld, seed 7." in run(tmp_path, "hw").stdout


def test_the_problem_of_the_readme_is_played(tmp_path: Path) -> None:
    (tmp_path / "tiger.py").write_text(TIGER)
    words = ["./tiger.py:Tiger", "--agent", "plan", "--turns", "3", "--seed", "1", "-o", "g.dmt"]
    about = (["info", words[0]], ["agents", words[0]])
    for command in (words, ["verify", "g.dmt", "--trust"], ["replay", "g.dmt", "--trust"], *about):
        done = run(tmp_path, *command)
        told = "transcript: g.dmt\nreplay: dmplay replay g.dmt --trust\n"
        assert (done.returncode, done.stderr) in ((0, ""), (0, told))


def test_the_frame_of_the_readme_is_what_the_screen_shows(tmp_path: Path) -> None:
    game = new(Request("hexworld", seed=7, record=tmp_path / "g.dmt"))
    screen = Screen(Table(game), Terminal(True, "", True, False, False))
    for key in "hbhh":
        screen.press(key)
    shown = frame.compose(game, frame.Room(80, 16), screen.shown, screen.log).plain
    rows = [row.rstrip() for row in shown.split("\n")]
    assert "\n".join(rows) in README
