"""What a player sees is what is kept: every problem, five moments, every size."""

from pathlib import Path

import pytest

from dmplay.finding.names import name_to_stem, problem_names
from tests.screen.frames import GAMES, KEPT, SIZES, frames
from tests.support.glyphs import GLYPHS, PLAIN


@pytest.mark.parametrize("name", GAMES)
def test_a_player_sees_the_frames_that_are_kept(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    for path, drawn in frames(name, tmp_path).items():
        assert drawn == (KEPT / path).read_text(encoding="utf-8")


@pytest.mark.parametrize(("columns", "rows"), SIZES)
def test_every_frame_fits_its_terminal_in_allowed_glyphs(columns: int, rows: int) -> None:
    for path in KEPT.glob(f"*/{columns}x{rows}.txt"):
        for part in path.read_text(encoding="utf-8").removeprefix("== ").split("\n== "):
            moment, *frame = part.rstrip("\n").split("\n")
            assert len(frame) == rows, (path, moment)
            assert max(map(len, frame)) <= columns
            assert {*part} - {"\n"} <= (PLAIN if moment.endswith("ASCII") else PLAIN | GLYPHS)


def test_frames_of_every_problem_are_kept_and_no_others() -> None:
    assert {*GAMES} == {*problem_names()}
    sizes = [f"{columns}x{rows}.txt" for columns, rows in SIZES]
    wanted = {KEPT / name_to_stem(name) / size for name in GAMES for size in sizes}
    assert {path for path in KEPT.rglob("*") if path.is_file()} == wanted
