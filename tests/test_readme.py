"""The README does what it says: its sessions, its pictures, its one frame."""

from pathlib import Path

import pytest

from dmplay.finding.names import name_to_stem, problem_names
from dmplay.game.request import GameRequest
from dmplay.game.start import start_new_game
from dmplay.game.table import GameController
from dmplay.screen import frame
from dmplay.screen.press import handle_key
from dmplay.screen.screen import PlayScreen
from dmplay.screen.shown import Viewport
from dmplay.terminal import Terminal
from tests.support.blocks import README, ROOT, Reader
from tests.support.pictures import PICTURES, drawn


def test_what_the_readme_says_is_what_happens(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Reader(tmp_path, monkeypatch).follow(README)


def _one_every_day(picture: str) -> list[pytest.MarkDecorator]:
    return [] if "hexworld" in picture else [pytest.mark.slow]


@pytest.mark.parametrize(
    "picture", [pytest.param(one, marks=_one_every_day(one)) for one in PICTURES]
)
def test_a_picture_of_the_readme_is_what_is_exported_today(picture: str) -> None:
    assert (ROOT / picture).read_text(encoding="utf-8") == drawn(picture)


def test_the_readme_shows_a_screen_of_every_problem() -> None:
    stems = [name_to_stem(name) for name in problem_names()]
    assert sorted(Path(one).parent.name for one in PICTURES if one.count(".") == 2) == sorted(stems)


def test_the_frame_of_the_readme_is_what_the_screen_shows(tmp_path: Path) -> None:
    game = start_new_game(GameRequest("hexworld", seed=7, record_path=tmp_path / "g.dmt"))
    screen = PlayScreen(GameController(game), Terminal(True, "", True, False, False))
    for key in "hbhh":
        handle_key(screen, key)
    shown = frame.compose_frame(game, Viewport(80, 16), screen.frame_state, screen.log).plain
    rows = [row.rstrip() for row in shown.split("\n")]
    assert "\n".join(rows) in README
