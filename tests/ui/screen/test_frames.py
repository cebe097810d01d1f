"""Tests that a player sees the stored frames: every problem, five moments, every size."""

from pathlib import Path

import pytest

from dmplay.registry.builtin_names import name_to_stem, problem_names
from tests.support.glyphs import ASCII_CHARACTERS, GLYPHS
from tests.ui.screen.frames import FRAMES_FOLDER, GAMES, SIZES, render_frames

REDRAW_ADVICE = "run `python -m tests.ui.screen.frames` and read the differences"


@pytest.mark.parametrize("name", GAMES)
def test_rendered_frames_equal_the_stored_frames(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    for path, text in render_frames(name, tmp_path).items():
        assert (FRAMES_FOLDER / path).exists(), f"no frames in {path}; {REDRAW_ADVICE}"
        assert text == (FRAMES_FOLDER / path).read_text(encoding="utf-8"), (
            f"{path}: if the change is intended, {REDRAW_ADVICE}"
        )


@pytest.mark.parametrize(("columns", "rows"), SIZES)
def test_every_frame_fits_its_terminal_and_uses_allowed_glyphs(columns: int, rows: int) -> None:
    for path in FRAMES_FOLDER.glob(f"*/{columns}x{rows}.txt"):
        for part in path.read_text(encoding="utf-8").removeprefix("== ").split("\n== "):
            moment, *frame = part.rstrip("\n").split("\n")
            assert len(frame) == rows, (path, moment)
            assert max(map(len, frame)) <= columns
            assert {*part} - {"\n"} <= (
                ASCII_CHARACTERS if moment.endswith("ASCII") else ASCII_CHARACTERS | GLYPHS
            )


def test_frames_are_stored_for_exactly_the_built_in_problems() -> None:
    assert {*GAMES} == {*problem_names()}, "add tests/ui/screen/kept/STEM/keys.json"
    sizes = [f"{columns}x{rows}.txt" for columns, rows in SIZES]
    expected = {FRAMES_FOLDER / name_to_stem(name) / size for name in GAMES for size in sizes}
    stored = {path for path in FRAMES_FOLDER.rglob("*.*") if path.name != "keys.json"}
    assert stored == expected, f"delete the files of other games; for missing ones, {REDRAW_ADVICE}"
