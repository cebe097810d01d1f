"""The README does what it says: its sessions, its pictures, its one frame."""

import re
from pathlib import Path

import pytest

from dmplay.game.playback import Playback
from dmplay.game.request import Request
from dmplay.game.start import new
from dmplay.game.table import Table
from dmplay.reports.export import ROOM, film
from dmplay.screen import frame
from dmplay.screen.screen import Screen
from dmplay.screen.shown import Room
from dmplay.terminal import Terminal
from tests.support.blocks import README, ROOT, Reader


def test_what_the_readme_says_is_what_happens(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Reader(tmp_path, monkeypatch).follow(README)


@pytest.mark.parametrize("picture", re.findall(r"\((transcripts/\S+\.svg)\)", README))
def test_a_film_of_the_readme_is_that_of_the_transcript_beside_it(picture: str) -> None:
    kept = ROOT / picture
    game = Playback(kept.with_suffix(".dmt"))
    assert kept.read_text(encoding="utf-8") == "".join(film(game, None, ROOM))


def test_the_readme_shows_a_map_a_board_and_a_belief_in_play() -> None:
    shown = set(re.findall(r"transcripts/(\w+)/\w+\.svg", README))
    assert shown == {"hexworld", "game_2048", "crying_baby"}


def test_the_frame_of_the_readme_is_what_the_screen_shows(tmp_path: Path) -> None:
    game = new(Request("hexworld", seed=7, record=tmp_path / "g.dmt"))
    screen = Screen(Table(game), Terminal(True, "", True, False, False))
    for key in "hbhh":
        screen.press(key)
    shown = frame.compose(game, Room(80, 16), screen.shown, screen.log).plain
    rows = [row.rstrip() for row in shown.split("\n")]
    assert "\n".join(rows) in README
