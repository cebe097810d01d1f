"""Tests of the animated SVG: each screen is in it whole, and each distinct row only once."""

from pathlib import Path
from xml.etree import ElementTree

import pytest
from rich.text import Text

from dmplay.game.playback import Playback
from dmplay.output.film import COLUMN_WIDTH, ROW_HEIGHT, texts_to_animated_svg
from dmplay.output.transcript_export import ExportOptions, iter_screens, render_film
from dmplay.ui.screen.frame_state import Viewport
from tests.support.document_examples import PROJECT_ROOT
from tests.support.games import record_game

SVG = "{http://www.w3.org/2000/svg}"
VIEWPORT = Viewport(80, 18)
TRANSCRIPTS = sorted((PROJECT_ROOT / "transcripts").glob("*/*.dmt"))


def read_frames(svg: str) -> list[list[str]]:
    """Return the rows of each frame of a film as a viewer draws them, without trailing blanks."""
    *_, film = ElementTree.fromstring(svg)
    row_by_id: dict[str, str] = {}
    frames = []
    for frame in film:
        for row in frame.iter(f"{SVG}g"):
            if "id" in row.attrib:
                row_by_id[row.attrib["id"]] = read_row(row)
        frames.append([""] * VIEWPORT.height)
        for use in frame.iter(f"{SVG}use"):
            row_number = int(float(use.attrib["y"]) / ROW_HEIGHT)
            frames[-1][row_number] = row_by_id[use.attrib["href"].removeprefix("#")]
    return frames


def read_row(row: ElementTree.Element) -> str:
    """Return the text of a row; texts of different styles overlap only in blanks."""
    characters = [" "] * VIEWPORT.width
    for text in row.iter(f"{SVG}text"):
        left = round(float(text.attrib["x"]) / COLUMN_WIDTH)
        for column, character in enumerate((text.text or "").replace("\u00a0", " "), left):
            if character != " ":
                assert characters[column] == " "
                characters[column] = character
    return "".join(characters).rstrip()


@pytest.mark.parametrize("path", TRANSCRIPTS[::4], ids=lambda path: path.stem)
def test_a_film_contains_every_screen(path: Path) -> None:
    screens = [
        [row.rstrip() for row in screen.plain.split("\n")]
        for screen in iter_screens(Playback(path), VIEWPORT)
    ]
    svg = "".join(render_film(Playback(path), ExportOptions(VIEWPORT)))
    assert read_frames(svg) == screens


def test_a_row_that_recurs_is_written_once() -> None:
    svg = "".join(texts_to_animated_svg([Text("one\ntwo"), Text("two\none")], 2, "two rows", 9))
    assert (svg.count(">one<"), svg.count(">two<")) == (1, 1)
    assert svg.count('<use href="#r0"') == 2


def test_texts_are_coloured_underlined_and_escaped() -> None:
    text = Text.assemble(("<&", "bold reverse"), ("a", "underline"), " ", ("b", "underline"))
    svg = "".join(texts_to_animated_svg([text], 1, "styles", 9))
    assert '<rect fill="#c5c8c6" x="0" width="24.4"' in svg
    assert ">&lt;&amp;</text>" in svg
    assert "fill: #292929; font-weight: bold" in svg
    assert ">a</text>" in svg  # the blank between two underlined texts is not underlined
    assert ">b</text>" in svg


@pytest.mark.parametrize(
    ("problem", "settings"), [("hexworld", ("rewards=[]",)), ("travelers-dilemma", ())]
)
def test_a_film_has_at_most_three_kilobytes_per_turn(
    tmp_path: Path, problem: str, settings: tuple[str, ...]
) -> None:
    path = tmp_path / "game.dmt"
    record_game(path, problem, "random", turns=100, settings=settings)
    film = "".join(render_film(Playback(path), ExportOptions(VIEWPORT)))
    assert film.count("animation-delay") == 101
    assert len(film.encode()) < 300_000
