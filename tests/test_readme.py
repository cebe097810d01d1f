"""Tests that the README and the page of pictures in `transcripts/` are up to date."""

import tomllib
from pathlib import Path

import pytest

import dmplay
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.registry.builtin_names import name_to_stem, problem_names
from dmplay.terminal.capabilities import Terminal
from dmplay.ui.screen import frame
from dmplay.ui.screen.frame_state import Viewport
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.play_screen import PlayScreen
from tests.support.document_examples import PROJECT_ROOT, README_TEXT, DocumentRunner
from tests.support.pictures import PICTURE_PATHS, export_picture


def test_the_sessions_of_the_readme_print_the_output_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    DocumentRunner(tmp_path, monkeypatch).follow(README_TEXT)


def _marks_of_picture(picture: str) -> list[pytest.MarkDecorator]:
    """Return the slow mark for every picture except those of hexworld."""
    return [] if "hexworld" in picture else [pytest.mark.slow]


@pytest.mark.parametrize(
    "picture", [pytest.param(path, marks=_marks_of_picture(path)) for path in PICTURE_PATHS]
)
def test_a_picture_of_the_page_equals_its_export(picture: str) -> None:
    advice = f"{picture}: `python -m tests.ui.screen.frames` draws it"
    assert (PROJECT_ROOT / picture).exists(), advice
    assert (PROJECT_ROOT / picture).read_text(encoding="utf-8") == export_picture(picture), advice


def test_the_page_of_pictures_shows_a_screen_of_every_problem() -> None:
    stems = [name_to_stem(name) for name in problem_names()]
    pictured_stems = [
        Path(picture).parent.name for picture in PICTURE_PATHS if picture.count(".") == 2
    ]
    assert sorted(pictured_stems) == sorted(stems), (
        "link one picture STEM/GAME.TURN.svg for each problem in transcripts/README.md; "
        "`python -m tests.ui.screen.frames` then draws it"
    )


def test_the_frame_of_the_readme_equals_the_screen(tmp_path: Path) -> None:
    game = start_new_game(GameRequest("hexworld", seed=7, record_path=tmp_path / "g.dmt"))
    screen = PlayScreen(GameController(game), Terminal(True, "", True, False, False))
    handle_key(screen, "tab")
    text = frame.compose_frame(game, Viewport(74, 16), screen.frame_state, screen.log).plain
    rows = [row.rstrip() for row in text.split("\n")]
    assert "\n".join(rows) in README_TEXT


def test_the_readme_has_at_most_1500_words() -> None:
    assert len(README_TEXT.split()) <= 1500, "what does not fit belongs to a page of the guide"


def test_the_readme_cites_this_version_with_its_authors_and_licence() -> None:
    metadata = tomllib.loads((PROJECT_ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    project = metadata["project"]
    (author,) = project["authors"]
    assert f"author  = {{{{{author['name']}}}}}" in README_TEXT
    assert f"version = {{{dmplay.__version__}}}" in README_TEXT
    assert f"license = {{{project['license']}}}" in README_TEXT
